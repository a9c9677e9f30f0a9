// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <vector>

namespace hexmesh {

/// Sets of numbers joined pair by pair.
class Partition {
public:
  explicit Partition(std::size_t size) : parent_(size) { std::iota(parent_.begin(), parent_.end(), 0); }
  std::int32_t root(std::int32_t n) {
    while (parent_[n] != n) {
      auto& p = parent_[n];
      p = parent_[p];
      n = p;
    }
    return n;
  }
  /// @returns whether they were apart
  bool join(std::int32_t a, std::int32_t b) {
    a = root(a);
    b = root(b);
    parent_[std::max(a, b)] = std::min(a, b);
    return a != b;
  }

private:
  std::vector<std::int32_t> parent_;
};

}  // namespace hexmesh
