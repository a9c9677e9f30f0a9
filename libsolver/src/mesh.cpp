// SPDX-License-Identifier: Apache-2.0
#include "hexsolver/mesh.h"

#include <algorithm>

#include "hexmesh/core/bytes.h"
#include "parallel.h"

namespace hexsolver {

using hexmesh::bytes_of;

Mesh::Mesh(std::vector<Index3> cells, const Mat3& edges, const Vec3& corner)
    : Mesh(cells, hexmesh::number_nodes(cells), edges, corner) {}

Mesh::Mesh(std::vector<Index3> cells, hexmesh::NodeNumbering numbering, const Mat3& edges, const Vec3& corner)
    : cells_(std::move(cells)), numbering_(std::move(numbering)), edges_(edges), corner_(corner) {
  slabs_.assign(static_cast<std::size_t>(hexmesh::extent_of(cells_)[2]), {0, 0});
  for (std::size_t c = 0; c < cells_.size(); ++c) {
    auto& slab = slabs_[static_cast<std::size_t>(cells_[c][2])];
    if (slab.second == 0) slab.first = c;
    slab.second = c + 1;
  }
  batch_of_.resize(cells_.size());
  for (const auto& [begin, end] : slabs_)
    for (std::size_t first = begin; first < end; first += batch_size) {
      batches_.push_back(make_batch(first, std::min(batch_size, end - first)));
      for (std::size_t c = first; c < first + batches_.back().count; ++c)
        batch_of_[c] = static_cast<std::int32_t>(batches_.size() - 1);
    }
}

Mesh::Batch Mesh::make_batch(std::size_t first, std::size_t count) const {
  Batch batch{first, count, count == batch_size};
  for (std::size_t r = 0; r < 4; ++r) batch.rows[r] = cell_nodes()[first][2 * r];
  for (std::size_t lane = 0; lane < count; ++lane)
    for (std::size_t a = 0; a < 8; ++a)
      batch.is_row =
          batch.is_row && cell_nodes()[first + lane][a] == batch.rows[a / 2] + static_cast<std::int32_t>(lane + a % 2);
  return batch;
}

std::size_t Mesh::bytes() const {
  return bytes_of(cells_) + bytes_of(numbering_.cell_nodes) + bytes_of(numbering_.nodes) + bytes_of(batches_) +
         bytes_of(batch_of_);
}

Prolongation::Prolongation(const Mesh& fine, const Mesh& coarse, const hexmesh::Merge& merge) {
  std::vector<std::int32_t> parent_of(fine.num_nodes(), -1);  // one of those that have the node
  for (std::size_t parent = 0; parent < merge.children.size(); ++parent)
    for (const std::int32_t child : merge.children[parent])
      if (child >= 0)
        for (const std::int32_t node : fine.cell_nodes()[static_cast<std::size_t>(child)])
          parent_of[static_cast<std::size_t>(node)] = static_cast<std::int32_t>(parent);

  forward_.begin.push_back(0);
  for (std::size_t n = 0; n < fine.num_nodes(); ++n) {
    const auto parent = static_cast<std::size_t>(parent_of[n]);
    Vec3 place;
    for (std::size_t d = 0; d < 3; ++d)
      place[static_cast<Eigen::Index>(d)] =
          static_cast<double>(fine.nodes()[n][d]) / merge.factor[d] - coarse.cells()[parent][d];
    const NodeWeights weights = hexmesh::shape_functions(place);
    for (int a = 0; a < 8; ++a) {
      if (weights[a] == 0) continue;
      forward_.columns.push_back(coarse.cell_nodes()[parent][static_cast<std::size_t>(a)]);
      forward_.weights.push_back(static_cast<float>(weights[a]));
    }
    forward_.begin.push_back(static_cast<std::int32_t>(forward_.columns.size()));
  }

  transposed_.begin.assign(coarse.num_nodes() + 1, 0);
  for (const std::int32_t column : forward_.columns) ++transposed_.begin[static_cast<std::size_t>(column) + 1];
  for (std::size_t n = 0; n < coarse.num_nodes(); ++n) transposed_.begin[n + 1] += transposed_.begin[n];
  transposed_.columns.resize(forward_.columns.size());
  transposed_.weights.resize(forward_.columns.size());
  std::vector<std::int32_t> next = transposed_.begin;
  for (std::size_t row = 0; row < fine.num_nodes(); ++row)
    for (std::int32_t e = forward_.begin[row]; e < forward_.begin[row + 1]; ++e) {
      const auto entry = static_cast<std::size_t>(e);
      const auto to = static_cast<std::size_t>(next[static_cast<std::size_t>(forward_.columns[entry])]++);
      transposed_.columns[to] = static_cast<std::int32_t>(row);
      transposed_.weights[to] = forward_.weights[entry];
    }
}

template <class Scalar>
void Prolongation::Rows::multiply(const Eigen::Matrix<Scalar, Eigen::Dynamic, 1>& x,
                                  Eigen::Matrix<Scalar, Eigen::Dynamic, 1>& y) const {
  const auto num_rows = static_cast<std::ptrdiff_t>(begin.size()) - 1;
  y.resize(3 * num_rows);
  for_each_node(num_rows, [&](std::ptrdiff_t row) {
    Eigen::Matrix<Scalar, 3, 1> sum = Eigen::Matrix<Scalar, 3, 1>::Zero();
    for (std::int32_t e = begin[static_cast<std::size_t>(row)]; e < begin[static_cast<std::size_t>(row) + 1]; ++e)
      sum += static_cast<Scalar>(weights[static_cast<std::size_t>(e)]) *
             x.template segment<3>(3 * static_cast<Eigen::Index>(columns[static_cast<std::size_t>(e)]));
    y.template segment<3>(3 * row) = sum;
  });
}

std::size_t Prolongation::Rows::bytes() const { return bytes_of(begin) + bytes_of(columns) + bytes_of(weights); }

void Prolongation::prolongate(const NodeVector& coarse, NodeVector& fine) const { forward_.multiply(coarse, fine); }
void Prolongation::prolongate(const FloatNodeVector& coarse, FloatNodeVector& fine) const {
  forward_.multiply(coarse, fine);
}
void Prolongation::restrict_to(const NodeVector& fine, NodeVector& coarse) const { transposed_.multiply(fine, coarse); }
void Prolongation::restrict_to(const FloatNodeVector& fine, FloatNodeVector& coarse) const {
  transposed_.multiply(fine, coarse);
}

}  // namespace hexsolver
