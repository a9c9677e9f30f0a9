// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/lattice/segment_shares.h"

namespace hexmesh {
namespace {

/// Over the voxels of an element, a voxel's volume counting as one.
struct Sums {
  SegmentShare of_segment, whole;
};

}  // namespace

std::vector<SegmentShare> shares_of_segment(const Lattice& lattice, int level, std::uint16_t label) {
  std::vector<Sums> sums;
  for (const VoxelMaterial& m : lattice.materials) {
    const SegmentShare voxel{1, m.material.shear_modulus()};
    sums.push_back({m.label == label ? voxel : SegmentShare{}, voxel});
  }
  const auto add = [](const SegmentShare& part, SegmentShare& to) {
    to.volume += part.volume;
    to.shear += part.shear;
  };
  for (int l = 1; l <= level; ++l) {
    const std::vector<Sums> finer = std::move(sums);
    sums.assign(lattice.level(l).children.size(), {});
    for (std::size_t e = 0; e < sums.size(); ++e)
      for (const std::int32_t child : lattice.level(l).children[e]) {
        if (child < 0) continue;
        add(finer[as_size(child)].of_segment, sums[e].of_segment);
        add(finer[as_size(child)].whole, sums[e].whole);
      }
  }
  std::vector<SegmentShare> shares;
  for (const Sums& s : sums)
    shares.push_back({s.of_segment.volume / s.whole.volume, s.of_segment.shear / s.whole.shear});
  return shares;
}

}  // namespace hexmesh
