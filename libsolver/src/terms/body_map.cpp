// SPDX-License-Identifier: Apache-2.0
#include "terms/body_map.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "hexmesh/core/bytes.h"

namespace hexsolver {
namespace {

using Corners = Eigen::Matrix<double, 3, 8>;

Corners corners_of(const Mesh& mesh, std::int32_t cell, const NodeVector& u) {
  const CellVector v = mesh.gather(static_cast<std::size_t>(cell), u);
  Corners out = Eigen::Map<const Corners>(v.data());
  for (int a = 0; a < 8; ++a)
    out.col(a) += mesh.position(mesh.node(static_cast<std::size_t>(cell), static_cast<std::size_t>(a)));
  return out;
}

/// The nodes of a face, by side (see hexmesh::ExposedFace), sorted.
std::array<std::int32_t, 4> face_of(const CellNodes& nodes, int side) {
  std::array<std::int32_t, 4> out{};
  std::size_t n = 0;
  for (int a = 0; a < 8; ++a)
    if (hexmesh::corner_bit(a, side / 2) == side % 2) out[n++] = nodes[static_cast<std::size_t>(a)];
  std::sort(out.begin(), out.end());
  return out;
}

/// How far a place is beyond its cell along each axis, in edges; < 0 inside.
Eigen::Array3d beyond_cell(const Vec3& local) { return (local.array() - 0.5).abs() - 0.5; }

double outside_cell(const Vec3& local) { return beyond_cell(local).maxCoeff(); }

constexpr double on_face = 1e-9;  // so far outside a place still is in its cell

}  // namespace

BodyMap::BodyMap(const MeshCells& cells, const Mesh& mesh, const std::vector<bool>& of)
    : mesh_(mesh), corner_(cells.lattice().corner()), beyond_(mesh.num_cells(), {-1, -1, -1, -1, -1, -1}) {
  const hexmesh::Lattice& lattice = cells.lattice();
  const hexmesh::Level& level = lattice.level(cells.level());
  const hexmesh::CellLocator locator(lattice.voxels, level.voxels_per_cell, level.cells, level.split.owners);
  std::vector<bool> holds(mesh.num_cells());
  for (std::size_t n = 0; n < lattice.labels.size(); ++n)
    if (of[lattice.labels[n]])
      if (const std::int32_t cell = locator.cell_of_voxel(lattice.voxels.index(n)); cell >= 0)
        holds[static_cast<std::size_t>(cell)] = true;
  std::map<std::array<std::int32_t, 4>, std::pair<std::int32_t, int>> open;  // faces that one cell has so far
  for (std::size_t c = 0; c < holds.size(); ++c) {
    if (!holds[c]) continue;
    cells_.push_back(static_cast<std::int32_t>(c));
    at_.emplace(hexmesh::sort_key(mesh.cells()[c]), static_cast<std::int32_t>(c));
    for (int side = 0; side < 6; ++side) {
      const auto [face, is_new] =
          open.try_emplace(face_of(mesh.cell_nodes()[c], side), static_cast<std::int32_t>(c), side);
      if (is_new) continue;
      const auto [other, its_side] = face->second;
      if (its_side == (side ^ 1) && beyond_[static_cast<std::size_t>(other)][static_cast<std::size_t>(its_side)] < 0) {
        beyond_[c][static_cast<std::size_t>(side)] = other;
        beyond_[static_cast<std::size_t>(other)][static_cast<std::size_t>(its_side)] = static_cast<std::int32_t>(c);
      }
    }
  }
  constexpr double cells_beyond = 0.75, voxels_beyond = 3;
  for (std::size_t d = 0; d < 3; ++d) {
    voxel_[static_cast<Eigen::Index>(d)] = 1.0 / level.voxels_per_cell[d];
    beyond_most_ = std::max(beyond_most_, cells_beyond + voxels_beyond / level.voxels_per_cell[d]);
  }
  edge_ = mesh.edges().colwise().norm().maxCoeff();
}

/// Newton's method for x(local) = x from `local`, which it moves.
BodyMap::End BodyMap::invert(const Vec3& x, const NodeVector& u, std::int32_t cell, Vec3& local) const {
  constexpr int most_steps = 20;
  constexpr double exact = 1e-12;
  const double far = beyond_most_ + 0.5;
  const Corners corners = corners_of(mesh_, cell, u);
  for (int step = 0; step < most_steps; ++step) {
    const Mat3 jacobian = corners * hexmesh::shape_gradients(local);
    const Vec3 by = jacobian.inverse() * (x - corners * hexmesh::shape_functions(local));
    if (!by.allFinite()) return End::failed;
    local += by;
    const double outside = outside_cell(local);
    if (outside > far) {  // on the way to another cell: the map means little so far out
      local = local.cwiseMax(-far).cwiseMin(1 + far);
      return End::left;
    }
    if (by.lpNorm<Eigen::Infinity>() < exact) return outside > 0 ? End::left : End::found;
  }
  const double miss = (x - corners * hexmesh::shape_functions(local)).norm();
  if (miss > 2e-9 * edge_) return End::failed;
  return outside_cell(local) > 0 ? End::left : End::found;
}

BodyMap::Place BodyMap::place(const NodeVector& u, std::int32_t cell, const Vec3& local) const {
  const auto c = static_cast<std::size_t>(cell);
  Place out{cell, local};
  const Index3& index = mesh_.cells()[c];
  const Mat3& edges = mesh_.edges(c);
  out.rest = corner_ + edges * (Vec3(index[0], index[1], index[2]) + local);
  out.to_rest = edges * (corners_of(mesh_, cell, u) * hexmesh::shape_gradients(local)).inverse();
  out.weights = hexmesh::shape_functions(local);
  return out;
}

/// From cell to cell, beyond the face that is farthest behind.
BodyMap::Place BodyMap::walk(const Vec3& x, const NodeVector& u, const hexmesh::Embedding& from) const {
  constexpr int most_cells = 64;
  std::int32_t cell = from.cell, before = -1;
  Vec3 local = from.local;
  for (int step = 0; cell >= 0 && step < most_cells; ++step) {
    const End end = invert(x, u, cell, local);
    if (end == End::failed) return {};
    if (end == End::found) return place(u, cell, local);
    std::array<std::pair<double, int>, 3> sides;
    for (int d = 0; d < 3; ++d)
      sides[static_cast<std::size_t>(d)] = {std::max(-local[d], local[d] - 1), 2 * d + (local[d] > 0.5)};
    std::sort(sides.begin(), sides.end(), std::greater<>());
    std::int32_t next = -1;
    int crossed = 0;
    for (const auto& [by, side] : sides) {
      if (by <= 0) break;
      const std::int32_t beyond = beyond_[static_cast<std::size_t>(cell)][static_cast<std::size_t>(side)];
      if (beyond < 0 || beyond == before) continue;
      next = beyond;
      crossed = side;
      break;
    }
    if (next < 0) return sides[0].first > beyond_most_ ? Place{} : place(u, cell, local);
    local[crossed / 2] += crossed % 2 == 1 ? -1 : 1;
    before = cell;
    cell = next;
  }
  return {};
}

bool BodyMap::touch(std::int32_t one, std::int32_t other) const {
  const CellNodes &a = mesh_.cell_nodes()[hexmesh::as_size(one)], &b = mesh_.cell_nodes()[hexmesh::as_size(other)];
  return std::any_of(a.begin(), a.end(), [&](std::int32_t n) { return std::find(b.begin(), b.end(), n) != b.end(); });
}

bool BodyMap::is_of_segment(const Place& place) const {
  if (place.cell < 0) return false;
  Index3 at = mesh_.cells()[hexmesh::as_size(place.cell)];
  if ((beyond_cell(place.local) <= voxel_.array()).all()) return true;  // else a force ends where it still presses
  for (std::size_t d = 0; d < 3; ++d) at[d] += static_cast<std::int32_t>(std::floor(place.local[Eigen::Index(d)]));
  const auto [begin, end] = at_.equal_range(hexmesh::sort_key(at));
  return begin == end || std::any_of(begin, end, [&](const auto& other) { return touch(place.cell, other.second); });
}

bool BodyMap::is_elsewhere(const Place& place, const Own& own) const {
  if (touch(place.cell, own.cell)) return false;
  return outside_cell(place.local) <= on_face || (place.rest - own.rest).norm() > edge_;
}

/// Cells that touch lead to the same place, whichever of them a walk begins in: one of them is tried, the nearest.
BodyMap::Place BodyMap::find(const Vec3& x, const NodeVector& u, const hexmesh::Embedding& near, const Own* own,
                             const Depth& depth) const {
  Place best;
  double deepest = std::numeric_limits<double>::infinity();
  const auto try_from = [&](const hexmesh::Embedding& from) {
    const Place found = walk(x, u, from);
    if (!is_of_segment(found) || (own && !is_elsewhere(found, *own))) return found.cell;
    const double d = depth(found);
    if (best.cell < 0 || (d < std::min(deepest, 0.0) && outside_cell(found.local) <= on_face)) {
      best = found;
      deepest = d;
    }
    return found.cell;
  };
  std::vector<std::int32_t> tried = {try_from(near)};
  if (deepest <= 0) return best;
  std::vector<std::pair<double, std::size_t>> others;
  for (const std::size_t n : bins_.at(x))
    if (boxes_[n].contains(x)) others.emplace_back((x - boxes_[n].center()).squaredNorm(), n);
  std::sort(others.begin(), others.end());
  for (const auto& [away, n] : others) {
    const std::int32_t cell = cells_[n];
    const auto leads_there = [&](std::int32_t other) { return other >= 0 && touch(cell, other); };
    if (std::any_of(tried.begin(), tried.end(), leads_there) || (own && touch(cell, own->cell))) continue;
    Vec3 local = Vec3::Constant(0.5);
    if (invert(x, u, cell, local) == End::failed) continue;
    tried.push_back(cell);
    tried.push_back(try_from({cell, local}));
  }
  return best;
}

BodyMap::Bending BodyMap::bending(std::int32_t cell, const Vec3& local, const NodeVector& u, const Vec3& m) const {
  const Corners corners = corners_of(mesh_, cell, u);
  Bending out;
  out.gradients = hexmesh::shape_gradients(local) * (corners * hexmesh::shape_gradients(local)).inverse();
  Mat3 second = Mat3::Zero();  // by local coordinates: a product of three, each of one of them
  for (int a = 0; a < 8; ++a) {
    Vec3 factor, sign;
    for (int d = 0; d < 3; ++d) {
      const bool is_upper = hexmesh::corner_bit(a, d) == 1;
      factor[d] = is_upper ? local[d] : 1 - local[d];
      sign[d] = is_upper ? 1 : -1;
    }
    for (int d = 0; d < 3; ++d) {
      const int i = (d + 1) % 3, j = (d + 2) % 3;
      second(i, j) += m.dot(corners.col(a)) * sign[i] * sign[j] * factor[d];
    }
  }
  for (int d = 0; d < 3; ++d) second((d + 2) % 3, (d + 1) % 3) = second((d + 1) % 3, (d + 2) % 3);
  const Mat3 to_local = mesh_.edges(static_cast<std::size_t>(cell)).inverse();
  out.second = to_local.transpose() * second * to_local;
  return out;
}

std::vector<Mat3> BodyMap::to_rest_beside(std::int32_t cell, const Vec3& local, const NodeVector& u) const {
  constexpr double on_border = 1e-4;
  std::vector<Mat3> out;
  for (int side = 0; cell >= 0 && side < 6; ++side) {
    const bool is_upper = side % 2 == 1;
    if (std::abs(local[side / 2] - (is_upper ? 1 : 0)) > on_border) continue;
    const std::int32_t beyond = beyond_[static_cast<std::size_t>(cell)][static_cast<std::size_t>(side)];
    if (beyond < 0) continue;
    Vec3 there = local;
    there[side / 2] += is_upper ? -1 : 1;
    out.push_back(place(u, beyond, there).to_rest);
  }
  return out;
}

void BodyMap::look_at(const NodeVector& u) {
  constexpr double part_of_cell = 0.5;  // that boxes reach beyond
  boxes_.assign(cells_.size(), {});
  for (std::size_t n = 0; n < cells_.size(); ++n) {
    const Corners corners = corners_of(mesh_, cells_[n], u);
    if (!corners.allFinite()) continue;
    const Vec3 beyond = Vec3::Constant(part_of_cell * edge_);
    boxes_[n] = {corners.rowwise().minCoeff() - beyond, corners.rowwise().maxCoeff() + beyond};
  }
  bins_.fill(boxes_, 2 * edge_);
}

std::size_t BodyMap::bytes() const {
  return hexmesh::bytes_of(cells_) + hexmesh::bytes_of(beyond_) + hexmesh::bytes_of(boxes_) + bins_.bytes() +
         at_.size() * sizeof(std::pair<std::uint64_t, std::int32_t>);
}

}  // namespace hexsolver
