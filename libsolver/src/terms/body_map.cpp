// SPDX-License-Identifier: Apache-2.0
#include "terms/body_map.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "hexmesh/core/bytes.h"
#include "mesh/face_neighbours.h"

namespace hexsolver {
namespace {

using hexmesh::Lattice;

using Corners = Eigen::Matrix<double, 3, 8>;

Corners corners_of(const Mesh& mesh, std::int32_t cell, const NodeVector& u) {
  const CellVector v = mesh.gather(static_cast<std::size_t>(cell), u);
  Corners out = Eigen::Map<const Corners>(v.data());
  for (int a = 0; a < 8; ++a)
    out.col(a) += mesh.position(mesh.node(static_cast<std::size_t>(cell), static_cast<std::size_t>(a)));
  return out;
}

/// How far a place is beyond its cell along each axis, in edges; < 0 inside.
Eigen::Array3d beyond_cell(const Vec3& local) { return (local.array() - 0.5).abs() - 0.5; }

double outside_cell(const Vec3& local) { return beyond_cell(local).maxCoeff(); }

constexpr double on_face = 1e-9;  // so far outside a place still is in its cell

}  // namespace

BodyMap::BodyMap(const MeshCells& cells, const Mesh& mesh, const std::vector<bool>& of)
    : cells_of_(cells), mesh_(mesh), of_(of), corner_(cells.lattice().corner()), holds_(mesh.num_cells()) {
  const Lattice& lattice = cells.lattice();
  const hexmesh::Level& finest = lattice.level(cells.level());
  const hexmesh::CellLocator locator(lattice.voxels, finest.voxels_per_cell, finest.cells, finest.split.owners);
  std::vector<bool> holds(finest.cells.size());
  for (std::size_t n = 0; n < lattice.labels.size(); ++n)
    if (of[lattice.labels[n]])
      if (const std::int32_t cell = locator.cell_of_voxel(lattice.voxels.index(n)); cell >= 0)
        holds[hexmesh::as_size(cell)] = true;
  for (std::size_t c = 0; c < holds.size(); ++c)
    if (holds[c]) holds_[hexmesh::as_size(cells.holder(cells.level(), static_cast<std::int32_t>(c)))] = true;
  for (std::size_t c = 0; c < holds_.size(); ++c)
    if (holds_[c]) cells_.push_back(static_cast<std::int32_t>(c));
  shares_index_.resize(holds_.size());
  for (std::size_t n = 1; n < cells_.size(); ++n) {
    const auto one = hexmesh::as_size(cells_[n - 1]), other = hexmesh::as_size(cells_[n]);
    if (mesh.cells()[one] == mesh.cells()[other] && mesh.size_of(one) == mesh.size_of(other))
      shares_index_[one] = shares_index_[other] = true;
  }

  std::vector<std::pair<std::int32_t, std::int32_t>> beyond;  // 6 cell + side, other
  for_each_shared_face(mesh, [&](const SharedFace& face) {
    const bool are_of_segment = holds_[hexmesh::as_size(face.cell)] && holds_[hexmesh::as_size(face.other)];
    if (!are_of_segment || face.its_side != (face.side ^ 1)) return;
    beyond.emplace_back(6 * face.cell + face.side, face.other);
    beyond.emplace_back(6 * face.other + face.its_side, face.cell);
  });
  std::sort(beyond.begin(), beyond.end());
  for (const auto& [at, other] : beyond) {
    beyond_begin_.resize(hexmesh::as_size(at) + 1, static_cast<std::int32_t>(beyond_.size()));
    beyond_.push_back(other);
  }
  beyond_begin_.resize(6 * mesh.num_cells() + 1, static_cast<std::int32_t>(beyond_.size()));

  constexpr double cells_beyond = 0.75, voxels_beyond = 3;
  for (const CellsOfSize& size : mesh.sizes()) {
    OfSize& added = sizes_.emplace_back();
    added.edge = size.edges.colwise().norm().maxCoeff();
    for (std::size_t d = 0; d < 3; ++d) {
      const double voxels = size.size[d] * cells.unit()[d];
      added.voxel[static_cast<Eigen::Index>(d)] = 1 / voxels;
      added.beyond_most = std::max(added.beyond_most, cells_beyond + voxels_beyond / voxels);
    }
  }
}

std::span<const std::int32_t> BodyMap::beyond(std::int32_t cell, int side) const {
  const auto row = hexmesh::as_size(6 * cell + side);
  return std::span(beyond_).subspan(hexmesh::as_size(beyond_begin_[row]),
                                    hexmesh::as_size(beyond_begin_[row + 1] - beyond_begin_[row]));
}

Vec3 BodyMap::local_in(std::int32_t other, std::int32_t cell, const Vec3& local) const {
  const auto c = hexmesh::as_size(cell), o = hexmesh::as_size(other);
  const Index3 &size = mesh_.sizes()[mesh_.size_of(c)].size, &other_size = mesh_.sizes()[mesh_.size_of(o)].size;
  Vec3 out;
  for (std::size_t d = 0; d < 3; ++d) {
    const std::int32_t from = mesh_.cells()[c][d] * size[d] - mesh_.cells()[o][d] * other_size[d];
    out[static_cast<Eigen::Index>(d)] = (local[static_cast<Eigen::Index>(d)] * size[d] + from) / other_size[d];
  }
  return out;
}

/// Newton's method for x(local) = x from `local`, which it moves.
BodyMap::End BodyMap::invert(const Vec3& x, const NodeVector& u, std::int32_t cell, Vec3& local) const {
  constexpr int most_steps = 20;
  constexpr double exact = 1e-12;
  const double far = size_of(cell).beyond_most + 0.5;
  const Corners corners = corners_of(mesh_, cell, u);
  for (int step = 0; step < most_steps; ++step) {
    const Mat3 jacobian = corners * hexmesh::shape_gradients(local);
    const Vec3 by = jacobian.inverse() * (x - corners * hexmesh::shape_functions(local));
    if (!by.allFinite()) return End::failed;
    local += by;
    const double outside = outside_cell(local);
    if (outside > far) {  // on the way to another cell: the map means little so far out
      local = local.cwiseMax(-far).cwiseMin(1 + far);
      return End::far;
    }
    if (by.lpNorm<Eigen::Infinity>() < exact) return outside > 0 ? End::left : End::found;
  }
  const double miss = (x - corners * hexmesh::shape_functions(local)).norm();
  if (miss > 2e-9 * size_of(cell).edge) return End::failed;
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
    for (const auto& [by, side] : sides) {
      if (by <= 0 || next >= 0) break;
      double nearest = std::numeric_limits<double>::infinity();  // of several smaller ones
      for (const std::int32_t other : beyond(cell, side)) {
        const double away = other == before ? nearest : outside_cell(local_in(other, cell, local));
        if (away < nearest) next = other;
        nearest = std::min(nearest, away);
      }
    }
    if (next < 0) return sides[0].first > size_of(cell).beyond_most ? Place{} : place(u, cell, local);
    local = local_in(next, cell, local);
    before = cell;
    cell = next;
  }
  return {};
}

BodyMap::Place BodyMap::place_in(const Vec3& x, const NodeVector& u, const hexmesh::Embedding& near) const {
  Vec3 local = near.local;
  const End end = invert(x, u, near.cell, local);
  return end == End::found || end == End::left ? place(u, near.cell, local) : Place{};
}

bool BodyMap::touch(std::int32_t one, std::int32_t other) const {
  const CellNodes &a = mesh_.cell_nodes()[hexmesh::as_size(one)], &b = mesh_.cell_nodes()[hexmesh::as_size(other)];
  return std::any_of(a.begin(), a.end(), [&](std::int32_t n) { return std::find(b.begin(), b.end(), n) != b.end(); });
}

/// Cells that hold voxels of the segment around a place at rest. f returns whether to go on. @returns whether it did
template <class F>
bool BodyMap::for_holders_near(const Vec3& rest, const F& f) const {
  const Lattice& lattice = cells_of_.lattice();
  const Vec3 at = lattice.voxels.continuous_index(rest);
  for (int corner = 0; corner < 8; ++corner) {
    Index3 voxel;
    for (int d = 0; d < 3; ++d)
      voxel[hexmesh::as_size(d)] = static_cast<std::int32_t>(std::floor(at[d])) + hexmesh::corner_bit(corner, d);
    if (!lattice.voxels.contains(voxel) || !of_[lattice.labels[lattice.voxels.offset(voxel)]]) continue;
    if (const std::int32_t holder = cells_of_.cell_of_voxel(voxel); holder >= 0 && !f(holder)) return false;
  }
  return true;
}

bool BodyMap::is_of_segment(const Place& place) const {
  if (place.cell < 0) return false;
  const bool is_inside = outside_cell(place.local) <= 0;
  if (is_inside && !shares_index_[hexmesh::as_size(place.cell)]) return true;
  // Within a voxel: else a force ends where it still presses.
  if (!is_inside && (beyond_cell(place.local) <= size_of(place.cell).voxel.array()).all()) return true;
  bool is_any_there = false;
  return !for_holders_near(place.rest, [&](std::int32_t holder) {
    is_any_there = true;
    return holder != place.cell && !(is_inside && touch(place.cell, holder));
  }) || !is_any_there;
}

bool BodyMap::is_elsewhere(const Place& place, const Own& own) const {
  if (touch(place.cell, own.cell)) return false;
  if (!own.is_of_segment) return true;
  if (outside_cell(place.local) <= on_face && !shares_index_[hexmesh::as_size(place.cell)]) return true;
  return (place.rest - own.rest).norm() > size_of(place.cell).edge &&
         for_holders_near(place.rest, [&](std::int32_t holder) { return !touch(holder, own.cell); });
}

/// Cells that touch lead to the same place, whichever of them a walk begins in: one of them is tried, the nearest.
BodyMap::Place BodyMap::find(const Vec3& x, const NodeVector& u, const hexmesh::Embedding& near, const Own* own,
                             const Depth& depth) const {
  Place best;
  double deepest = std::numeric_limits<double>::infinity();
  const auto try_from = [&](const hexmesh::Embedding& from) {
    const Place found = walk(x, u, from);
    if (!is_of_segment(found)) return -1;
    if (own && !is_elsewhere(found, *own)) return found.cell;
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
    for (const std::int32_t other : beyond(cell, side))
      if (const Vec3 there = local_in(other, cell, local); outside_cell(there) <= outside_cell(local) + on_border)
        out.push_back(place(u, other, there).to_rest);
  }
  return out;
}

void BodyMap::look_at(const NodeVector& u) {
  constexpr double part_of_cell = 0.5;  // that boxes reach beyond
  boxes_.assign(cells_.size(), {});
  for (std::size_t n = 0; n < cells_.size(); ++n) {
    const Corners corners = corners_of(mesh_, cells_[n], u);
    if (!corners.allFinite()) continue;
    const Vec3 beyond = Vec3::Constant(part_of_cell * size_of(cells_[n]).edge);
    boxes_[n] = {corners.rowwise().minCoeff() - beyond, corners.rowwise().maxCoeff() + beyond};
  }
  bins_.fill(boxes_, 2 * sizes_.front().edge);
}

std::size_t BodyMap::bytes() const {
  return holds_.size() / 8 + hexmesh::bytes_of(cells_) + hexmesh::bytes_of(beyond_begin_) + hexmesh::bytes_of(beyond_) +
         hexmesh::bytes_of(boxes_) + bins_.bytes();
}

}  // namespace hexsolver
