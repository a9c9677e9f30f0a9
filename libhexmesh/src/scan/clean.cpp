// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/scan/clean.h"

#include <fmt/format.h>
#include <itkConnectedComponentImageFilter.h>

#include <algorithm>
#include <cmath>

#include "hexmesh/core/error.h"
#include "segment_region.h"

namespace hexmesh {
namespace {

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
  const auto distances = distances_to(mask);
  const float* distance = distances->GetBufferPointer();
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

bool keep_component_at(LabelVolume& volume, const Vec3& place) {
  const std::uint16_t label = label_at(volume.grid, volume.labels, place);
  if (label == 0) return false;
  const Vec3 index = volume.grid.continuous_index(place).array().round();
  const Index3 voxel = {static_cast<int>(index[0]), static_cast<int>(index[1]), static_cast<int>(index[2])};
  for_each_segment(volume, {0, 0, 0}, [&](const Region& region) {
    const Parts parts = parts_of(region.mask);
    std::uint32_t kept = 0;
    for_each_voxel(region, volume.grid, [&](std::size_t n, std::size_t v) {
      if (v == volume.grid.offset(voxel)) kept = parts.of(n);
    });
    for_each_voxel(region, volume.grid, [&](std::size_t n, std::size_t) {
      region.mask->GetBufferPointer()[n] = kept != 0 && parts.of(n) == kept;
    });
  });
  return true;
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
