// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <optional>
#include <vector>

#include "core/stopwatch.h"
#include "hexmesh/core/error.h"
#include "hexmesh/lattice/lattice.h"
#include "hexsolver/report/report.h"
#include "hexsolver/scene/scene.h"

namespace hexsolver {

/// The finest of the levels `first` to `last` that has at most that many cells, or `first`.
int finest_of(const std::vector<std::size_t>& num_cells, std::size_t most, int first, int last);

double seconds_of(const std::vector<Effect>& effects, EffectKind kind);

/// Cells of level `to` for each of level `from`.
double growth(const std::vector<std::size_t>& num_cells, int from, int to);

/// f(level) of the coarsest of the levels `first` to `last` on which it can be: patches may be at odds in coarse cells.
template <class F>
int try_levels(int first, int last, F&& f) {
  for (int level = first;; --level) {
    try {
      f(level);
      return level;
    } catch (const hexmesh::Error& e) {
      if (e.kind() != hexmesh::ErrorKind::geometry || level == last) throw;
    }
  }
}

template <class F>
double median_seconds(int repeats, F&& f) {
  std::vector<double> seconds;
  for (int n = 0; n < repeats; ++n) {
    const Stopwatch watch;
    f();
    seconds.push_back(watch.seconds());
  }
  std::nth_element(seconds.begin(), seconds.begin() + repeats / 2, seconds.end());
  return seconds[static_cast<std::size_t>(repeats / 2)];
}

/// What levels take [s]: coarse ones are solved, up to one of about a second, which says what each cell of finer ones
/// takes.
class Trial {
public:
  /// @param first   coarsest level that a solution starts from
  /// @param level   that is named, or the finest that an accuracy or a budget may lead to
  /// @param finest  that something is asked of
  Trial(const hexmesh::Lattice& lattice, const Scene& scene, int first, int level, int finest);

  /// Of a level that is solved to the tolerance asked [s].
  double to_the_end(int level) const;
  /// Of a level that is a start for others only [s].
  double as_a_start(int level);

  /// Of what a solution does beside its levels: to find whether cells have to rotate [s].
  double beside_levels() const;

  /// Of the solution to the finest level tried.
  const SolveReport& report() const noexcept { return report_; }
  bool keeps_accuracy() const { return scene_.asks_accuracy() && report_.converged && !report_.accuracy_missed; }

private:
  /// What a level takes [s].
  struct Pace {
    double forming = 0;  ///< to form its elements, from voxels that are as many on each level
    double product = 0;  ///< an operator product, for each cell
  };

  static Pace pace_of(const hexmesh::Lattice& lattice, const Scene& scene, int level);
  void find_paces();
  SolveReport solve(double tolerance) const;
  double scaled(double seconds, int level) const;

  const hexmesh::Lattice& lattice_;
  Scene scene_;
  int level_, tried_ = 0;
  std::vector<std::size_t> num_cells_;
  SolveReport report_;
  Pace pace_, pace_of_large_;  ///< of the level tried, and of the finest that is quick to make
  std::optional<double> start_;
};

}  // namespace hexsolver
