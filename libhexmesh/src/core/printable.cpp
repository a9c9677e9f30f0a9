// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/core/printable.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <utility>

namespace hexmesh {
namespace {

/// The character that a text begins with, and how many bytes it has; 0 bytes where they are no UTF-8.
/// Source: RFC 3629, section 4: no longer forms than needed, no surrogates, nothing beyond U+10FFFF.
std::pair<std::uint32_t, std::size_t> first_character(std::string_view text) {
  const auto byte = [&](std::size_t n) { return static_cast<unsigned char>(text[n]); };
  const std::uint32_t lead = byte(0);
  if (lead < 0x80) return {lead, 1};
  const std::size_t length = lead >= 0xf0 ? 4 : lead >= 0xe0 ? 3 : 2;
  if (lead < 0xc2 || lead > 0xf4 || text.size() < length) return {0, 0};
  std::uint32_t code = lead & (0x7fU >> length);
  for (std::size_t n = 1; n < length; ++n) {
    if ((byte(n) & 0xc0U) != 0x80) return {0, 0};
    code = code << 6 | (byte(n) & 0x3fU);
  }
  const bool is_longer_than_needed = (length == 3 && code < 0x800) || (length == 4 && code < 0x10000);
  if (is_longer_than_needed || (code >= 0xd800 && code <= 0xdfff) || code > 0x10ffff) return {0, 0};
  return {code, length};
}

bool is_control(std::uint32_t code) {
  const bool turns_writing = code == 0x061c || code == 0x200e || code == 0x200f || (code >= 0x202a && code <= 0x202e) ||
                             (code >= 0x2066 && code <= 0x2069);
  return code < 0x20 || (code >= 0x7f && code < 0xa0) || code == 0x2028 || code == 0x2029 || turns_writing;
}

}  // namespace

std::string printable(std::string_view text) {
  std::string out;
  while (!text.empty()) {
    const auto [code, length] = first_character(text);
    if (length == 0)
      out += fmt::format("\\x{:02x}", static_cast<unsigned char>(text[0]));
    else if (is_control(code) && code != '\n' && code != '\t')
      out += code < 0x80 ? fmt::format("\\x{:02x}", code) : fmt::format("\\u{:04x}", code);
    else
      out += text.substr(0, length);
    text.remove_prefix(std::max<std::size_t>(length, 1));
  }
  return out;
}

std::string printable_line(std::string_view text) {
  std::string out = printable(text);
  for (char& c : out)
    if (c == '\n') c = ' ';
  return out;
}

}  // namespace hexmesh
