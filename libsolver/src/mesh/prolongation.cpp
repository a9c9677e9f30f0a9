// SPDX-License-Identifier: Apache-2.0
#include "mesh/prolongation.h"

#include <algorithm>
#include <stdexcept>

#include "core/parallel.h"
#include "hexmesh/core/bytes.h"

namespace hexsolver {

using hexmesh::bytes_of;

Prolongation::Prolongation(const Mesh& fine, const Mesh& coarse, const hexmesh::Merge& merge) {
  std::vector<std::int32_t> parent_of(fine.num_all_nodes(), -1);  // one of those that have the node
  for (std::size_t parent = 0; parent < merge.children.size(); ++parent)
    for (const std::int32_t child : merge.children[parent])
      if (child >= 0)
        for (const std::int32_t node : fine.cell_nodes()[child]) parent_of[node] = static_cast<std::int32_t>(parent);
  fill(fine, coarse, parent_of, merge.factor, merge.parents);
}

Prolongation::Prolongation(const Mesh& fine, const Mesh& coarse, const std::vector<std::int32_t>& parents,
                           const Index3& ratio) {
  std::vector<std::int32_t> parent_of(fine.num_all_nodes(), -1);
  for (std::size_t c = 0; c < fine.num_cells(); ++c) {
    if (parents[c] < 0) throw std::logic_error("a cell that no coarser one holds");
    for (const std::int32_t node : fine.cell_nodes()[c]) parent_of[node] = parents[c];
  }
  fill(fine, coarse, parent_of, ratio, coarse.cells());
}

void Prolongation::fill(const Mesh& fine, const Mesh& coarse, const std::vector<std::int32_t>& parent_of_node,
                        const Index3& ratio, const std::vector<Index3>& indices) {
  forward_.begin.push_back(0);
  for (std::size_t n = 0; n < fine.num_nodes(); ++n) {
    const auto parent = static_cast<std::size_t>(parent_of_node[n]);
    const Index3 &size = coarse.sizes()[coarse.size_of(parent)].size, &cell = indices[parent];
    const NodeWeights weights =
        hexmesh::shape_functions(local_in(fine.nodes()[n], cell, hexmesh::first_in(size, ratio)));
    const auto row = static_cast<std::ptrdiff_t>(forward_.columns.size());
    for (int a = 0; a < 8; ++a) {
      if (weights[a] == 0) continue;
      coarse.for_each_free(parent, static_cast<std::size_t>(a), [&](std::int32_t node, double weight) {
        const auto known = std::find(forward_.columns.begin() + row, forward_.columns.end(), node);
        const auto value = static_cast<float>(weight * weights[a]);
        if (known != forward_.columns.end()) {
          forward_.weights[static_cast<std::size_t>(known - forward_.columns.begin())] += value;
          return;
        }
        forward_.columns.push_back(node);
        forward_.weights.push_back(value);
      });
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
      const auto to = static_cast<std::size_t>(next[forward_.columns[entry]]++);
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
    for (std::int32_t e = begin[row]; e < begin[static_cast<std::size_t>(row) + 1]; ++e)
      sum += static_cast<Scalar>(weights[e]) * x.template segment<3>(3 * columns[e]);
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
