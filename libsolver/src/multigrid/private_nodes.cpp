// SPDX-License-Identifier: Apache-2.0
#include "multigrid/private_nodes.h"

#include <Eigen/Cholesky>
#include <algorithm>

#include "hexmesh/core/bytes.h"

namespace hexsolver {

using Eigen::Index;

PrivateNodes::PrivateNodes(const Mesh& mesh, const std::function<bool(std::size_t)>& is_left_out) : mesh_(mesh) {
  std::vector<std::int32_t> num_cells(mesh.num_nodes());
  for (std::size_t c = 0; c < mesh.num_cells(); ++c)
    for (std::size_t a = 0; a < 8; ++a)
      mesh.for_each_free(c, a, [&](std::int32_t n, double) { num_cells[hexmesh::as_size(n)] += 1; });
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
    Cell of{c, {}, CellMatrix::Zero(), {}};
    for (std::size_t a = 0; a < 8; ++a)
      if (const std::size_t n = mesh.node(c, a); n < mesh.num_nodes() && num_cells[n] == 1) of.corners.push_back(a);
    if (of.corners.size() > 1 && !is_left_out(c)) cells_.push_back(std::move(of));
  }
}

/// @returns whether its nodes are soft together
bool PrivateNodes::invert(Cell& of) {
  constexpr double soft = 0.1;  // least pivot of D^-1/2 K D^-1/2, D the diagonal
  const auto count = static_cast<Index>(of.corners.size());
  Eigen::MatrixXd block(3 * count, 3 * count);
  for (Index a = 0; a < count; ++a)
    for (Index b = 0; b < count; ++b)
      block.block<3, 3>(3 * a, 3 * b) = of.k.block<3, 3>(3 * static_cast<Index>(of.corners[hexmesh::as_size(a)]),
                                                         3 * static_cast<Index>(of.corners[hexmesh::as_size(b)]));
  const Eigen::LLT<Eigen::MatrixXd> factor(block);
  if (factor.info() != Eigen::Success) return false;
  const Eigen::MatrixXd& l = factor.matrixLLT();
  double least = 1;
  for (Index n = 0; n < block.rows(); ++n) least = std::min(least, l(n, n) * l(n, n) / block(n, n));
  if (least > soft) return false;
  of.inverse = factor.solve(Eigen::MatrixXd::Identity(block.rows(), block.cols()));
  return true;
}

void PrivateNodes::update(const std::function<CellMatrix(std::size_t)>& hessian_of) {
  num_soft_ = 0;
  if (!hessian_of) return;
  for (Cell& of : cells_) of.k = hessian_of(of.cell);
  const auto end = std::partition(cells_.begin(), cells_.end(), [](Cell& of) { return invert(of); });
  num_soft_ = static_cast<std::size_t>(end - cells_.begin());
}

PrivateNodes::Vector PrivateNodes::at_corners(const Cell& of, const NodeVector& v) const {
  Vector out(3 * static_cast<Index>(of.corners.size()));
  for (std::size_t a = 0; a < of.corners.size(); ++a)
    out.segment<3>(3 * static_cast<Index>(a)) =
        v.segment<3>(3 * static_cast<Index>(mesh_.node(of.cell, of.corners[a])));
  return out;
}

void PrivateNodes::solve_first(NodeVector& r) const {
  for (std::size_t n = 0; n < num_soft_; ++n) {
    const Cell& of = cells_[n];
    const Vector found = of.inverse * at_corners(of, r);
    CellVector moved = CellVector::Zero();
    for (std::size_t a = 0; a < of.corners.size(); ++a)
      moved.segment<3>(3 * static_cast<Index>(of.corners[a])) = found.segment<3>(3 * static_cast<Index>(a));
    const CellVector forces = of.k * moved;
    for (std::size_t a = 0; a < 8; ++a)
      mesh_.for_each_free(of.cell, a, [&](std::int32_t node, double weight) {
        r.segment<3>(3 * Index{node}) -= weight * forces.segment<3>(3 * static_cast<Index>(a));
      });
  }
}

void PrivateNodes::solve_last(const NodeVector& r, NodeVector& z) const {
  for (std::size_t n = 0; n < num_soft_; ++n) {
    const Cell& of = cells_[n];
    CellVector others = mesh_.gather(of.cell, z);
    for (const std::size_t a : of.corners) others.segment<3>(3 * static_cast<Index>(a)).setZero();
    const CellVector forces = of.k * others;
    Vector left = at_corners(of, r);
    for (std::size_t a = 0; a < of.corners.size(); ++a)
      left.segment<3>(3 * static_cast<Index>(a)) -= forces.segment<3>(3 * static_cast<Index>(of.corners[a]));
    const Vector found = of.inverse * left;
    for (std::size_t a = 0; a < of.corners.size(); ++a)
      z.segment<3>(3 * static_cast<Index>(mesh_.node(of.cell, of.corners[a]))) =
          found.segment<3>(3 * static_cast<Index>(a));
  }
}

std::size_t PrivateNodes::bytes() const {
  std::size_t sum = hexmesh::bytes_of(cells_);
  for (const Cell& of : cells_) sum += sizeof(double) * static_cast<std::size_t>(of.inverse.size());
  return sum;
}

}  // namespace hexsolver
