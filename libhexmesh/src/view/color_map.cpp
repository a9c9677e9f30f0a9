// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/view/color_map.h"

#include <algorithm>
#include <cmath>

namespace hexmesh {

Rgb viridis(double t) {
  constexpr std::array<std::array<double, 3>, 9> stops = {{{68, 1, 84},
                                                           {71, 44, 122},
                                                           {59, 81, 139},
                                                           {44, 113, 142},
                                                           {33, 144, 141},
                                                           {39, 173, 129},
                                                           {92, 200, 99},
                                                           {170, 220, 50},
                                                           {253, 231, 37}}};
  const double place = (t > 0 ? std::min(t, 1.0) : 0) * (stops.size() - 1);  // 0 for NaN
  const std::size_t low = std::min(static_cast<std::size_t>(place), stops.size() - 2);
  const double share = place - static_cast<double>(low);
  Rgb out;
  for (std::size_t c = 0; c < 3; ++c)
    out[c] = static_cast<std::uint8_t>(std::lround((1 - share) * stops[low][c] + share * stops[low + 1][c]));
  return out;
}

}  // namespace hexmesh
