// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "hexmesh/core/bytes.h"
#include "hexmesh/core/grid.h"

namespace hexmesh {

/// The outer face of a material voxel, towards background or a segment without material.
struct ExposedFace {
  Index3 voxel = {0, 0, 0};
  std::uint8_t side = 0;        ///< 2 d for the lower, 2 d + 1 for the upper face along axis d
  std::uint16_t neighbour = 0;  ///< label behind the face; 0 = background

  bool operator==(const ExposedFace&) const = default;
};

/// The order of the voxels, i fastest, then of the sides.
bool by_voxel(const ExposedFace& a, const ExposedFace& b);

/// Centre of a face as a continuous voxel index.
Vec3 face_index(const ExposedFace& face);

/// All exposed faces of a body, in blocks that are compact in space: who needs those of a patch looks at the blocks
/// near it. Blocks are the same at every level.
class SurfaceFaces {
public:
  static constexpr std::size_t block_size = 2048;  ///< faces; the last block may have fewer

  /// Voxels from `low` to `high`, both included.
  struct Range {
    Index3 low, high;
    bool operator==(const Range&) const = default;
  };
  /// A ball around the voxels of a block, or of one face [mm].
  struct Ball {
    Vec3 center;
    double radius = 0;
  };

  virtual ~SurfaceFaces() = default;

  std::size_t size() const noexcept { return size_; }

  virtual std::size_t bytes() const = 0;  ///< memory that it takes

  /// The faces whose balls may_count(), in the order of the voxels; only blocks whose balls do are read.
  std::vector<ExposedFace> find(const Grid& voxels, const std::function<bool(const Ball&)>& may_count) const;

  /// All of them, likewise.
  std::vector<ExposedFace> all() const;

protected:
  SurfaceFaces() = default;
  SurfaceFaces(const SurfaceFaces&) = default;
  SurfaceFaces& operator=(const SurfaceFaces&) = default;

  std::size_t size_ = 0;
  std::vector<Range> ranges_;  ///< of the voxels of each block

private:
  /// Appends the faces of a block.
  virtual void read_block(std::size_t number, std::vector<ExposedFace>& faces) const = 0;
};

/// Likewise in memory.
class FacesInMemory : public SurfaceFaces {
public:
  /// @param faces  of any order
  explicit FacesInMemory(std::vector<ExposedFace> faces);

  const std::vector<ExposedFace>& in_order() const noexcept { return faces_; }  ///< block after block
  const std::vector<Range>& ranges() const noexcept { return ranges_; }
  std::size_t bytes() const override { return bytes_of(faces_) + bytes_of(ranges_); }

private:
  void read_block(std::size_t number, std::vector<ExposedFace>& faces) const override;
  std::vector<ExposedFace> faces_;
};

}  // namespace hexmesh
