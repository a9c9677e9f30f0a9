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

/// f(free node, free node, block) for all that is not 0.
template <class F>
void for_each_block(const Mesh& mesh, const std::vector<Coupling>& couplings, const F& f) {
  for (const Coupling& c : couplings)
    for (int i = 0; i < 8; ++i)
      for (int j = 0; j < 8; ++j) {
        const Mat3 block = -c.of_a[i] * c.of_b[j] * c.hessian;
        mesh.for_each_free(hexmesh::as_size(c.a), hexmesh::as_size(i), [&](std::int32_t row, double of_row) {
          mesh.for_each_free(hexmesh::as_size(c.b), hexmesh::as_size(j), [&](std::int32_t column, double of_column) {
            const Mat3 of_free = of_row * of_column * block;
            f(row, column, of_free);
            f(column, row, of_free);
          });
        });
      }
}

}  // namespace hexsolver
