// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/lattice/surface_faces.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "curve.h"
#include "hexmesh/core/index.h"
#include "hexmesh/lattice/lattice.h"

namespace hexmesh {
namespace {

/// Bits 0 to 15 moved to bits 0, 3, 6, ...
std::uint64_t spread(std::int32_t index) {
  std::uint64_t bits = static_cast<std::uint64_t>(index) & 0xffff;
  bits = (bits | bits << 16) & 0x0000ff0000ff;
  bits = (bits | bits << 8) & 0x00f00f00f00f;
  bits = (bits | bits << 4) & 0x0c30c30c30c3;
  return (bits | bits << 2) & 0x249249249249;
}

/// The place of a voxel on a space-filling curve (Morton, 1966): voxels with near places are near in space.
std::uint64_t place_on_curve(const Index3& voxel) {
  return spread(voxel[0]) | spread(voxel[1]) << 1 | spread(voxel[2]) << 2;
}

/// Indices are below 2^16, so that six times their key fits.
void sort_by_voxel(std::vector<ExposedFace>& faces) {
  std::vector<std::pair<std::uint64_t, std::size_t>> keys;
  for (const ExposedFace& face : faces) keys.emplace_back(6 * sort_key(face.voxel) + face.side, keys.size());
  std::sort(keys.begin(), keys.end());
  std::vector<ExposedFace> sorted;
  sorted.reserve(faces.size());
  for (const auto& [key, number] : keys) sorted.push_back(faces[number]);
  faces = std::move(sorted);
}

SurfaceFaces::Ball ball_around(const SurfaceFaces::Range& range, const Grid& voxels) {
  const Vec3 low(range.low[0], range.low[1], range.low[2]), high(range.high[0], range.high[1], range.high[2]);
  const Vec3 half = (0.5 * (high - low) + Vec3::Constant(0.5)).cwiseProduct(voxels.spacing());
  return {voxels.position(0.5 * (low + high)), half.norm()};
}

}  // namespace

bool by_voxel(const ExposedFace& a, const ExposedFace& b) {
  return a.voxel == b.voxel ? a.side < b.side : i_fastest(a.voxel, b.voxel);
}

bool along_curve(const ExposedFace& a, const ExposedFace& b) {
  return a.voxel == b.voxel ? a.side < b.side : place_on_curve(a.voxel) < place_on_curve(b.voxel);
}

Vec3 face_index(const ExposedFace& face) {
  Vec3 index(face.voxel[0], face.voxel[1], face.voxel[2]);
  index[face.side / 2] += face.side % 2 ? 0.5 : -0.5;
  return index;
}

std::vector<ExposedFace> SurfaceFaces::find(const Grid& voxels,
                                            const std::function<bool(const Ball&)>& may_count) const {
  std::vector<ExposedFace> faces, block;
  for (std::size_t n = 0; n < ranges_.size(); ++n) {
    if (!may_count(ball_around(ranges_[n], voxels))) continue;
    block.clear();
    read_block(n, block);
    std::copy_if(block.begin(), block.end(), std::back_inserter(faces), [&](const ExposedFace& face) {
      return may_count(ball_around({face.voxel, face.voxel}, voxels));
    });
  }
  sort_by_voxel(faces);
  return faces;
}

std::vector<ExposedFace> SurfaceFaces::all() const {
  std::vector<ExposedFace> faces;
  for (std::size_t n = 0; n < ranges_.size(); ++n) read_block(n, faces);
  sort_by_voxel(faces);
  return faces;
}

FacesInMemory::FacesInMemory(std::vector<ExposedFace> faces) : faces_(std::move(faces)) {
  size_ = faces_.size();
  std::vector<std::pair<std::uint64_t, ExposedFace>> placed;
  placed.reserve(faces_.size());
  for (const ExposedFace& face : faces_) placed.emplace_back(place_on_curve(face.voxel), face);
  std::sort(placed.begin(), placed.end(), [](const auto& a, const auto& b) {
    return a.first == b.first ? a.second.side < b.second.side : a.first < b.first;
  });
  for (std::size_t n = 0; n < faces_.size(); ++n) {
    const ExposedFace& face = faces_[n] = placed[n].second;
    if (n % block_size == 0) ranges_.push_back({face.voxel, face.voxel});
    for (std::size_t d = 0; d < 3; ++d) {
      ranges_.back().low[d] = std::min(ranges_.back().low[d], face.voxel[d]);
      ranges_.back().high[d] = std::max(ranges_.back().high[d], face.voxel[d]);
    }
  }
}

void FacesInMemory::read_block(std::size_t number, std::vector<ExposedFace>& faces) const {
  const auto begin = faces_.begin() + static_cast<std::ptrdiff_t>(number * block_size);
  faces.insert(faces.end(), begin, std::min(begin + block_size, faces_.end()));
}

std::vector<ExposedFace> faces_between(const Lattice& lattice, const std::vector<bool>& of,
                                       const std::vector<bool>& towards) {
  const Index3& extent = lattice.voxels.extent();
  const std::array<std::size_t, 3> stride = strides_in(extent);
  std::vector<ExposedFace> faces;
  std::size_t n = 0;
  Index3 voxel;
  for (voxel[2] = 0; voxel[2] < extent[2]; ++voxel[2])
    for (voxel[1] = 0; voxel[1] < extent[1]; ++voxel[1])
      for (voxel[0] = 0; voxel[0] < extent[0]; ++voxel[0], ++n) {
        if (!of[lattice.labels[n]]) continue;
        for (std::size_t side = 0; side < 6; ++side) {
          const std::size_t axis = side / 2;
          const bool is_upper = side % 2 != 0;
          const bool at_border = voxel[axis] == (is_upper ? extent[axis] - 1 : 0);
          const std::uint16_t beside =
              at_border ? std::uint16_t{0} : lattice.labels[is_upper ? n + stride[axis] : n - stride[axis]];
          if (towards[beside]) faces.push_back({voxel, static_cast<std::uint8_t>(side), beside});
        }
      }
  return faces;
}

}  // namespace hexmesh
