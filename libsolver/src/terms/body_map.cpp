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

/// How far a place is beyond its cell, in edges; < 0 inside.
double outside_cell(const Vec3& local) { return ((local.array() - 0.5).abs() - 0.5).maxCoeff(); }

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
    taken_.insert(hexmesh::sort_key(mesh.cells()[c]));
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
  for (std::size_t d = 0; d < 3; ++d)
    beyond_most_ = std::max(beyond_most_, cells_beyond + voxels_beyond / level.voxels_per_cell[d]);
  bin_size_ = 2 * mesh.edges().colwise().norm().maxCoeff();
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
  if (miss > 1e-9 * bin_size_) return End::failed;
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

BodyMap::Place BodyMap::find(const Vec3& x, const NodeVector& u, const hexmesh::Embedding& near) const {
  if (Place found = walk(x, u, near); found.cell >= 0) return found;
  const auto bin = bins_.find(bin_of(index_of_bin(x)));
  if (bin == bins_.end()) return {};
  hexmesh::Embedding best;
  double least = beyond_most_;
  for (const std::size_t n : bin->second) {
    const std::int32_t cell = cells_[n];
    Vec3 local = Vec3::Constant(0.5);
    if (invert(x, u, cell, local) == End::failed) continue;
    const double outside = outside_cell(local);
    if (!(outside < least)) continue;
    least = std::max(outside, 0.0);
    best = {cell, local};
    if (least == 0) break;
  }
  return walk(x, u, best);
}

bool BodyMap::touch(std::int32_t one, std::int32_t other) const {
  const CellNodes &a = mesh_.cell_nodes()[hexmesh::as_size(one)], &b = mesh_.cell_nodes()[hexmesh::as_size(other)];
  return std::any_of(a.begin(), a.end(), [&](std::int32_t n) { return std::find(b.begin(), b.end(), n) != b.end(); });
}

bool BodyMap::is_elsewhere(const Place& place, const Own& own) const {
  if (place.cell < 0 || touch(place.cell, own.cell)) return false;
  Index3 at = mesh_.cells()[hexmesh::as_size(place.cell)];
  constexpr double on_face = 1e-9;
  bool is_outside = false;
  for (std::size_t d = 0; d < 3; ++d) {
    const double local = place.local[static_cast<Eigen::Index>(d)];
    if (local >= -on_face && local <= 1 + on_face) continue;
    is_outside = true;
    at[d] += static_cast<std::int32_t>(std::floor(local));
  }
  const double edge = mesh_.edges().colwise().norm().maxCoeff();
  return !is_outside || (!taken_.contains(hexmesh::sort_key(at)) && (place.rest - own.rest).norm() > edge);
}

BodyMap::Place BodyMap::find_elsewhere(const Vec3& x, const NodeVector& u, const hexmesh::Embedding& near,
                                       const Own& own) const {
  if (Place found = walk(x, u, near); is_elsewhere(found, own)) return found;
  const auto bin = bins_.find(bin_of(index_of_bin(x)));
  if (bin == bins_.end()) return {};
  Place best;
  double least = std::numeric_limits<double>::infinity();
  for (const std::size_t n : bin->second) {
    if (!boxes_[n].contains(x) || touch(cells_[n], own.cell)) continue;
    Vec3 local = Vec3::Constant(0.5);
    if (invert(x, u, cells_[n], local) == End::failed) continue;
    const double outside = outside_cell(local);
    if (!(outside < least)) continue;
    const Place found = walk(x, u, {cells_[n], local});
    if (!is_elsewhere(found, own)) continue;
    least = std::max(outside, 0.0);
    best = found;
    if (least == 0) break;
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

Index3 BodyMap::index_of_bin(const Vec3& x) const {
  Index3 out{};
  for (std::size_t d = 0; d < 3; ++d) {
    const double at = std::floor((x[static_cast<Eigen::Index>(d)] - corner_[static_cast<Eigen::Index>(d)]) / bin_size_);
    out[d] = static_cast<std::int32_t>(std::clamp(at, -500000.0, 500000.0));
  }
  return out;
}

std::uint64_t BodyMap::bin_of(const Index3& at) const {
  constexpr std::int32_t shift = 1 << 20;
  return hexmesh::sort_key({at[0] + shift, at[1] + shift, at[2] + shift});
}

void BodyMap::look_at(const NodeVector& u) {
  constexpr double part_of_cell = 0.5;  // that boxes reach beyond
  bins_.clear();
  boxes_.assign(cells_.size(), {});
  for (std::size_t n = 0; n < cells_.size(); ++n) {
    const Corners corners = corners_of(mesh_, cells_[n], u);
    if (!corners.allFinite()) continue;
    const Vec3 beyond = Vec3::Constant(part_of_cell * bin_size_ / 2);
    boxes_[n] = {corners.rowwise().minCoeff() - beyond, corners.rowwise().maxCoeff() + beyond};
    const Index3 low = index_of_bin(boxes_[n].min()), high = index_of_bin(boxes_[n].max());
    Index3 at;
    for (at[2] = low[2]; at[2] <= high[2]; ++at[2])
      for (at[1] = low[1]; at[1] <= high[1]; ++at[1])
        for (at[0] = low[0]; at[0] <= high[0]; ++at[0]) bins_[bin_of(at)].push_back(n);
  }
}

std::size_t BodyMap::bytes() const {
  std::size_t sum = hexmesh::bytes_of(cells_) + hexmesh::bytes_of(beyond_) + hexmesh::bytes_of(boxes_) +
                    taken_.size() * sizeof(std::uint64_t);
  for (const auto& [bin, cells] : bins_) sum += hexmesh::bytes_of(cells) + sizeof(bin);
  return sum;
}

}  // namespace hexsolver
