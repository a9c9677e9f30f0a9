// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cctype>
#include <string>

namespace hexmesh {

/// In lower case; ASCII letters only.
inline std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::tolower(c); });
  return text;
}

/// Bytes of the UTF-8 character that begins at `at`; 0 if none does.
/// Source: The Unicode Standard 15.0, table 3-7.
std::size_t utf8_length(const std::string& text, std::size_t at);

bool is_utf8(const std::string& text);

/// The same text, with each byte that is no part of a UTF-8 character replaced by U+FFFD.
std::string to_utf8(const std::string& text);

}  // namespace hexmesh
