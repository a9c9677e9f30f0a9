// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "hexmesh/core/sha256.h"
#include "hexmesh/file/lattice_file.h"
#include "lattice_groups.h"

namespace hexmesh {
namespace {

/// Adds what a file holds in the order and in the form in which Writer notes it.
class Content {
public:
  explicit Content(const hdf5::Reader& file) : file_(file) {}

  template <class T>
  void add(const std::string& name, const hdf5::Shape& any) {
    add_values<T>(name, file_.read<T>(name, any));
  }
  template <class T>
  void add_attribute(const std::string& group, const std::string& name, std::size_t count) {
    add_values<T>(group + ":" + name, file_.attribute<T>(group, name, count));
  }
  void add_texts(const std::string& name) { add_padded(name, file_.read_strings(name)); }
  void add_text_attribute(const std::string& name) { add_padded("/:" + name, {file_.text_attribute("/", name)}); }

  /// Likewise of the matrices of a level, in its blocks.
  void add_matrices(int level, std::size_t num_elements) {
    const StoredMatrices none;
    for (std::size_t first = 0; first < num_elements; first += hdf5::matrix_block)
      for (const StoredMatrices::Set& set : none.sets())
        add_values<double>(hdf5::matrix_name(level, set.name),
                           hdf5::read_matrix_rows(file_, level, set, num_elements, first,
                                                  std::min(hdf5::matrix_block, num_elements - first)));
  }

  std::string digits() { return sum_.digits(); }

private:
  template <class T>
  void add_values(const std::string& name, const std::vector<T>& values) {
    sum_.add(name.c_str(), name.size() + 1);
    sum_.add(values.data(), sizeof(T) * values.size());
  }
  void add_padded(const std::string& name, const std::vector<std::string>& texts) {
    std::size_t size = 1;
    for (const std::string& text : texts) size = std::max(size, text.size());
    sum_.add(name.c_str(), name.size() + 1);
    for (const std::string& text : texts) {
      const std::string padded = text + std::string(size - text.size(), '\0');
      sum_.add(padded.data(), padded.size());
    }
  }

  const hdf5::Reader& file_;
  Sha256 sum_;
};

void add_level(const hdf5::Reader& file, int level, std::size_t num_materials, Content& content) {
  const std::string group = hdf5::level_group(level);
  content.add_attribute<std::int32_t>(group, "merge", 3);
  content.add_attribute<std::int32_t>(group, "voxels_per_cell", 3);
  content.add_attribute<double>(group, "mixture", 1);
  if (file.has_attribute(group, hdf5::gaps_name)) content.add_attribute<double>(group, hdf5::gaps_name, 3);
  content.add<std::uint16_t>(group + "/cells", {0, 3});
  if (file.has(group + "/split/corners")) {
    content.add<std::int64_t>(group + "/split/corners", {0});
    content.add<std::int32_t>(group + "/split/copies", {0});
  }
  if (file.has(group + "/split/voxels")) {
    content.add<std::int64_t>(group + "/split/voxels", {0});
    content.add<std::int32_t>(group + "/split/cells", {0});
  }
  content.add<std::int32_t>(group + "/element", {0});
  content.add<std::uint16_t>(group + "/segment", {0});
  content.add<std::uint16_t>(group + "/parts", {0});
  if (level > 0) content.add<std::int32_t>(hdf5::children_name(level), {0, 8});
  if (!hdf5::has_matrices(file, level)) return;
  if (file.has(hdf5::subcells_name(level))) content.add<SubcellMask>(hdf5::subcells_name(level), {0, 1});
  content.add_matrices(level, level > 0 ? file.shape(hdf5::children_name(level), 2)[0] : num_materials);
}

}  // namespace

bool is_as_written(const std::filesystem::path& path) {
  const hdf5::Reader file(path, "lattice");
  Content content(file);
  content.add_text_attribute("format");
  content.add_attribute<std::int32_t>("/", "version", 1);
  content.add_text_attribute("tool_version");
  content.add_texts("/history");
  if (file.has("/parting")) {
    content.add<std::uint16_t>("/parting/sliding", {0, 2});
    content.add_attribute<std::int32_t>("/parting", "gaps", 1);
  }
  content.add<std::uint16_t>("/voxels/labels", {0, 0, 0});
  for (const auto& [name, count] : {std::pair{"spacing", 3}, {"origin", 3}, {"direction", 9}})
    content.add_attribute<double>("/voxels", name, as_size(count));
  content.add_texts("/segments/name");
  content.add<std::uint16_t>("/segments/label", {0});
  content.add<double>("/segments/color", {0, 3});
  content.add<double>("/segments/material", {0, 3});
  content.add_texts("/segments/source");
  content.add<std::uint64_t>("/segments/num_voxels", {0});
  content.add_attribute<std::int32_t>("/surface", "of_voxels", 1);
  content.add<double>("/surface/points", {0, 3});
  content.add<std::int32_t>("/surface/triangles", {0, 3});
  content.add<std::uint16_t>("/surface/segment", {0});
  content.add<std::uint16_t>("/faces/face", {0, 5});
  content.add<std::uint16_t>("/faces/block", {0, 6});
  content.add<std::uint16_t>("/materials/label", {0});
  content.add<double>("/materials/value", {0, 3});
  for (int n = 0; n < hdf5::count_levels(file); ++n) add_level(file, n, file.shape("/materials/label", 1)[0], content);
  return content.digits() == content_checksum(path);
}

}  // namespace hexmesh
