// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <istream>
#include <string>

namespace hexmesh {

/// What a stream holds, `most` bytes and one more at most: it may have no end.
inline std::string bounded_text(std::istream& from, std::size_t most) {
  constexpr std::size_t step = 1 << 16;
  std::string text;
  while (from && text.size() <= most) {
    const std::size_t size = text.size();
    text.resize(size + step);
    from.read(&text[size], static_cast<std::streamsize>(step));
    text.resize(size + static_cast<std::size_t>(from.gcount()));
  }
  return text;
}

}  // namespace hexmesh
