// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/scan/clean.h"

#include <itkConnectedComponentImageFilter.h>
#include <itkImage.h>

#include <algorithm>

namespace hexmesh {

LabelVolume keep_largest_component(LabelVolume volume, std::vector<std::size_t>& removed) {
  using Mask = itk::Image<std::uint8_t, 3>;
  using Components = itk::Image<std::uint32_t, 3>;
  const Index3& n = volume.grid.extent();
  Mask::SizeType size;
  for (unsigned d = 0; d < 3; ++d) size[d] = static_cast<itk::SizeValueType>(n[d]);
  auto mask = Mask::New();
  mask->SetRegions(Mask::RegionType(size));
  mask->Allocate();

  removed.assign(volume.segments.size(), 0);
  for (std::size_t s = 0; s < volume.segments.size(); ++s) {
    const std::uint16_t label = volume.segments[s].label;
    std::transform(volume.labels.begin(), volume.labels.end(), mask->GetBufferPointer(),
                   [&](std::uint16_t v) { return static_cast<std::uint8_t>(v == label); });
    mask->Modified();
    auto filter = itk::ConnectedComponentImageFilter<Mask, Components>::New();
    filter->SetInput(mask);
    filter->SetFullyConnected(false);
    filter->Update();
    const std::uint32_t* part = filter->GetOutput()->GetBufferPointer();
    std::vector<std::size_t> sizes(filter->GetObjectCount() + 1);
    for (std::size_t v = 0; v < volume.labels.size(); ++v) ++sizes[part[v]];
    sizes[0] = 0;
    const auto largest = static_cast<std::uint32_t>(std::max_element(sizes.begin(), sizes.end()) - sizes.begin());
    for (std::size_t v = 0; v < volume.labels.size(); ++v)
      if (volume.labels[v] == label && part[v] != largest) {
        volume.labels[v] = 0;
        ++removed[s];
      }
  }
  return volume;
}

}  // namespace hexmesh
