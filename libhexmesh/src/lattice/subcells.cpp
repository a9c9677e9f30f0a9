// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/lattice/subcells.h"

#include "hexmesh/geometry/shape_functions.h"

namespace hexmesh {
namespace {

/// The lower two of the four along an axis hold what pairs of them held, the upper two nothing.
SubcellMask halved(SubcellMask mask, int axis) {
  switch (axis) {
    case 0:
      mask = (mask | mask >> 1) & 0x5555555555555555U;
      return (mask | mask >> 1) & 0x3333333333333333U;
    case 1:
      mask = (mask | mask >> 4) & 0x0F0F0F0F0F0F0F0FU;
      return (mask | mask >> 4) & 0x00FF00FF00FF00FFU;
    default:
      mask = (mask | mask >> 16) & 0x0000FFFF0000FFFFU;
      return (mask | mask >> 16) & 0x00000000FFFFFFFFU;
  }
}

}  // namespace

SubcellMask subcells_of(const Children& children, const std::vector<SubcellMask>& of_elements, const Index3& merge) {
  constexpr int half[3] = {2, 8, 32};  // bits from the lower half to the upper one
  SubcellMask sum = 0;
  for (int slot = 0; slot < 8; ++slot) {
    if (children[slot] < 0) continue;
    SubcellMask mask = of_elements[children[slot]];
    for (int d = 0; d < 3; ++d)
      if (merge[d] == 2) mask = halved(mask, d) << (corner_bit(slot, d) * half[d]);
    sum |= mask;
  }
  return sum;
}

}  // namespace hexmesh
