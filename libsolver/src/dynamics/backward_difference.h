// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hexsolver/core/vectors.h"

namespace hexsolver {

/// Steps of second order, each told as a step of implicit Euler of another length from another state,
///
///     v = (u - u') / h',   a = (v - v') / h'.
///
/// The second-order backward difference (BDF2) with steps of any length, r = h / h_(n-1), stable up to 1 + sqrt(2):
///
///     h' = h (1 + r) / (1 + 2 r),   u' = u_n + r^2 / (1 + 2 r) (u_n - u_(n-1)),   v' likewise.
///
/// Where there is no step before, the two stages of SDIRK2: implicit Euler over g h, g = 1 - 1 / sqrt(2), to u_s, then
///
///     h' = g h,   u' = u_n + (1 - g) / g (u_s - u_n),   v' likewise.
///
/// Sources: Hairer, Wanner, "Solving Ordinary Differential Equations I" (1993), section III.5, for BDF2; Alexander,
/// SIAM J. Numer. Anal. 14 (1977) 1006, for SDIRK2.
class BackwardDifference {
public:
  bool has_past() const noexcept { return length_before_ > 0; }
  double length_before() const noexcept { return length_before_; }  ///< of the last step; 0 without one [s]
  void forget() noexcept { length_before_ = 0; }

  /// A step of h seconds from u, v has been taken.
  void remember(const NodeVector& u, const NodeVector& v, double h);

  static double first_stage(double h);  ///< g h [s]

  // Begin a step of h seconds from u, v: of implicit Euler, which copies nothing; of BDF2, with a past; of the second
  // stage of SDIRK2, from what the first one found.
  void begin_euler(double h);
  void begin_bdf2(const NodeVector& u, const NodeVector& v, double h);
  void begin_second_stage(const NodeVector& u, const NodeVector& v, const NodeVector& stage_u,
                          const NodeVector& stage_v, double h);

  // Of the step begun:
  double length() const noexcept { return length_; }                                 ///< h' [s]
  const NodeVector& u(const NodeVector& now) const { return is_euler_ ? now : u_; }  ///< u'; now: u_n
  const NodeVector& v(const NodeVector& now) const { return is_euler_ ? now : v_; }  ///< v'; now: v_n
  /// Where it ends, to first order; of implicit Euler where it begins.
  const NodeVector& ahead(const NodeVector& now) const { return is_euler_ ? now : ahead_; }
  bool is_euler() const noexcept { return is_euler_; }

private:
  bool is_euler_ = true;
  double length_ = 0, length_before_ = 0;
  NodeVector u_before_, v_before_, u_, v_, ahead_;
};

}  // namespace hexsolver
