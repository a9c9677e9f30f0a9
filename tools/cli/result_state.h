// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "cli/tool.h"
#include "hexmesh/file/result_file.h"

namespace hextools {

/// Say so if a result is not the solution of its scene.
inline void warn_of_state(const hexmesh::Result& result, const Console& console) {
  if (result.report.empty()) return;
  const auto report = nlohmann::json::parse(result.report);
  if (!report.value("converged", true))
    console.warning(fmt::format("the result is not converged, it is the state at {:.3g} of the load: {}",
                                report.value("load_fraction", 0.0), report.value("reason", "")));
}

}  // namespace hextools
