// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "cli/tool.h"
#include "report/lattice_json.h"

namespace hextools {

/// describe() as a table for reading.
std::string table(const nlohmann::json& report);

/// The finest level with cells that join what is apart.
void note_joined(const nlohmann::json& report, const Console& console);

}  // namespace hextools
