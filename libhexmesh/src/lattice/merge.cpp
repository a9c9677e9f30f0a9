// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/lattice/merge.h"

#include <algorithm>
#include <cmath>

namespace hexmesh {

Index3 merge_factor(const Vec3& cell_size) {
  Index3 factor = {1, 1, 1};
  for (int d = 0; d < 3; ++d)
    if (cell_size[d] * std::sqrt(2.0) < cell_size.maxCoeff()) factor[d] = 2;
  return factor == Index3{1, 1, 1} ? Index3{2, 2, 2} : factor;
}

Merge merge_cells(std::span<const Index3> cells, const Index3& factor) {
  const auto parent_of = [&](const Index3& c) { return Index3{c[0] / factor[0], c[1] / factor[1], c[2] / factor[2]}; };
  const auto key = [](const Index3& c) {
    return static_cast<std::uint64_t>(c[2]) << 42 | static_cast<std::uint64_t>(c[1]) << 21 |
           static_cast<std::uint64_t>(c[0]);
  };
  std::vector<std::pair<std::uint64_t, std::int32_t>> order(cells.size());
  for (std::size_t n = 0; n < cells.size(); ++n) order[n] = {key(parent_of(cells[n])), static_cast<std::int32_t>(n)};
  std::sort(order.begin(), order.end());

  Merge merge{factor, {}, {}};
  for (std::size_t n = 0; n < order.size(); ++n) {
    const Index3& child = cells[order[n].second];
    if (n == 0 || order[n].first != order[n - 1].first) {
      merge.parents.push_back(parent_of(child));
      merge.children.push_back({-1, -1, -1, -1, -1, -1, -1, -1});
    }
    int slot = 0;
    for (int d = 0; d < 3; ++d) slot |= (child[d] % factor[d]) << d;
    merge.children.back()[slot] = order[n].second;
  }
  return merge;
}

}  // namespace hexmesh
