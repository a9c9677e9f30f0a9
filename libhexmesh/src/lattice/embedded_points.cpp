// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/lattice/embedded_points.h"

namespace hexmesh {

EmbeddedPoints::EmbeddedPoints(const CellLocator& locator, const std::vector<CellNodes>& cell_nodes,
                               const std::vector<Vec3>& points) {
  points_.resize(points.size());
  for (std::size_t p = 0; p < points.size(); ++p) {
    const Embedding e = locator.locate_position(points[p]);
    if (e.cell >= 0) points_[p] = {cell_nodes[e.cell], shape_functions(e.local)};
  }
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
