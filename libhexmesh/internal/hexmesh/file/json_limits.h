// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

namespace hexmesh {

/// JSON from a file: of bounded size, number of values and depth, so that whoever walks through it comes to an end.
/// @throws std::runtime_error naming what is wrong
nlohmann::json parse_json(const std::string& text);

}  // namespace hexmesh
