// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "equilibrium/load_steps.h"

namespace hexsolver {

/// What strain = "auto" takes, and why.
struct StrainChoice {
  Elasticity elasticity = Elasticity::corotational;
  double angle_without_effect = 0;  ///< of cells that need not rotate [rad]
  std::string why;
};

/// Two levels coarser than the one asked, where there are as many: two solutions of what is solved would cost more than
/// they save.
/// @param num_cells  of each level
inline int level_to_compare_strains(const std::vector<std::size_t>& num_cells, int first, int finest) {
  constexpr std::size_t most_cells = 2000;
  int level = first;
  while (level > std::min(first, finest + 2) && num_cells[static_cast<std::size_t>(level - 1)] <= most_cells) --level;
  return level;
}

/// Solve a coarse level without rotations, take a few steps with them from there, and see what they change, beside what
/// deforms: a rigid motion that is added to all conditions makes no difference. A cell that is rotated by w, but does
/// not rotate, takes w^2 / 2 for strain, which over the length of the body moves its end by w^2 / 2 times that: half of
/// what is allowed, for the largest w that is left out.
/// @param is_coarser  than the level asked
/// @param make        level number -> Level. @throws Error{geometry} as it does
template <class Level, class Make>
StrainChoice choose_strain(int number, bool is_coarser, const Scene& scene, const Make& make,
                           const LoadProgress& progress) {
  using Vector = typename Level::Vector;
  constexpr double tolerance = 1e-3;
  constexpr int most_steps = 5;
  constexpr double default_part = 0.01;  // of the mean deformation, where no accuracy is asked
  const auto build = [&](Elasticity elasticity) {
    auto level = make(number);
    Vector rest = level->make_zero();
    level->build(elasticity, nullptr, rest);
    return level;
  };
  NewtonOptions options;
  options.tolerance = tolerance;
  const auto level = build(Elasticity::cauchy);
  const LoadedState<Vector> straight = solve_in_load_steps(*level, options, std::optional<Vector>(), progress);
  options.max_iterations = most_steps;
  const LoadedState<Vector> turned = solve_in_load_steps(*build(Elasticity::corotational), options,
                                                         std::optional<Vector>(copy_of(straight.u)), progress, true);

  const double allowed = scene.accuracy.value_or(default_part * level->mean_deformation(straight.u));
  StrainChoice out;
  out.angle_without_effect = std::sqrt(allowed / level->diameter());
  out.why = fmt::format("solve.strain = \"auto\": on level {} rotating cells changes the displacement", number);
  if (!turned.newton.converged) {
    out.why += fmt::format(" by more than {} Newton steps follow", most_steps);
    return out;
  }
  Vector change_of_u = level->make_zero();
  set_sum(change_of_u, turned.u, -1, straight.u);
  const double change = level->size_in_material(change_of_u, true).mean;
  const double margin = is_coarser ? 2 : 1;  // coarse cells bend less
  const bool rotates = margin * change > allowed;
  if (!rotates) out.elasticity = Elasticity::cauchy;
  out.why += fmt::format(" by {:.2g} mm on average, {} {:.2g} mm, from where they count", change,
                         rotates ? "more than" : "less than", allowed / margin);
  return out;
}

}  // namespace hexsolver
