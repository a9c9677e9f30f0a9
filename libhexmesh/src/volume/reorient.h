// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "hexmesh/core/grid.h"

namespace hexmesh {

/// How a grid is stored again with right-handed axes nearest to L, P, S: axis d of the new grid is axis from[d] of the
/// stored one, reversed where flip[d].
class Reorientation {
public:
  explicit Reorientation(const Grid& stored);

  const Grid& grid() const noexcept { return grid_; }

  /// @param values  one per stored voxel
  template <class Value>
  std::vector<Value> apply(std::vector<Value> values) const {
    if (unchanged_) return values;
    std::vector<Value> out(values.size());
    const Index3& extent = grid_.extent();
    std::size_t n = 0;
    Index3 to;
    for (to[2] = 0; to[2] < extent[2]; ++to[2])
      for (to[1] = 0; to[1] < extent[1]; ++to[1])
        for (to[0] = 0; to[0] < extent[0]; ++to[0]) {
          Index3 from;
          for (std::size_t d = 0; d < 3; ++d) from[from_[d]] = flip_[d] ? extent[d] - 1 - to[d] : to[d];
          out[n++] = values[stored_.offset(from)];
        }
    return out;
  }

private:
  Grid stored_, grid_;
  std::array<std::size_t, 3> from_{};
  std::array<bool, 3> flip_{};
  bool unchanged_ = false;
};

}  // namespace hexmesh
