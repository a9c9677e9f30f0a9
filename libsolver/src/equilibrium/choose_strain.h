// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "equilibrium/load_steps.h"

namespace hexsolver {

/// What strain = "auto" takes, and why.
struct StrainChoice {
  Elasticity elasticity = Elasticity::corotational;
  double angle_without_effect = 0;  ///< of cells that need not rotate [rad]
  bool is_sure = true;              ///< whether a finer level need not be asked
  double deformation = 0;           ///< mean, of what was compared [mm]
  std::string why;
};

/// The levels on which solutions with and without rotating cells are compared: from `coarsest` on until one is sure, or
/// on `finest`.
struct StrainLevels {
  int coarsest = 0;
  int finest = 0;
};

/// `finest` is two levels coarser than the one asked, where there are as many, and has at most 2,000 cells: two
/// solutions of what is solved would cost more than they save. `coarsest` costs next to nothing beside the level asked.
/// Both have at least 30 cells, or are the level asked: fewer know no bending.
/// @param num_cells  of each level
inline StrainLevels levels_to_compare_strains(const std::vector<std::size_t>& num_cells, int first, int asked) {
  constexpr std::size_t most_cells = 2000, least_cells = 30, least_part = 200;
  const auto cells = [&](int level) { return num_cells[static_cast<std::size_t>(level)]; };
  const auto finest_of = [&](std::size_t most) {
    int level = first;
    while (level > std::min(first, asked + 2) && cells(level - 1) <= most) --level;
    while (level > asked && cells(level) < least_cells) --level;
    return level;
  };
  return {finest_of(std::min(most_cells, cells(asked) / least_part)), finest_of(most_cells)};
}

inline constexpr double tolerance_of_strains = 1e-5;

/// What rotations may change where they are left out.
struct StrainLimits {
  std::optional<double> allowed;  ///< [mm]; nothing: a part of the mean deformation
  double margin = 1;              ///< by how much more than a level shows
};

/// How much less a coarse level may bend: 1 on the level asked, 2 one or two levels coarser, then doubled with each.
inline double strain_margin(int levels_coarser) {
  return levels_coarser == 0 ? 1 : std::ldexp(1.0, std::max(1, levels_coarser - 1));
}

/// The largest angle [rad] by which cells may be rotated and not rotate. A cell that is rotated by omega takes omega^2
/// / 2 for strain, which over the length of the body moves its end by omega^2 / 2 times that: half of what is allowed.
/// And cells up to that angle have at most a part of what all take for strain where none rotates.
/// @param part  of what that changes, which may be left
template <class Level>
double angle_without_effect(const Level& level, const typename Level::Vector& u, double allowed, double part) {
  constexpr double least = 1e-6;
  double angle = std::sqrt(allowed / level.diameter());
  while (angle > least && !(level.share_of_turns(angle, u) <= part)) angle *= std::sqrt(0.5);
  return angle > least ? angle : 0;
}

/// From a level's solution without rotations take a few steps with them, and see what they change, beside what deforms:
/// a rigid motion that is added to all conditions makes no difference. Cells that are left out have half of what is
/// allowed.
/// @param again   the level made anew
/// @param limits  of what they may change
template <class Level>
StrainChoice compare_strains(const Level& level, const typename Level::Vector& straight, Level& again,
                             const StrainLimits& limits, const LoadProgress& progress) {
  using Vector = typename Level::Vector;
  constexpr int most_steps = 5;
  constexpr double default_part = 0.01;  // of the mean deformation, where no accuracy is asked
  NewtonOptions options;
  options.tolerance = tolerance_of_strains;
  options.estimate_error = false;
  options.max_iterations = most_steps;
  Vector rest = level.make_zero();
  again.build(Elasticity::corotational, nullptr, rest);
  const LoadedState<Vector> turned =
      solve_in_load_steps(again, options, std::optional<Vector>(copy_of(straight)), progress, Aim::look);

  StrainChoice out;
  out.deformation = level.mean_deformation(straight);
  const double allowed = limits.allowed.value_or(default_part * out.deformation);
  out.why = fmt::format("solve.strain = \"auto\": on level {} rotating cells changes the displacement", level.level());
  Vector change_of_u = level.make_zero();
  set_sum(change_of_u, turned.u, -1, straight);
  const double change = level.size_in_material(change_of_u, true).mean;
  const double margin = limits.margin;
  const bool rotates = !turned.newton.converged || margin * change > allowed;
  if (rotates)
    out.angle_without_effect = angle_without_effect(again, turned.u, allowed, 0.5 * allowed / (margin * change));
  else
    out.elasticity = Elasticity::cauchy;
  if (!turned.newton.converged) {
    out.why += fmt::format(" by more than {} Newton steps follow", most_steps);
    return out;
  }
  out.is_sure = !rotates || change > margin * allowed;
  out.why += fmt::format(" by {:.2g} mm on average, {} {:.2g} mm, from where they count", change,
                         rotates ? "more than" : "less than", allowed / margin);
  return out;
}

/// Solve a level without rotations, and compare.
/// @param make  () -> Level. @throws Error{geometry} as it does
template <class Make>
StrainChoice choose_strain(const Make& make, const StrainLimits& limits, const LoadProgress& progress) {
  const auto level = make();
  using Vector = typename std::remove_cvref_t<decltype(*level)>::Vector;
  NewtonOptions options;
  options.tolerance = tolerance_of_strains;
  options.estimate_error = false;
  Vector rest = level->make_zero();
  level->build(Elasticity::cauchy, nullptr, rest);
  const LoadedState<Vector> straight = solve_in_load_steps(*level, options, std::optional<Vector>(), progress);
  return compare_strains(*level, straight.u, *make(), limits, progress);
}

}  // namespace hexsolver
