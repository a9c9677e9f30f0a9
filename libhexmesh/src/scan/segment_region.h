// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <itkImage.h>
#include <itkSignedMaurerDistanceMapImageFilter.h>

#include <algorithm>

#include "hexmesh/volume/label_volume.h"

namespace hexmesh {

using Mask = itk::Image<std::uint8_t, 3>;

/// The box of one label with room around it, as an image of its own.
struct Region {
  Index3 low, extent;  ///< low may lie outside the volume
  Mask::Pointer mask;  ///< 1 where the label is
};

/// @param margin  voxels of room on each side
/// @returns an extent of 0 where the label does not occur
inline Region region_of(const LabelVolume& volume, std::uint16_t label, const Index3& margin) {
  Index3 low = volume.grid.extent(), high = {-1, -1, -1};
  for (std::size_t n = 0; n < volume.labels.size(); ++n) {
    if (volume.labels[n] != label) continue;
    const Index3 v = volume.grid.index(n);
    for (std::size_t d = 0; d < 3; ++d) {
      low[d] = std::min(low[d], v[d]);
      high[d] = std::max(high[d], v[d]);
    }
  }
  if (high[0] < 0) return {{}, {0, 0, 0}, nullptr};
  Region out{};
  Mask::SizeType size;
  Mask::SpacingType spacing;
  for (std::size_t d = 0; d < 3; ++d) {
    out.low[d] = low[d] - margin[d];
    out.extent[d] = high[d] - low[d] + 1 + 2 * margin[d];
    size[static_cast<unsigned>(d)] = static_cast<itk::SizeValueType>(out.extent[d]);
    spacing[static_cast<unsigned>(d)] = volume.grid.spacing()[d];
  }
  out.mask = Mask::New();
  out.mask->SetRegions(Mask::RegionType(size));
  out.mask->SetSpacing(spacing);
  out.mask->Allocate(true);
  return out;
}

/// Calls f(offset in the mask, offset in the volume) for all voxels of a region that lie in the volume.
template <class F>
void for_each_voxel(const Region& region, const Grid& grid, F&& f) {
  std::size_t n = 0;
  for (std::int32_t k = 0; k < region.extent[2]; ++k)
    for (std::int32_t j = 0; j < region.extent[1]; ++j)
      for (std::int32_t i = 0; i < region.extent[0]; ++i, ++n) {
        const Index3 v = {region.low[0] + i, region.low[1] + j, region.low[2] + k};
        if (grid.contains(v)) f(n, grid.offset(v));
      }
}

/// Where a mask is 0: the distance to the nearest voxel centre that is 1 [mm].
inline itk::Image<float, 3>::Pointer distances_to(Mask* mask) {
  mask->Modified();
  auto filter = itk::SignedMaurerDistanceMapImageFilter<Mask, itk::Image<float, 3>>::New();
  filter->SetInput(mask);
  filter->SquaredDistanceOff();
  filter->UseImageSpacingOn();
  filter->InsideIsPositiveOff();
  filter->Update();
  return filter->GetOutput();
}

}  // namespace hexmesh
