// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/view/grey_window.h"

#include <cmath>

namespace hexmesh {

GreyWindow grey_window(const Result& result, const IntensityVolume& scan, std::optional<double> level,
                       std::optional<double> window) {
  std::vector<double> inside;
  const std::size_t stride = 1 + result.labels.size() / 300000;
  for (std::size_t n = 0; n < result.labels.size(); n += stride) {
    if (result.labels[n] == 0) continue;
    const Index3 v = result.voxels.index(n);
    const double value = value_at(scan, result.voxels.center(v));
    if (!std::isnan(value)) inside.push_back(value);
  }
  double low = 0, high = 1;
  if (!inside.empty()) {
    std::sort(inside.begin(), inside.end());
    low = inside[inside.size() / 500];
    high = inside[inside.size() - 1 - inside.size() / 500];
    if (!(high > low)) high = low + std::max(1e-6 * std::abs(low), 1e-6);
  }
  const double middle = level.value_or((low + high) / 2), width = window.value_or(3 * (high - low));
  return {middle - width / 2, middle + width / 2};
}

}  // namespace hexmesh
