// SPDX-License-Identifier: Apache-2.0
#include "volume_planes.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

namespace hexmesh {
namespace {

using Corner = VolumePlane::Corner;

/// The edges of a cell: two nodes that differ in one bit.
constexpr std::array<std::array<int, 2>, 12> cell_edges = {
    {{0, 1}, {2, 3}, {4, 5}, {6, 7}, {0, 2}, {1, 3}, {4, 6}, {5, 7}, {0, 4}, {1, 5}, {2, 6}, {3, 7}}};

/// Grows from 0 to 4 with the angle of (x, y): the quadrant by the signs, within it by the share of one coordinate.
float order_around(float x, float y) {
  const float sum = std::abs(x) + std::abs(y);
  if (sum == 0) return 0;
  if (y >= 0) return x >= 0 ? y / sum : 1 - x / sum;
  return x < 0 ? 2 - y / sum : 3 + x / sum;
}

/// Where a plane cuts the edges of a cell.
struct Outline {
  std::array<std::pair<float, Corner>, 12> corners;  ///< with their order around the mean
  std::size_t count = 0;
  Corner mean{};

  /// Find the mean, and sort the corners by their angles around it.
  void sort() {
    const float part = 1 / static_cast<float>(count);
    mean.x *= part;
    mean.y *= part;
    for (float& t : mean.texture) t *= part;
    for (std::size_t n = 0; n < count; ++n) {
      corners[n].first = order_around(corners[n].second.x - mean.x, corners[n].second.y - mean.y);
      for (std::size_t m = n; m > 0 && corners[m].first < corners[m - 1].first; --m)
        std::swap(corners[m], corners[m - 1]);
    }
  }

  void append_to(VolumePlane& plane, const std::array<float, 3>& light) const {
    VolumePlane::Polygon polygon{static_cast<std::int32_t>(plane.corners.size()), static_cast<std::int32_t>(count) + 1,
                                 mean.y, mean.y, light};
    plane.corners.push_back(mean);
    for (std::size_t n = 0; n < count; ++n) {
      const Corner& corner = corners[n].second;
      plane.corners.push_back(corner);
      polygon.top = std::min(polygon.top, corner.y);
      polygon.bottom = std::max(polygon.bottom, corner.y);
    }
    plane.polygons.push_back(polygon);
  }
};

}  // namespace

std::array<Eigen::Vector3f, 8> PlaneCutter::corners_of(const SeenCells& seen, std::size_t cell) const {
  std::array<Eigen::Vector3f, 8> corners;
  for (std::size_t a = 0; a < 8; ++a) corners[a] = seen.nodes[result_.cell_nodes[cell][a]];
  return corners;
}

SeenCells PlaneCutter::see(const std::vector<Vec3>& displacement) const {
  SeenCells seen;
  seen.nodes.resize(result_.nodes.size());
  for (std::size_t n = 0; n < result_.nodes.size(); ++n) {
    const Vec3 p = result_.nodes[n] - camera_.center + (displacement.empty() ? Vec3(Vec3::Zero()) : displacement[n]);
    seen.nodes[n] = camera_.seen(p).cast<float>();
  }
  seen.light.resize(result_.cells.size());
  if (!options_.shaded) return seen;
  const Vec3 light = (-0.5 * camera_.right - 0.6 * camera_.down - camera_.view).normalized();
  for (std::size_t c = 0; c < result_.cells.size(); ++c) seen.light[c] = light_in(corners_of(seen, c), light);
  return seen;
}

/// A normal is turned by F^-T: n . F^-1 light, exact where the cell is turned, about right where it is strained.
std::array<float, 3> PlaneCutter::light_in(const std::array<Eigen::Vector3f, 8>& corners, const Vec3& light) const {
  Mat3 edges;  // F
  for (int d = 0; d < 3; ++d) {
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();
    for (int a = 0; a < 8; ++a) sum += (corner_bit(a, d) == 1 ? 0.25F : -0.25F) * corners[a];
    edges.col(d) = sum.cast<double>() / (result_.voxels_per_cell[d] * result_.voxels.spacing()[d]);
  }
  Vec3 rest = std::abs(edges.determinant()) > 1e-6 ? Vec3(edges.inverse() * camera_.seen(light)) : Vec3(Vec3::Zero());
  if (const double length = rest.norm(); length > 0) rest /= length;
  const Eigen::Vector3f out = rest.cast<float>();
  return {out[0], out[1], out[2]};
}

std::vector<std::vector<std::int32_t>> PlaneCutter::cells_of_planes(const SeenCells& seen) const {
  const double distance = camera_.plane_distance(options_.planes);
  std::vector<std::vector<std::int32_t>> cut_by(as_size(options_.planes));
  for (std::size_t c = 0; c < result_.cells.size(); ++c) {
    double nearest = std::numeric_limits<double>::infinity(), farthest = -nearest;
    for (const Eigen::Vector3f& corner : corners_of(seen, c)) {
      nearest = std::min<double>(nearest, corner[2]);
      farthest = std::max<double>(farthest, corner[2]);
    }
    const double first = std::ceil((camera_.far - farthest) / distance - 0.5);
    const double last = std::floor((camera_.far - nearest) / distance - 0.5);
    for (double n = std::max(0.0, first); n <= std::min(last, options_.planes - 1.0); ++n)
      cut_by[static_cast<std::size_t>(n)].push_back(static_cast<std::int32_t>(c));
  }
  return cut_by;
}

/// A plane's intersections with the edges of a cell, in the order of their angles around the mean, are the order of the
/// outline wherever that is seen whole from there.
void PlaneCutter::cut(const SeenCells& seen, int plane, const std::vector<std::int32_t>& cells,
                      VolumePlane& out) const {
  out.corners.clear();
  out.polygons.clear();
  const auto depth = static_cast<float>(camera_.far - (plane + 0.5) * camera_.plane_distance(options_.planes));
  double scale = 1 / camera_.pixel;
  if (camera_.focal > 0) scale *= camera_.focal / (camera_.focal + depth - camera_.near);
  const auto zoom = static_cast<float>(scale);
  const float middle_x = static_cast<float>(options_.width) / 2 - 0.5F;
  const float middle_y = static_cast<float>(options_.height) / 2 - 0.5F;
  for (const std::int32_t cell : cells) {
    Outline outline;
    Corner& mean = outline.mean;
    for (const auto& [a, b] : cell_edges) {
      // From the lower node, so that all cells of an edge agree to the last bit.
      const CellNodes& nodes = result_.cell_nodes[cell];
      const Eigen::Vector3f &p = seen.nodes[nodes[a]], &q = seen.nodes[nodes[b]];
      if ((p[2] < depth) == (q[2] < depth)) continue;
      const float t = (depth - p[2]) / (q[2] - p[2]);
      Corner& corner = outline.corners[outline.count++].second;
      corner.x = middle_x + zoom * (p[0] + t * (q[0] - p[0]));
      corner.y = middle_y + zoom * (p[1] + t * (q[1] - p[1]));
      for (int d = 0; d < 3; ++d) {
        // Voxel (0, 0, 0) is texel (1, 1, 1); its corner lies half a voxel before it.
        const int side_a = corner_bit(a, d), side_b = corner_bit(b, d);
        const float place = static_cast<float>(side_a) + t * static_cast<float>(side_b - side_a);
        corner.texture[d] =
            (static_cast<float>(result_.cells[cell][d]) + place) * static_cast<float>(result_.voxels_per_cell[d]) +
            0.5F;
        mean.texture[d] += corner.texture[d];
      }
      mean.x += corner.x;
      mean.y += corner.y;
    }
    if (outline.count < 3) continue;
    outline.sort();
    outline.append_to(out, seen.light[cell]);
  }
}

}  // namespace hexmesh
