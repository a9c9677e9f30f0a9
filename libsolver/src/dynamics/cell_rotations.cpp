// SPDX-License-Identifier: Apache-2.0
#include "dynamics/cell_rotations.h"

namespace hexsolver {
namespace {

/// Cells rotate from where one of them would take so much of its rotation for strain.
constexpr double allowed_strain = 2.5e-4;
/// Cells keep their R where two of their singular values sum to less. Its derivative is exact above polar_floor.
constexpr double least_sum_of_stretches = 0.25;

}  // namespace

bool CellRotations::have_to_begin(const NodeVector& u) const {
  return are_straight_ && cells_->strain_of_rotations(u) > allowed_strain;
}

void CellRotations::begin(double time) {
  cells_->set_rotating({});
  are_straight_ = false;
  since_ = time;
}

bool CellRotations::hold(const NodeVector& u, const NodeVector* tried) {
  if (!cells_ || are_straight_) return false;
  const std::size_t before = cells_->num_held();
  cells_->hold_rotations(u, tried, least_sum_of_stretches);
  return cells_->num_held() > before;
}

void CellRotations::let_go() {
  if (num_held() > 0) cells_->set_rotating({});
}

}  // namespace hexsolver
