// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <unordered_map>

#include "constraints/constraints.h"

namespace hexsolver {

/// How stiff the springs w H^T H are by which coarser levels see a condition: w makes its largest nodal weight,
/// sum_p H_pn, about `nodal_stiffnesses` of the stiffest node of its cells.
///
/// The finest level keeps supports exactly, so more only spoils the coarser smoothers (a real liver, 289,431 dofs,
/// cells partly filled: 14, 12, 13 iterations with 3, 5, 9). A support within one cell gives way with the fine cells
/// around it, which coarser ones are too stiff to do: its spring does that in their place (a single point each, real
/// livers of 1.0 and 4.1 million dofs: 16, 18, 22 and 21, 24, 29 iterations with 0.5, 1, 5).
class SupportSprings {
public:
  /// @param nodes  of the point's cell
  /// @param trace  of that cell's stiffness matrix [N/mm]
  void add(const ConstraintPoint& point, const CellNodes& nodes, double trace) {
    stiffness_ = std::max(stiffness_, 8 * trace / 24);
    for (int a = 0; a < 8; ++a) density_ = std::max(density_, weight_of_node_[nodes[a]] += point.weights[a]);
  }
  /// Also of cells that others have.
  void raise_stiffness(double nodal) { stiffness_ = std::max(stiffness_, nodal); }

  double stiffness() const noexcept { return stiffness_; }  ///< of a node [N/mm]
  double weight() const {                                   ///< w [N/mm]
    constexpr double at_a_patch = 5, at_a_point = 0.5;
    const double nodal_stiffnesses = weight_of_node_.size() > 8 ? at_a_patch : at_a_point;
    return density_ > 0 ? nodal_stiffnesses * stiffness_ / density_ : 0;
  }

private:
  double stiffness_ = 0, density_ = 0;
  std::unordered_map<std::int32_t, double> weight_of_node_;
};

/// w of each condition [N/mm]. Called by all processes at once.
/// @param points_of_cell  cell -> which of constraints.held()
/// @param trace_of        cell -> trace of its stiffness matrix [N/mm]
template <class PointsOfCell, class TraceOf>
std::vector<double> support_weights(const HeldDirections& constraints, const PointsOfCell& points_of_cell,
                                    const std::vector<CellNodes>& cell_nodes, const TraceOf& trace_of) {
  std::vector<SupportSprings> springs;
  for (const auto& [cell, members] : points_of_cell) {
    const double trace = trace_of(cell);
    for (const std::size_t m : members) {
      const ConstraintPoint& p = constraints.held()[m];
      const auto condition = static_cast<std::size_t>(p.condition);
      springs.resize(std::max(springs.size(), condition + 1));
      springs[condition].add(p, cell_nodes[cell], trace);
    }
  }
  constraints.complete(springs);
  std::vector<double> out;
  for (const SupportSprings& s : springs) out.push_back(s.weight());
  return out;
}

/// k += w H^T H of one point, in its cell; nothing where a spring holds it, which k has already: stiffer than that,
/// what a soft patch leaves free is held on coarser levels (the phantom, nu = 0.49, cells of 4 mm: 23 iterations in
/// place of 12).
inline void add_spring(const ConstraintPoint& point, double w, CellMatrix& k) {
  if (point.spring > 0) return;
  for (int axis = 0; axis < 3; ++axis) {
    if (!point.axes[axis]) continue;
    for (int a = 0; a < 8; ++a)
      for (int b = 0; b < 8; ++b) k(3 * a + axis, 3 * b + axis) += w * point.weights[a] * point.weights[b];
  }
}

}  // namespace hexsolver
