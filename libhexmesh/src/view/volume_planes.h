// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <vector>

#include "volume_camera.h"

namespace hexmesh {

/// The cells of one state as a camera sees them.
struct SeenCells {
  std::vector<Eigen::Vector3f> nodes;  ///< VolumeCamera::seen() from its centre [mm]
  /// Of each cell: towards the light, in the rest shape along the voxels' axes.
  std::vector<std::array<float, 3>> light;
};

/// The polygons in which a plane across the view cuts cells.
struct VolumePlane {
  struct Corner {
    float x, y;  ///< [pixels]
    std::array<float, 3> texture;
  };
  struct Polygon {
    std::int32_t first, count;  ///< of the plane's corners; the first one is inside, the others are the outline
    float top, bottom;
    std::array<float, 3> light;  ///< of its cell
  };
  std::vector<Corner> corners;
  std::vector<Polygon> polygons;
};

/// Cuts the cells of a result by planes across the view.
class PlaneCutter {
public:
  /// All must outlive this.
  PlaneCutter(const Result& result, const VolumeCamera& camera, const VolumeOptions& options)
      : result_(result), camera_(camera), options_(options) {}

  /// @param displacement  of the nodes; empty = at rest
  SeenCells see(const std::vector<Vec3>& displacement) const;

  /// The cells that each plane cuts, those whose depths it lies between; plane 0 is the farthest.
  std::vector<std::vector<std::int32_t>> cells_of_planes(const SeenCells& seen) const;

  /// @param cells  that the plane cuts
  void cut(const SeenCells& seen, int plane, const std::vector<std::int32_t>& cells, VolumePlane& out) const;

private:
  std::array<float, 3> light_in(const std::array<Eigen::Vector3f, 8>& corners, const Vec3& light) const;
  std::array<Eigen::Vector3f, 8> corners_of(const SeenCells& seen, std::size_t cell) const;

  const Result& result_;
  const VolumeCamera& camera_;
  const VolumeOptions& options_;
};

}  // namespace hexmesh
