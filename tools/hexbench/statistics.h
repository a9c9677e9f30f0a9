// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <omp.h>

#include <vector>

#include "hexmesh/core/grid.h"

namespace hextools {

/// Of the lengths of differences [mm].
struct Distances {
  double mean = 0, min = 0, max = 0, deviation = 0;
};
Distances distances(const std::vector<hexmesh::Vec3>& a, const std::vector<hexmesh::Vec3>& b);

/// Of numbers; their own unit.
Distances statistics(const std::vector<double>& values);

double median(std::vector<double> values);

template <class F>
double seconds_of(F&& f) {
  const double start = omp_get_wtime();
  f();
  return omp_get_wtime() - start;
}

/// The median of `repeats` calls.
template <class F>
double median_seconds_of(int repeats, F&& f) {
  std::vector<double> seconds;
  for (int n = 0; n < repeats; ++n) seconds.push_back(seconds_of(f));
  return median(seconds);
}

/// Seconds of one call after a first that does not count, over as many as fill half a second, three at least.
template <class F>
double seconds_of_one(F&& f) {
  constexpr double least_seconds = 0.5;
  f();
  int count = 0;
  double seconds = 0;
  for (; seconds < least_seconds || count < 3; ++count) seconds += seconds_of(f);
  return seconds / count;
}

}  // namespace hextools
