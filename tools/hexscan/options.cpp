// SPDX-License-Identifier: Apache-2.0
#include "options.h"

#include <fmt/format.h>

#include <algorithm>

#include "hexmesh/core/error.h"

namespace hextools {

void note_segments(const hexmesh::LabelVolume& volume, const Console& console) {
  const std::vector<std::size_t> counts = hexmesh::count_voxels(volume);
  if (std::count(counts.begin(), counts.end(), 0U) == static_cast<std::ptrdiff_t>(counts.size()))
    console.warning("no voxel has a label");
  for (std::size_t s = 0; s < counts.size(); ++s)
    console.note(fmt::format("segment {} '{}': {} voxels, {:.1f} mL", volume.segments[s].label, volume.segments[s].name,
                             counts[s], static_cast<double>(counts[s]) * volume.grid.voxel_volume() / 1000));
}

Output* volume_if_named(const std::string& name, RunFiles& files) {
  return files.output_if_named(name, Content::binary, ".nrrd");
}

}  // namespace hextools
