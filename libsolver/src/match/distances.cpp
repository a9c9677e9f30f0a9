// SPDX-License-Identifier: Apache-2.0
#include "match/distances.h"

#include <algorithm>

namespace hexsolver {

DistanceReport statistics(Distances all) {
  std::sort(all.begin(), all.end());
  DistanceReport out;
  double area = 0, below = 0;
  for (const auto& [d, w] : all) {
    out.mean_mm += w * d;
    area += w;
  }
  if (!(area > 0)) return out;
  out.mean_mm /= area;
  out.largest_mm = all.back().first;
  for (const auto& [d, w] : all) {
    out.percentile95_mm = d;
    if ((below += w) >= 0.95 * area) break;
  }
  return out;
}

double median(Distances all) {
  std::sort(all.begin(), all.end());
  double area = 0, below = 0;
  for (const auto& entry : all) area += entry.second;
  for (const auto& [d, w] : all)
    if ((below += w) >= area / 2) return d;
  return 0;
}

}  // namespace hexsolver
