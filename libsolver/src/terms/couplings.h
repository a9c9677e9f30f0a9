// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <utility>
#include <vector>

#include "hexmesh/core/bytes.h"
#include "hexmesh/lattice/merge.h"
#include "mesh/mesh.h"

namespace hexsolver {

/// What couples pairs of cells in a second derivative of energy, sum_p -H_a^T A H_b and its transpose, over the points
/// p of cell a that meet a point of cell b. What each has for itself, H_a^T A H_a, is of its cell. Kept as one matrix
/// for each pair: points are many, pairs few.
class Couplings {
public:
  void clear();
  bool empty() const noexcept { return pairs_.empty(); }

  /// Adds those of one point.
  /// @param of_a, of_b  weights of the cells' nodes, H
  /// @param hessian     A, symmetric [N/mm]
  void add(std::int32_t a, std::int32_t b, const NodeWeights& of_a, const NodeWeights& of_b, const Mat3& hessian);
  void add(const Couplings& others);

  /// y += H x
  template <class Vector>
  void add_product(const Mesh& mesh, const Vector& x, Vector& y) const;

  /// The same on coarser cells, with u of the finer nodes interpolated from their parents'.
  /// @param merge  of the cells, so many
  Couplings of_parents(const hexmesh::Merge& merge, std::size_t num_cells) const;

  /// f(free node, free node, block) for all that is not 0.
  template <class F>
  void for_each_block(const Mesh& mesh, const F& f) const;

  std::size_t bytes() const { return hexmesh::bytes_of(pairs_) + number_.size() * sizeof(*number_.begin()); }

private:
  struct Pair {
    std::int32_t a, b;
    CellMatrix matrix;
  };
  CellMatrix& matrix_of(std::int32_t a, std::int32_t b);

  std::vector<Pair> pairs_;
  std::map<std::pair<std::int32_t, std::int32_t>, std::size_t> number_;  ///< in pairs_
};

template <class F>
void Couplings::for_each_block(const Mesh& mesh, const F& f) const {
  for (const Pair& pair : pairs_)
    for (std::size_t i = 0; i < 8; ++i)
      for (std::size_t j = 0; j < 8; ++j) {
        const Mat3 block = pair.matrix.block<3, 3>(3 * static_cast<Eigen::Index>(i), 3 * static_cast<Eigen::Index>(j));
        mesh.for_each_free(hexmesh::as_size(pair.a), i, [&](std::int32_t row, double of_row) {
          mesh.for_each_free(hexmesh::as_size(pair.b), j, [&](std::int32_t column, double of_column) {
            f(row, column, Mat3(of_row * of_column * block));
            f(column, row, Mat3(of_row * of_column * block.transpose()));
          });
        });
      }
}

}  // namespace hexsolver
