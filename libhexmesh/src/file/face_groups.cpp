// SPDX-License-Identifier: Apache-2.0
#include "face_groups.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "../lattice/curve.h"
#include "cell_checks.h"

namespace hexmesh::hdf5 {
namespace {

constexpr const char* face_name = "/faces/face";
constexpr const char* block_name = "/faces/block";
constexpr hsize_t face_width = 5, block_width = 6;

bool is_within(const SurfaceFaces::Range& range, const Index3& voxel) {
  for (std::size_t d = 0; d < 3; ++d)
    if (voxel[d] < range.low[d] || voxel[d] > range.high[d]) return false;
  return true;
}

/// Where a lattice has material, as far as it is read: by voxels or else by cells of the finest level there is.
class MaterialMap {
public:
  explicit MaterialMap(const Lattice& lattice) : kinds_(kinds_of_labels(lattice.segments)) {
    const auto finest = std::find_if(lattice.levels.begin(), lattice.levels.end(),
                                     [](const Level& level) { return !level.cells.empty(); });
    if (finest != lattice.levels.end()) {
      voxels_per_cell_ = finest->voxels_per_cell;
      extent_ = coarser_extent(lattice.voxels.extent(), voxels_per_cell_);
      is_there_.resize(count_in(extent_));
      for (const Index3& c : finest->cells) is_there_[offset_in(extent_, c)] = true;
    } else if (!lattice.labels.empty()) {
      extent_ = lattice.voxels.extent();
      for (const std::uint16_t label : lattice.labels) is_there_.push_back(is_solid(label));
    }
  }

  /// @pre voxel is within the box
  bool at(const Index3& voxel) const {
    return is_there_.empty() || is_there_[offset_in(extent_, coarser_index(voxel, voxels_per_cell_))];
  }
  bool is_solid(std::uint16_t label) const { return kinds_[label] == LabelKind::with_material; }
  bool is_label(std::uint16_t label) const { return label == 0 || kinds_[label] != LabelKind::unknown; }
  std::size_t bytes() const { return bytes_of(kinds_) + is_there_.size() / 8; }

private:
  std::vector<LabelKind> kinds_;
  Index3 voxels_per_cell_ = {1, 1, 1}, extent_ = {0, 0, 0};
  std::vector<bool> is_there_;  ///< by cell of the box; empty: not known
};

class FacesInFile final : public SurfaceFaces {
public:
  FacesInFile(const std::filesystem::path& path, const Lattice& lattice) : file_(path, "lattice"), material_(lattice) {
    const Index3& extent = lattice.voxels.extent();
    size_ = file_.shape(face_name, 2)[0];
    // A body has an outside; no voxel has more than six faces.
    if (const std::size_t most = 6 * count_material(lattice.segments); size_ < 6 || size_ > most)
      file_.fail(fmt::format("has {} faces in '{}', expected 6 to {}", size_, face_name, most));
    const hsize_t num_blocks = (size_ + block_size - 1) / block_size;
    const auto values = file_.read<std::uint16_t>(block_name, {num_blocks, block_width});
    for (auto v = values.begin(); v != values.end(); v += block_width) {
      const Range range = {{v[0], v[1], v[2]}, {v[3], v[4], v[5]}};
      if (!is_in(extent, range.high) || !is_within(range, range.low))
        file_.fail(fmt::format("has block {} of '{}' beyond the voxels", ranges_.size(), block_name));
      ranges_.push_back(range);
    }
  }

  std::size_t bytes() const override {
    std::size_t sum = bytes_of(ranges_) + material_.bytes();
    for (const auto& [number, faces] : known_) sum += bytes_of(faces);
    return sum;
  }

private:
  void read_block(std::size_t number, std::vector<ExposedFace>& faces) const override {
    auto [entry, is_new] = known_.try_emplace(number);
    if (is_new) entry->second = read_rows(number);
    faces.insert(faces.end(), entry->second.begin(), entry->second.end());
  }

  std::vector<ExposedFace> read_rows(std::size_t number) const {
    const hsize_t first = number * block_size, count = std::min<hsize_t>(block_size, size_ - first);
    const auto values = file_.read_rows<std::uint16_t>(face_name, {0, face_width}, first, count);
    std::vector<ExposedFace> faces;
    for (auto v = values.begin(); v != values.end(); v += face_width) {
      faces.push_back({{v[0], v[1], v[2]}, static_cast<std::uint8_t>(v[3]), v[4]});
      if (v[3] >= 6 || !is_within(ranges_[number], faces.back().voxel))
        file_.fail(fmt::format("has a face in '{}' that is none of its block {}", face_name, number));
      check(faces);
    }
    return faces;
  }

  /// The last of some faces: there is material on its side and none beyond, and it comes after the one before.
  void check(const std::vector<ExposedFace>& faces) const {
    const ExposedFace& face = faces.back();
    const auto fail = [&](const std::string& what) {
      file_.fail(fmt::format("has a face in '{}' at voxel ({}, {}, {}), side {}, {}", face_name, face.voxel[0],
                             face.voxel[1], face.voxel[2], face.side, what));
    };
    if (!material_.at(face.voxel)) fail("where no cell is");
    if (material_.is_solid(face.neighbour) || !material_.is_label(face.neighbour))
      fail(fmt::format("with label {} behind it, expected 0 or that of a segment without material", face.neighbour));
    if (faces.size() > 1 && !along_curve(faces[faces.size() - 2], face)) fail("twice or out of order");
  }

  Reader file_;
  MaterialMap material_;
  mutable std::map<std::size_t, std::vector<ExposedFace>> known_;  ///< blocks read so far
};

}  // namespace

void write_faces(Writer& file, const SurfaceFaces& all) {
  const FacesInMemory faces(all.all());
  std::vector<std::uint16_t> values;
  const auto add = [&](const Index3& index) {
    for (const std::int32_t i : index) values.push_back(static_cast<std::uint16_t>(i));
  };
  for (const ExposedFace& face : faces.in_order()) {
    add(face.voxel);
    values.push_back(face.side);
    values.push_back(face.neighbour);
  }
  file.write<std::uint16_t>(face_name, values, {faces.size(), face_width}, true, SurfaceFaces::block_size);
  values.clear();
  for (const SurfaceFaces::Range& range : faces.ranges()) {
    add(range.low);
    add(range.high);
  }
  file.write<std::uint16_t>(block_name, values, {faces.ranges().size(), block_width});
}

std::shared_ptr<const SurfaceFaces> open_faces(const std::filesystem::path& path, const Lattice& lattice) {
  return std::make_shared<const FacesInFile>(path, lattice);
}

}  // namespace hexmesh::hdf5
