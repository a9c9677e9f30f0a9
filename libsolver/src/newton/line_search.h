// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <optional>

#include "newton/fields.h"

namespace hexsolver {

/// Backtracking along a Newton step until the energy falls enough (Armijo), or the residual where there is no energy.
/// Source: Nocedal, Wright, Numerical Optimization, 2nd ed. (2006), algorithm 3.1.
struct LineSearch {
  static constexpr double least_decrease = 1e-4;  ///< c_1: of what the slope promises
  double shortest = 1e-4;                         ///< part of the step
  double shortest_without_energy = 1e-2;
  /// A full step is also taken where it halves the residual: near the solution energies differ by rounding only.
  bool takes_half_residual = false;

  /// By how much energies may differ by rounding alone [N mm].
  /// @param rounding  of a gradient [N]
  static double energy_rounding(double energy, double rounding, double largest_of_step) {
    return 1e-13 * std::abs(energy) + rounding * largest_of_step;
  }

  /// Where energies differ by rounding alone the slope along the step decides, at its start and at its end: if the
  /// energy were quadratic along it, this would be the decrease asked of it. Source: Hager, Zhang, SIAM J. Optim. 16
  /// (2005) 170, the approximate Wolfe condition.
  static bool is_settled(double slope_before, double slope_after) {
    return slope_before < 0 && slope_after <= (2 * least_decrease - 1) * slope_before;
  }

  /// Of forces without energy: whether what is left of the residual along the step is less than before. Stiff parts of
  /// a body make the residual larger at first, where the step itself is good. Source: Matthies, Strang, Int. J. Numer.
  /// Meth. Engng 14 (1979) 1613.
  static bool is_shorter(double slope_before, double slope_after) {
    constexpr double part = 0.8;
    return slope_before < 0 && std::abs(slope_after) <= part * -slope_before;
  }

  /// Whether the energy falls at the end of a step about as steeply as at its start.
  static bool goes_on(double slope_before, double slope_after) { return slope_after < 0.5 * slope_before; }

  /// @param try_part   length -> whether it is good: called with 1, 1/2, 1/4, ...
  /// @returns the part of the step taken; nothing if no part helps
  template <class TryPart>
  static std::optional<double> backtrack(double shortest, const TryPart& try_part) {
    for (double length = 1; length >= shortest; length /= 2)
      if (try_part(length)) return length;
    return {};
  }
};

/// How sharply the next linear equations are worth solving: as the residual after them can use (inexact Newton).
/// Source: Eisenstat, Walker, SIAM J. Sci. Comput. 17 (1996) 16, for why residuals choose it.
/// @param supports_hold  false for the step that brings the supports to their places
inline double forcing(double tolerance, double relative_residual, bool supports_hold) {
  if (!supports_hold) return std::max(1e-3, 0.1 * tolerance);
  return std::max(std::min(10 * relative_residual, 0.05), 0.1 * tolerance / relative_residual);
}

}  // namespace hexsolver
