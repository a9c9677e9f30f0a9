// SPDX-License-Identifier: Apache-2.0
#include "face_groups.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

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

class FacesInFile final : public SurfaceFaces {
public:
  FacesInFile(const std::filesystem::path& path, const Index3& extent) : file_(path, "lattice") {
    size_ = file_.shape(face_name, 2)[0];
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
    std::size_t sum = bytes_of(ranges_);
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
    }
    return faces;
  }

  Reader file_;
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

std::shared_ptr<const SurfaceFaces> open_faces(const std::filesystem::path& path, const Index3& extent) {
  return std::make_shared<const FacesInFile>(path, extent);
}

}  // namespace hexmesh::hdf5
