// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <cstring>
#include <span>

namespace hexmesh {

/// One past the run of equal labels that begins at `begin`, found four at a time.
inline std::size_t end_of_run(std::span<const std::uint16_t> row, std::size_t begin) {
  const std::uint64_t four = row[begin] * 0x0001000100010001ULL;
  std::size_t end = begin + 1;
  for (std::uint64_t next = 0; end + 4 <= row.size(); end += 4) {
    std::memcpy(&next, &row[end], sizeof(next));
    if (next != four) break;
  }
  while (end < row.size() && row[end] == row[begin]) ++end;
  return end;
}

/// Calls use(label, begin, end) for each run of equal labels of a row: far fewer than voxels.
template <class Use>
void for_each_run(std::span<const std::uint16_t> row, Use&& use) {
  for (std::size_t begin = 0, end = 0; begin < row.size(); begin = end) {
    end = end_of_run(row, begin);
    use(row[begin], begin, end);
  }
}

}  // namespace hexmesh
