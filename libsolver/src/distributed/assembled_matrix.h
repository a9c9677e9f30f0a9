// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <unordered_map>
#include <vector>

#include "distributed/shared_level.h"

namespace hexsolver::mpi {

/// H of a level with springs for supports, which PETSc's own preconditioners are made of, with the rigid motions as its
/// near null space. Made by all processes at once.
class AssembledMatrix {
public:
  explicit AssembledMatrix(const SharedLevel& level);  ///< which must outlive this; no entries yet
  void assemble();                                     ///< as the level is linearized now
  Mat get() const { return matrix_; }

private:
  void make_room();

  const SharedLevel& level_;
  OwnedMat matrix_;
  std::unordered_map<std::size_t, std::vector<std::size_t>> points_of_cell_;  ///< held, by cell of the part
  std::vector<double> support_weights_;                                       ///< of each condition [N/mm]
  bool has_weights_ = false;
};

}  // namespace hexsolver::mpi
