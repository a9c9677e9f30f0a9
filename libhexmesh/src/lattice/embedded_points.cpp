// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/lattice/embedded_points.h"

#include <cmath>
#include <limits>

namespace hexmesh {
namespace {

/// Of those with a label within two voxels of a place; outside of the box if there are none.
Index3 nearest_voxel_of(std::uint16_t label, const Grid& voxels, std::span<const std::uint16_t> labels,
                        const Vec3& index) {
  constexpr int reach = 2;
  const Index3 home = nearest_voxel(index);
  Index3 nearest = {-1, -1, -1}, v;
  double least = std::numeric_limits<double>::infinity();
  for (v[2] = home[2] - reach; v[2] <= home[2] + reach; ++v[2])
    for (v[1] = home[1] - reach; v[1] <= home[1] + reach; ++v[1])
      for (v[0] = home[0] - reach; v[0] <= home[0] + reach; ++v[0]) {
        if (!voxels.contains(v) || labels[voxels.offset(v)] != label) continue;
        const double distance = (Vec3(v[0], v[1], v[2]) - index).cwiseProduct(voxels.spacing()).squaredNorm();
        if (!(distance < least)) continue;
        least = distance;
        nearest = v;
      }
  return nearest;
}

}  // namespace

EmbeddedPoints::EmbeddedPoints(const CellLocator& locator, const std::vector<CellNodes>& cell_nodes,
                               const std::vector<Vec3>& points) {
  points_.resize(points.size());
  for (std::size_t p = 0; p < points.size(); ++p) embed(p, locator.locate_position(points[p]), cell_nodes);
}

EmbeddedPoints::EmbeddedPoints(const CellLocator& locator, const std::vector<CellNodes>& cell_nodes,
                               const TriangleSurface& surface, const Parting& parting,
                               std::span<const std::uint16_t> labels)
    : EmbeddedPoints(locator, cell_nodes, surface.points) {
  if (!parting.any() || labels.empty()) return;
  const Grid& voxels = locator.voxels();
  for (std::size_t t = 0; t < surface.triangles.size(); ++t)
    for (const std::int32_t p : surface.triangles[t]) {
      const Vec3 index = voxels.continuous_index(surface.points[as_size(p)]);
      const Index3 voxel = nearest_voxel_of(surface.segment[t], voxels, labels, index);
      if (const Embedding e = locator.in_cell_of_voxel(voxel, index); e.cell >= 0) embed(as_size(p), e, cell_nodes);
    }
}

void EmbeddedPoints::embed(std::size_t point, const Embedding& e, const std::vector<CellNodes>& cell_nodes) {
  if (e.cell >= 0) points_[point] = {cell_nodes[e.cell], shape_functions(e.local)};
}

void EmbeddedPoints::interpolate(std::span<const double> nodal, std::vector<Vec3>& out) const {
  out.resize(points_.size());
  for (std::size_t p = 0; p < points_.size(); ++p) {
    out[p].setZero();
    for (std::size_t a = 0; a < 8; ++a)
      out[p] += points_[p].weights[a] * Eigen::Map<const Vec3>(&nodal[3 * as_size(points_[p].nodes[a])]);
  }
}

}  // namespace hexmesh
