// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/tetra/tet_mesh.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

namespace hexmesh {
namespace {

constexpr std::array<std::array<int, 3>, 4> faces = {{{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}}};

using Edge = std::array<std::int32_t, 2>;

Edge edge_of(std::int32_t a, std::int32_t b) { return {std::min(a, b), std::max(a, b)}; }

}  // namespace

Mat3 tet_frame(const TetMesh& mesh, std::size_t tet) {
  const auto& c = mesh.corners[tet];
  const auto point = [&](int a) { return mesh.points[c[a]]; };
  Mat3 frame;
  frame << point(1) - point(0), point(2) - point(0), point(3) - point(0);
  return frame;
}

double volume(const TetMesh& mesh) {
  double sum = 0;
  for (std::size_t t = 0; t < mesh.size(); ++t) sum += tet_frame(mesh, t).determinant() / 6;
  return sum;
}

TetMesh quadratic(TetMesh mesh) {
  std::map<Edge, std::int32_t> middle;
  mesh.middles.resize(mesh.size());
  for (std::size_t t = 0; t < mesh.size(); ++t)
    for (std::size_t e = 0; e < tet_edges.size(); ++e) {
      const std::int32_t a = mesh.node(t, tet_edges[e][0]), b = mesh.node(t, tet_edges[e][1]);
      const auto [found, is_new] = middle.try_emplace(edge_of(a, b), static_cast<std::int32_t>(mesh.points.size()));
      if (is_new) mesh.points.push_back((mesh.points[a] + mesh.points[b]) / 2);
      mesh.middles[t][e] = found->second;
    }
  return mesh;
}

std::vector<std::array<std::int32_t, 3>> boundary_triangles(const TetMesh& mesh) {
  std::map<std::array<std::int32_t, 3>, std::pair<std::array<std::int32_t, 3>, int>> seen;  // by sorted corners
  for (std::size_t t = 0; t < mesh.size(); ++t)
    for (const auto& f : faces) {
      const std::array<std::int32_t, 3> face = {mesh.node(t, f[0]), mesh.node(t, f[1]), mesh.node(t, f[2])};
      std::array<std::int32_t, 3> key = face;
      std::sort(key.begin(), key.end());
      auto& entry = seen[key];
      entry.first = face;
      ++entry.second;
    }
  std::vector<std::array<std::int32_t, 3>> out;
  for (const auto& [key, entry] : seen)
    if (entry.second == 1) out.push_back(entry.first);
  return out;
}

std::vector<bool> surface_nodes(const TetMesh& mesh) {
  std::vector<bool> on_surface(mesh.points.size());
  std::map<Edge, bool> edges;
  for (const auto& f : boundary_triangles(mesh))
    for (std::size_t a = 0; a < 3; ++a) {
      on_surface[f[a]] = true;
      edges[edge_of(f[a], f[(a + 1) % 3])] = true;
    }
  for (std::size_t t = 0; t < mesh.middles.size(); ++t)
    for (std::size_t e = 0; e < tet_edges.size(); ++e)
      if (edges.contains(edge_of(mesh.node(t, tet_edges[e][0]), mesh.node(t, tet_edges[e][1]))))
        on_surface[mesh.middles[t][e]] = true;
  return on_surface;
}

void tet_shape_functions(const Eigen::Vector4d& b, bool is_quadratic, double* out) {
  for (int a = 0; a < 4; ++a) out[a] = is_quadratic ? b[a] * (2 * b[a] - 1) : b[a];
  if (!is_quadratic) return;
  for (std::size_t e = 0; e < tet_edges.size(); ++e) out[4 + e] = 4 * b[tet_edges[e][0]] * b[tet_edges[e][1]];
}

TetField::TetField(const TetMesh& mesh) : mesh_(mesh) {
  lower_ = Vec3::Constant(std::numeric_limits<double>::infinity());
  Vec3 upper = -lower_;
  for (const Vec3& p : mesh.points) {
    lower_ = lower_.cwiseMin(p);
    upper = upper.cwiseMax(p);
  }
  const Vec3 size = (upper - lower_).cwiseMax(1e-9);
  edge_ = std::cbrt(size.prod() / static_cast<double>(std::max<std::size_t>(1, mesh.size())));  // one tet a bin
  for (std::size_t d = 0; d < 3; ++d) bins_[d] = std::max(1, static_cast<std::int32_t>(std::ceil(size[d] / edge_)));
  in_.resize(count_in(bins_));
  for (std::size_t t = 0; t < mesh.size(); ++t) {
    inverse_.push_back(tet_frame(mesh, t).inverse());
    Vec3 from = Vec3::Constant(std::numeric_limits<double>::infinity()), to = -from;
    for (int a = 0; a < 4; ++a) {
      const Vec3& p = mesh.points[mesh.node(t, a)];
      from = from.cwiseMin(p);
      to = to.cwiseMax(p);
    }
    const auto first = bin_of(from), last = bin_of(to);
    for (std::int32_t k = first[2]; k <= last[2]; ++k)
      for (std::int32_t j = first[1]; j <= last[1]; ++j)
        for (std::int32_t i = first[0]; i <= last[0]; ++i)
          in_[offset_in(bins_, {i, j, k})].push_back(static_cast<std::int32_t>(t));
  }
}

Index3 TetField::bin_of(const Vec3& position) const {
  Index3 bin{};
  for (int d = 0; d < 3; ++d)
    bin[d] = static_cast<std::int32_t>(std::clamp(std::floor((position[d] - lower_[d]) / edge_), 0.0, bins_[d] - 1.0));
  return bin;
}

TetField::Place TetField::locate(const Vec3& position) const {
  const auto center = bin_of(position);
  const std::int32_t farthest = *std::max_element(bins_.begin(), bins_.end());
  Place best;
  double least_outside = std::numeric_limits<double>::infinity();
  // Rings of bins until some hold tetrahedra, and one ring more.
  for (std::int32_t ring = 0, left = farthest; ring <= farthest && left > 0; ++ring) {
    for (std::int32_t k = -ring; k <= ring; ++k)
      for (std::int32_t j = -ring; j <= ring; ++j)
        for (std::int32_t i = -ring; i <= ring; ++i) {
          if (std::max({std::abs(i), std::abs(j), std::abs(k)}) < ring) continue;
          const Index3 b = {center[0] + i, center[1] + j, center[2] + k};
          if (!is_in(bins_, b)) continue;
          for (const std::int32_t tet : in_[offset_in(bins_, b)]) {
            const Vec3 local = inverse_[tet] * (position - mesh_.points[mesh_.corners[tet][0]]);
            const Eigen::Vector4d weights(1 - local.sum(), local[0], local[1], local[2]);
            // How far outside, in mm: the heights of a tetrahedron are 1 / |row of the inverse|.
            double outside = 0;
            for (int a = 0; a < 4; ++a) {
              const Vec3 gradient = a == 0 ? Vec3(-inverse_[tet].colwise().sum()) : Vec3(inverse_[tet].row(a - 1));
              outside = std::max(outside, -weights[a] / gradient.norm());
            }
            if (outside < least_outside) {
              least_outside = outside;
              best = {as_size(tet), weights};
            }
          }
        }
    if (least_outside <= 1e-9) return best;
    if (std::isfinite(least_outside)) left = std::min(left, 2) - 1;
  }
  return best;
}

Vec3 TetField::at(const Vec3& position, const std::vector<Vec3>& displacement) const {
  const Place place = locate(position);
  std::array<double, 10> n{};
  tet_shape_functions(place.weights, mesh_.is_quadratic(), n.data());
  Vec3 u = Vec3::Zero();
  for (int a = 0; a < mesh_.nodes_each(); ++a) u += n[a] * displacement[mesh_.node(place.tet, a)];
  return u;
}

}  // namespace hexmesh
