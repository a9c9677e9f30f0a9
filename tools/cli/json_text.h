// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace hextools {

/// JSON on one line. Bytes of names that are no UTF-8, which JSON cannot hold, become U+FFFD.
template <class Json>
std::string json_line(const Json& value) {
  return value.dump(-1, ' ', false, Json::error_handler_t::replace);
}

/// Likewise as a file for reading.
template <class Json>
std::string json_text(const Json& value) {
  return value.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace hextools
