// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/scan/clean.h"

#include <fmt/format.h>
#include <itkConnectedComponentImageFilter.h>
#include <itkImage.h>
#include <itkSignedMaurerDistanceMapImageFilter.h>

#include <algorithm>
#include <cmath>

#include "hexmesh/core/error.h"

namespace hexmesh {
namespace {

using Mask = itk::Image<std::uint8_t, 3>;

/// The box of one label with room around it, as an image of its own.
struct Region {
  Index3 low, extent;  ///< low may lie outside the volume
  Mask::Pointer mask;  ///< 1 where the label is
};

/// @param margin  voxels of room on each side
/// @returns an extent of 0 where the label does not occur
Region region_of(const LabelVolume& volume, std::uint16_t label, const Index3& margin) {
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

/// The connected parts of what is 1, numbered from 1.
struct Parts {
  itk::Image<std::uint32_t, 3>::Pointer image;
  std::vector<std::size_t> sizes;  ///< by number; of 0: 0
  std::uint32_t of(std::size_t n) const { return image->GetBufferPointer()[n]; }
};

Parts parts_of(Mask* mask) {
  auto filter = itk::ConnectedComponentImageFilter<Mask, itk::Image<std::uint32_t, 3>>::New();
  filter->SetInput(mask);
  filter->SetFullyConnected(false);
  filter->Update();
  Parts out{filter->GetOutput(), std::vector<std::size_t>(filter->GetObjectCount() + 1)};
  const std::size_t count = mask->GetLargestPossibleRegion().GetNumberOfPixels();
  for (std::size_t n = 0; n < count; ++n) ++out.sizes[out.of(n)];
  out.sizes[0] = 0;
  return out;
}

/// Runs `step(region, label, s)` for each segment that occurs; the mask holds its voxels.
template <class Step>
Cleaning for_each_segment(LabelVolume& volume, const Index3& margin, Step&& step) {
  Cleaning out{std::vector<std::size_t>(volume.segments.size()), std::vector<std::size_t>(volume.segments.size())};
  for (std::size_t s = 0; s < volume.segments.size(); ++s) {
    const std::uint16_t label = volume.segments[s].label;
    const Region region = region_of(volume, label, margin);
    if (!region.mask) continue;
    std::uint8_t* mask = region.mask->GetBufferPointer();
    for_each_voxel(region, volume.grid, [&](std::size_t n, std::size_t v) { mask[n] = volume.labels[v] == label; });
    try {
      step(region);
    } catch (const itk::MemoryAllocationError&) {
      throw std::bad_alloc();
    } catch (const itk::ExceptionObject& e) {
      throw Error(ErrorKind::usage, fmt::format("segment '{}' cannot be cleaned: {}, expected a smaller radius",
                                                volume.segments[s].name, e.GetDescription()));
    }
    // What the step left in the mask is the segment now.
    for_each_voxel(region, volume.grid, [&](std::size_t n, std::size_t v) {
      std::uint16_t& now = volume.labels[v];
      if (mask[n] != 0 && now == 0) {
        now = label;
        ++out.added[s];
      } else if (mask[n] == 0 && now == label) {
        now = 0;
        ++out.removed[s];
      }
    });
  }
  return out;
}

/// Voxels within `radius` of one that is `value` become `value`.
void grow(Mask* mask, std::uint8_t value, double radius) {
  const std::size_t count = mask->GetLargestPossibleRegion().GetNumberOfPixels();
  std::uint8_t* voxels = mask->GetBufferPointer();
  if (value == 0)
    for (std::size_t n = 0; n < count; ++n) voxels[n] = !voxels[n];
  mask->Modified();
  auto filter = itk::SignedMaurerDistanceMapImageFilter<Mask, itk::Image<float, 3>>::New();
  filter->SetInput(mask);
  filter->SquaredDistanceOff();
  filter->UseImageSpacingOn();
  filter->InsideIsPositiveOff();
  filter->Update();
  // Outside, this is the distance to the nearest voxel centre of the object.
  const float* distance = filter->GetOutput()->GetBufferPointer();
  const auto reach = static_cast<float>(radius * (1 + 1e-6));
  for (std::size_t n = 0; n < count; ++n) {
    const bool grown = voxels[n] != 0 || distance[n] <= reach;
    voxels[n] = value == 1 ? grown : !grown;
  }
  mask->Modified();
}

/// Room for a ball around the segment, so that what lies beyond the volume counts as background.
Index3 room_for(const LabelVolume& volume, double radius) {
  Index3 margin;
  for (std::size_t d = 0; d < 3; ++d)
    margin[d] = 2 + static_cast<std::int32_t>(std::ceil(radius / volume.grid.spacing()[d]));
  return margin;
}

}  // namespace

Cleaning keep_largest_component(LabelVolume& volume) {
  return for_each_segment(volume, {0, 0, 0}, [&](const Region& region) {
    const Parts parts = parts_of(region.mask);
    const auto largest =
        static_cast<std::uint32_t>(std::max_element(parts.sizes.begin(), parts.sizes.end()) - parts.sizes.begin());
    for_each_voxel(region, volume.grid,
                   [&](std::size_t n, std::size_t) { region.mask->GetBufferPointer()[n] = parts.of(n) == largest; });
  });
}

Cleaning remove_specks(LabelVolume& volume, double volume_ml) {
  const double least = volume_ml * 1000 / volume.grid.voxel_volume();
  return for_each_segment(volume, {0, 0, 0}, [&](const Region& region) {
    const Parts parts = parts_of(region.mask);
    for_each_voxel(region, volume.grid, [&](std::size_t n, std::size_t) {
      region.mask->GetBufferPointer()[n] = parts.of(n) != 0 && static_cast<double>(parts.sizes[parts.of(n)]) >= least;
    });
  });
}

Cleaning fill_cavities(LabelVolume& volume) {
  return for_each_segment(volume, {1, 1, 1}, [&](const Region& region) {
    std::uint8_t* mask = region.mask->GetBufferPointer();
    const std::size_t count = region.mask->GetLargestPossibleRegion().GetNumberOfPixels();
    for (std::size_t n = 0; n < count; ++n) mask[n] = !mask[n];
    region.mask->Modified();
    const Parts parts = parts_of(region.mask);
    const std::uint32_t outside = parts.of(0);  // the room around the segment is one part
    for (std::size_t n = 0; n < count; ++n) mask[n] = parts.of(n) != outside;
  });
}

Cleaning open_segments(LabelVolume& volume, double radius) {
  return for_each_segment(volume, room_for(volume, radius), [&](const Region& region) {
    grow(region.mask, 0, radius);
    grow(region.mask, 1, radius);
  });
}

Cleaning close_segments(LabelVolume& volume, double radius) {
  return for_each_segment(volume, room_for(volume, radius), [&](const Region& region) {
    grow(region.mask, 1, radius);
    grow(region.mask, 0, radius);
  });
}

}  // namespace hexmesh
