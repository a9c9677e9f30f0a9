// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "hexmesh/geometry/triangle_surface.h"
#include "hexmesh/lattice/locator.h"
#include "hexmesh/lattice/nodes.h"

namespace hexmesh {

/// Points that move with the cells of a level, u(p) = H u(q): the paper's eq. (1).
class EmbeddedPoints {
public:
  /// @param locator     of the level
  /// @param cell_nodes  of the level
  /// @param points      rest positions [mm]; those that no cell holds stay
  EmbeddedPoints(const CellLocator& locator, const std::vector<CellNodes>& cell_nodes, const std::vector<Vec3>& points);

  /// A picture surface. Where cells keep segments apart its points move with the cells of the nearest voxels of their
  /// segment, so that it stays with it where another slides along.
  /// @param labels  of the lattice's box, for that; empty: points move with the cells they are in
  EmbeddedPoints(const CellLocator& locator, const std::vector<CellNodes>& cell_nodes, const TriangleSurface& surface,
                 const Parting& parting, std::span<const std::uint16_t> labels);

  std::size_t size() const noexcept { return points_.size(); }

  /// @param nodal  (x, y, z) of node 0, of node 1, ...
  /// @param out    the same field at the points, resized to size()
  void interpolate(std::span<const double> nodal, std::vector<Vec3>& out) const;

private:
  void embed(std::size_t point, const Embedding& e, const std::vector<CellNodes>& cell_nodes);

  struct Point {
    CellNodes nodes{};
    NodeWeights weights = NodeWeights::Zero();
  };
  std::vector<Point> points_;
};

}  // namespace hexmesh
