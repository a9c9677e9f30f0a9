// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "hexmesh/lattice/locator.h"
#include "hexmesh/result/result.h"

namespace hexmesh {

/// Of a node [mm]; zero at rest.
inline Vec3 displacement_of(const Result& result, std::int32_t node) {
  return result.displacement.empty() ? Vec3::Zero() : result.displacement[node];
}

/// u = H u(q) of a place in a cell.
Vec3 embedded(const Result& result, const Embedding& e);

/// Material of a body at rest: voxels with a material that are in its cells.
class Solid {
public:
  explicit Solid(const Result& result) : result_(result), locator_(locator_of(result)), has_material_(65536, false) {
    for (const LatticeSegment& s : result.segments) has_material_[s.segment.label] = s.material.has_value();
  }

  bool at(const Index3& voxel) const {
    return result_.voxels.contains(voxel) && has_material_[result_.labels[result_.voxels.offset(voxel)]] &&
           locator_.cell_of_voxel(voxel) >= 0;
  }

  /// Distance of a continuous voxel index from the nearest voxel of material, in voxels along the axis where it is
  /// largest; 0 inside one, infinite beyond `reach`.
  double distance(const Vec3& index, double reach) const;

  /// Whether a cell has another one on every side, edge and corner.
  bool is_interior(const Index3& cell) const;

  const CellLocator& locator() const { return locator_; }

private:
  const Result& result_;
  CellLocator locator_;
  std::vector<bool> has_material_;
};

/// Calls `use(rest position, displacement)` for the centre of each voxel of material.
template <class Use>
void for_each_voxel(const Result& result, Use&& use) {
  const Solid solid(result);
  const Grid& grid = result.voxels;
  for (std::size_t n = 0; n < grid.num_voxels(); ++n) {
    const Index3 v = grid.index(n);
    if (!solid.at(v)) continue;
    const Vec3 index(v[0], v[1], v[2]);
    const Embedding e = solid.locator().in_cell_of_voxel(v, index);
    use(grid.position(index), result.displacement.empty() ? Vec3(Vec3::Zero()) : embedded(result, e));
  }
}

}  // namespace hexmesh
