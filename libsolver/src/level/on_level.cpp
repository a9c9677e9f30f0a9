// SPDX-License-Identifier: Apache-2.0
#include "level/on_level.h"

#include <algorithm>

#include "core/parallel.h"

namespace hexsolver {
namespace {

Index3 times(const Index3& a, const Index3& b) { return {a[0] * b[0], a[1] * b[1], a[2] * b[2]}; }

}  // namespace

OnLevel::OnLevel(const MeshCells& cells, const Mesh& mesh) : mesh_(mesh) {
  const hexmesh::Level& level = cells.lattice().level(cells.level());
  const Index3 &voxels = level.voxels_per_cell, &unit = cells.unit();
  numbering_ = hexmesh::nodes_of(level);
  cell_of_ = holders(MeshCells(cells.lattice(), cells.level()), cells);
  places_.resize(numbering_.nodes.size());
  for (std::size_t c = 0; c < cell_of_.size(); ++c) {
    const std::size_t graded = hexmesh::as_size(cell_of_[c]);
    const Index3 size = times(mesh.sizes()[mesh.size_of(graded)].size, unit), &index = mesh.cells()[graded];
    for (const std::int32_t n : numbering_.cell_nodes[c]) {
      Place& place = places_[hexmesh::as_size(n)];
      if (place.cell >= 0) continue;
      const Index3 voxel = times(numbering_.nodes[hexmesh::as_size(n)], voxels);
      place = {cell_of_[c], hexmesh::shape_functions(local_in(voxel, index, size))};
    }
  }
  on_level_.resize(mesh.num_nodes());
  for (std::size_t c = 0; c < cell_of_.size(); ++c)
    for (const std::int32_t node : mesh.cell_nodes()[hexmesh::as_size(cell_of_[c])]) {
      const std::size_t n = hexmesh::as_size(node);
      if (n >= mesh.num_nodes()) continue;
      const Index3 index = hexmesh::coarser_index(times(mesh.nodes()[n], unit), voxels);
      Vec3 local;
      for (std::size_t d = 0; d < 3; ++d) local[static_cast<Eigen::Index>(d)] = index[d] - level.cells[c][d];
      const bool is_corner = local.minCoeff() >= 0 && local.maxCoeff() <= 1;
      if (on_level_[n].cell < 0 || is_corner)
        on_level_[n] = {static_cast<std::int32_t>(c), hexmesh::shape_functions(local)};
    }
}

std::unique_ptr<const OnLevel> OnLevel::of(const MeshCells& cells, const Mesh& mesh) {
  return cells.is_graded() ? std::make_unique<const OnLevel>(cells, mesh) : nullptr;
}

std::vector<double> OnLevel::values(const std::vector<double>& of_graded) const {
  std::vector<double> out;
  for (const std::int32_t c : cell_of_) out.push_back(of_graded[hexmesh::as_size(c)]);
  return out;
}

void OnLevel::tell(const NodeVector& u, NodeVector& of_level) const {
  of_level.resize(3 * static_cast<Eigen::Index>(places_.size()));
  for_each_node(static_cast<std::ptrdiff_t>(places_.size()), [&](std::ptrdiff_t n) {
    const Place& place = places_[static_cast<std::size_t>(n)];
    of_level.segment<3>(3 * n) = mesh_.interpolate(place.cell, place.weights, u);
  });
}

template <class F>
void OnLevel::for_each_weight(std::size_t free_node, F&& f) const {
  const Place& place = on_level_[free_node];
  const CellNodes& nodes = numbering_.cell_nodes[hexmesh::as_size(place.cell)];
  for (std::size_t a = 0; a < 8; ++a) f(nodes[a], place.weights[static_cast<Eigen::Index>(a)]);
}

NodeVector OnLevel::sampled(const NodeVector& of_level) const {
  NodeVector out = NodeVector::Zero(static_cast<Eigen::Index>(mesh_.num_dofs()));
  for (std::size_t n = 0; n < on_level_.size(); ++n)
    for_each_weight(
        n, [&, u = out.segment<3>(3 * static_cast<Eigen::Index>(n))](std::int32_t node, double weight) mutable {
          u += weight * of_level.segment<3>(3 * Eigen::Index{node});
        });
  return out;
}

NodeVector OnLevel::forces(const NodeVector& of_graded) const {
  NodeVector out = NodeVector::Zero(3 * static_cast<Eigen::Index>(numbering_.nodes.size()));
  for (std::size_t n = 0; n < on_level_.size(); ++n)
    for_each_weight(n, [&](std::int32_t node, double weight) {
      out.segment<3>(3 * Eigen::Index{node}) += weight * of_graded.segment<3>(3 * static_cast<Eigen::Index>(n));
    });
  return out;
}

}  // namespace hexsolver
