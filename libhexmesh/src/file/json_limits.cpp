// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/file/json_limits.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <stdexcept>

namespace hexmesh {
namespace {

constexpr std::size_t most_bytes = std::size_t{1} << 26, most_values = std::size_t{1} << 21;
constexpr int most_depth = 64;

}  // namespace

nlohmann::json parse_json(const std::string& text) {
  using nlohmann::json;
  if (text.size() > most_bytes)
    throw std::runtime_error(fmt::format("JSON of {} bytes, expected at most {} MB", text.size(), most_bytes >> 20));
  std::size_t values = 0;
  const auto count = [&](int depth, json::parse_event_t event, const json& /*value*/) {
    const bool is_new = event == json::parse_event_t::value || event == json::parse_event_t::object_start ||
                        event == json::parse_event_t::array_start || event == json::parse_event_t::key;
    if (depth > most_depth) throw std::runtime_error(fmt::format("JSON deeper than {} levels", most_depth));
    if (is_new && ++values > most_values)
      throw std::runtime_error(fmt::format("JSON of more than {} values", most_values));
    return true;
  };
  try {
    return json::parse(text, count);
  } catch (const json::exception& e) {
    throw std::runtime_error(fmt::format("JSON that cannot be read ({})", e.what()));
  }
}

}  // namespace hexmesh
