// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "hexmesh/lattice/merge.h"
#include "mesh/mesh.h"

namespace hexsolver {

/// What couples a point of one cell with one of another in a second derivative of energy: -H_a^T A H_b and its
/// transpose. What each has for itself, H_a^T A H_a, is of its cell.
struct Coupling {
  std::int32_t a, b;       ///< cells
  NodeWeights of_a, of_b;  ///< of their nodes
  Mat3 hessian;            ///< A, symmetric [N/mm]
};

/// y += H x
template <class Vector>
void add_product(const Mesh& mesh, const std::vector<Coupling>& couplings, const Vector& x, Vector& y);

/// The same on coarser cells, with u of the finer nodes interpolated from their parents'.
/// @param merge  of the cells
std::vector<Coupling> passed_to_parents(const std::vector<Coupling>& couplings, const hexmesh::Merge& merge,
                                        std::size_t num_cells);

/// What two cells have in common: the sum of -H_a^T A H_b of all points.
struct CellCoupling {
  std::int32_t a, b;
  CellMatrix matrix;
};
/// Points are many, pairs of cells few on coarse levels.
std::vector<CellCoupling> sums_of_cells(const std::vector<Coupling>& couplings);

/// f(free node, free node, block) for all that is not 0.
template <class F>
void for_each_block(const Mesh& mesh, const std::vector<Coupling>& couplings, const F& f) {
  for (const CellCoupling& c : sums_of_cells(couplings))
    for (std::size_t i = 0; i < 8; ++i)
      for (std::size_t j = 0; j < 8; ++j) {
        const Mat3 block = c.matrix.block<3, 3>(3 * static_cast<Eigen::Index>(i), 3 * static_cast<Eigen::Index>(j));
        mesh.for_each_free(hexmesh::as_size(c.a), i, [&](std::int32_t row, double of_row) {
          mesh.for_each_free(hexmesh::as_size(c.b), j, [&](std::int32_t column, double of_column) {
            f(row, column, Mat3(of_row * of_column * block));
            f(column, row, Mat3(of_row * of_column * block.transpose()));
          });
        });
      }
}

}  // namespace hexsolver
