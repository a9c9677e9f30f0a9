// SPDX-License-Identifier: Apache-2.0
#include "statistics.h"

#include <algorithm>
#include <cmath>

namespace hextools {

Distances statistics(const std::vector<double>& values) {
  if (values.empty()) return {};
  Distances d{0, values.front(), values.front(), 0};
  const auto count = static_cast<double>(values.size());
  for (const double v : values) {
    d.mean += v / count;
    d.min = std::min(d.min, v);
    d.max = std::max(d.max, v);
  }
  for (const double v : values) d.deviation += (v - d.mean) * (v - d.mean) / count;
  d.deviation = std::sqrt(d.deviation);
  return d;
}

Distances distances(const std::vector<hexmesh::Vec3>& a, const std::vector<hexmesh::Vec3>& b) {
  std::vector<double> lengths(a.size());
  for (std::size_t n = 0; n < a.size(); ++n) lengths[n] = (a[n] - b[n]).norm();
  return statistics(lengths);
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

}  // namespace hextools
