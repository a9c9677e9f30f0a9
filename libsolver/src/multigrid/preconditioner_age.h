// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>

namespace hexsolver {

/// When a preconditioner of an earlier linearization is worn. Iterations gain digits of the residual at some rate; the
/// first solution sets the standard.
class PreconditionerAge {
public:
  struct Rules {
    double least_rate = 0;   ///< worn below this part of the first rate
    double most_lost = 1e9;  ///< worn when its age has cost more iterations than this
    /// With an older one a solution ends after so many iterations; nothing: after twice as many as the first rate
    /// would take, and five.
    std::optional<int> most_iterations;
  };
  explicit PreconditionerAge(const Rules& rules) : rules_(rules) {}

  bool is_worn() const noexcept { return is_worn_; }
  void wear_out() noexcept { is_worn_ = true; }

  /// A new one is made.
  void renew() {
    is_worn_ = false;
    first_rate_.reset();
    lost_ = 0;
  }

  /// What a solution with it was like.
  /// @param reduction  of the residual
  void judge(bool is_solved, int iterations, double reduction) {
    if (!is_solved) {
      is_worn_ = true;
      return;
    }
    if (iterations == 0) return;
    const double rate = -std::log10(std::max(reduction, 1e-300)) / iterations;
    if (!first_rate_) first_rate_ = rate;
    lost_ += iterations * (1 - rate / *first_rate_);
    is_worn_ = is_worn_ || !(rate > rules_.least_rate * *first_rate_) || lost_ > rules_.most_lost;
  }

  /// That a solution with an older one may take.
  /// @param is_open_ended  whether it may have to go on below relative_tolerance
  int most_iterations(int otherwise, double relative_tolerance, bool is_open_ended) const {
    if (rules_.most_iterations) return std::min(otherwise, *rules_.most_iterations);
    if (is_open_ended || !first_rate_ || !(*first_rate_ > 0)) return otherwise;
    return std::min(otherwise, 5 + static_cast<int>(2 * -std::log10(relative_tolerance) / *first_rate_));
  }

private:
  Rules rules_;
  bool is_worn_ = true;
  std::optional<double> first_rate_;  ///< digits per iteration of the first solution
  double lost_ = 0;                   ///< iterations, to its age
};

/// Of Newton steps: a cycle is made anew once it gains less than 0.7 of the digits per iteration that it gained at
/// first.
inline constexpr PreconditionerAge::Rules ageing_of_newton_steps = {0.7, 1e9, {}};

}  // namespace hexsolver
