// SPDX-License-Identifier: Apache-2.0
#include "text.h"

#include <algorithm>

namespace hexmesh {

std::size_t utf8_length(const std::string& text, std::size_t at) {
  const auto byte = [&](std::size_t n) { return n < text.size() ? static_cast<unsigned char>(text[n]) : 0; };
  const auto is_in = [](int b, int low, int high) { return b >= low && b <= high; };
  const int first = byte(at), second = byte(at + 1);
  if (first < 0x80) return at < text.size() ? 1 : 0;
  // Of three and four bytes the second is bounded further: no longer form than needed, no surrogates, at most U+10FFFF.
  const int low = first == 0xe0 ? 0xa0 : first == 0xf0 ? 0x90 : 0x80;
  const int high = first == 0xed ? 0x9f : first == 0xf4 ? 0x8f : 0xbf;
  const std::size_t length = is_in(first, 0xc2, 0xdf)   ? 2
                             : is_in(first, 0xe0, 0xef) ? 3
                             : is_in(first, 0xf0, 0xf4) ? 4
                                                        : 0;
  if (length == 0 || !is_in(second, low, high)) return 0;
  for (std::size_t n = 2; n < length; ++n)
    if (!is_in(byte(at + n), 0x80, 0xbf)) return 0;
  return length;
}

bool is_utf8(const std::string& text) {
  // Nearly every text has one byte a character.
  if (std::none_of(text.begin(), text.end(), [](char c) { return static_cast<signed char>(c) < 0; })) return true;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t length = utf8_length(text, at);
    if (length == 0) return false;
    at += length;
  }
  return true;
}

std::string to_utf8(const std::string& text) {
  if (is_utf8(text)) return text;
  std::string out;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t length = utf8_length(text, at);
    out += length > 0 ? text.substr(at, length) : "\xef\xbf\xbd";
    at += std::max<std::size_t>(length, 1);
  }
  return out;
}

}  // namespace hexmesh
