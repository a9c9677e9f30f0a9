// SPDX-License-Identifier: Apache-2.0
#include "plain_dataset.h"

#include <algorithm>
#include <cstring>

namespace testing_support {
namespace {

constexpr H5Z_filter_t foreign_filter = 305;

std::size_t as_it_is(unsigned /*flags*/, std::size_t /*n*/, const unsigned* /*values*/, std::size_t bytes,
                     std::size_t* /*size*/, void** /*buffer*/) {
  return bytes;
}

hid_t layout_of(const Values& v, Keep keep) {
  const hid_t layout = H5Pcreate(H5P_DATASET_CREATE);
  const bool is_empty = std::find(v.shape.begin(), v.shape.end(), hsize_t{0}) != v.shape.end();
  if (keep == Keep::compact) H5Pset_layout(layout, H5D_COMPACT);
  if (keep == Keep::external) H5Pset_external(layout, "/etc/hostname", 0, H5F_UNLIMITED);
  if (is_empty || keep == Keep::contiguous || keep == Keep::compact || keep == Keep::external) return layout;
  Shape chunk = v.shape;
  chunk[0] = std::min<hsize_t>(chunk[0], std::max<hsize_t>((1 << 20) / std::max<std::size_t>(v.row_bytes(), 1), 1));
  H5Pset_chunk(layout, static_cast<int>(chunk.size()), chunk.data());
  H5Pset_shuffle(layout);
  H5Pset_deflate(layout, 9);
  if (keep == Keep::foreign) {
    static const H5Z_class2_t filter = {H5Z_CLASS_T_VERS, foreign_filter, 1, 1, "foreign", nullptr, nullptr, as_it_is};
    H5Zregister(&filter);
    H5Pset_filter(layout, foreign_filter, H5Z_FLAG_MANDATORY, 0, nullptr);
  }
  if (keep != Keep::without_checksum) H5Pset_fletcher32(layout);
  return layout;
}

}  // namespace

void Values::resize_rows(hsize_t rows) {
  if (shape[0] == 0) return;
  bytes.resize(row_bytes() * rows);
  shape[0] = rows;
}

void Values::set(std::size_t n, double value) {
  if (n >= count()) return;
  std::array<char, sizeof(value)> buffer{};
  std::memcpy(buffer.data(), &value, sizeof(value));
  H5Tconvert(H5T_NATIVE_DOUBLE, type, 1, buffer.data(), nullptr, H5P_DEFAULT);
  std::memcpy(&bytes[n * size_of_value()], buffer.data(), size_of_value());
}

double Values::get(std::size_t n) const {
  if (n >= count()) return 0;
  std::array<char, sizeof(double)> buffer{};
  std::memcpy(buffer.data(), &bytes[n * size_of_value()], size_of_value());
  H5Tconvert(type, H5T_NATIVE_DOUBLE, 1, buffer.data(), nullptr, H5P_DEFAULT);
  double value = 0;
  std::memcpy(&value, buffer.data(), sizeof(value));
  return value;
}

Values read(hid_t file, const std::string& name) {
  Values v;
  const hid_t set = H5Dopen2(file, name.c_str(), H5P_DEFAULT);
  if (set < 0) return v;
  const hid_t space = H5Dget_space(set);
  constexpr hssize_t most_values = 1 << 24;  // a claim is no dataset to change
  if (H5Sget_simple_extent_npoints(space) > most_values) {
    H5Sclose(space);
    H5Dclose(set);
    return v;
  }
  v.type = H5Dget_type(set);
  v.shape.resize(static_cast<std::size_t>(H5Sget_simple_extent_ndims(space)));
  H5Sget_simple_extent_dims(space, v.shape.data(), nullptr);
  v.bytes.resize(static_cast<std::size_t>(H5Sget_simple_extent_npoints(space)) * H5Tget_size(v.type));
  H5Dread(set, v.type, H5S_ALL, H5S_ALL, H5P_DEFAULT, v.bytes.data());
  H5Sclose(space);
  H5Dclose(set);
  return v;
}

void put(hid_t file, const std::string& name, const Values& v, Keep keep) {
  if (H5Lexists(file, name.c_str(), H5P_DEFAULT) > 0) H5Ldelete(file, name.c_str(), H5P_DEFAULT);
  const hid_t space = H5Screate_simple(static_cast<int>(v.shape.size()), v.shape.data(), nullptr);
  const hid_t layout = layout_of(v, keep);
  const hid_t set = H5Dcreate2(file, name.c_str(), v.type, space, H5P_DEFAULT, layout, H5P_DEFAULT);
  if (keep != Keep::external && !v.bytes.empty()) H5Dwrite(set, v.type, H5S_ALL, H5S_ALL, H5P_DEFAULT, v.bytes.data());
  H5Dclose(set);
  H5Pclose(layout);
  H5Sclose(space);
}

void put_claim(hid_t file, const std::string& name, Values v, hsize_t rows) {
  v.shape[0] = rows;
  v.bytes.clear();
  put(file, name, v);
}

void put_virtual(hid_t file, const std::string& name, const Values& v) {
  H5Ldelete(file, name.c_str(), H5P_DEFAULT);
  const hid_t space = H5Screate_simple(static_cast<int>(v.shape.size()), v.shape.data(), nullptr);
  const hid_t layout = H5Pcreate(H5P_DATASET_CREATE);
  H5Pset_virtual(layout, space, "elsewhere.h5", "/a", space);
  H5Dclose(H5Dcreate2(file, name.c_str(), v.type, space, H5P_DEFAULT, layout, H5P_DEFAULT));
  H5Pclose(layout);
  H5Sclose(space);
}

Values converted(Values v, hid_t type) {
  const std::size_t count = v.count(), size = std::max(H5Tget_size(type), v.size_of_value());
  v.bytes.resize(count * size);
  H5Tconvert(v.type, type, count, v.bytes.data(), nullptr, H5P_DEFAULT);
  v.type = type;
  v.bytes.resize(count * H5Tget_size(type));
  return v;
}

Values texts(const std::vector<std::string>& lines) {
  std::size_t size = 1;
  for (const std::string& line : lines) size = std::max(size, line.size());
  Values v;
  v.type = H5Tcopy(H5T_C_S1);
  H5Tset_size(v.type, size);
  H5Tset_cset(v.type, H5T_CSET_UTF8);
  H5Tset_strpad(v.type, H5T_STR_NULLPAD);
  v.shape = {lines.size()};
  for (std::string line : lines) {
    line.resize(size);
    v.bytes.insert(v.bytes.end(), line.begin(), line.end());
  }
  return v;
}

Content content_of(const std::filesystem::path& path) {
  Content out;
  const File file(path);
  H5Ovisit_by_name2(
      file.id, "/", H5_INDEX_NAME, H5_ITER_INC,
      [](hid_t root, const char* name, const auto* info, void* to) {
        Content& found = *static_cast<Content*>(to);
        const std::string object = std::string(name) == "." ? std::string("/") : std::string("/").append(name);
        if (info->type == H5O_TYPE_DATASET) found.datasets.push_back(object);
        const hid_t id = H5Oopen(root, name, H5P_DEFAULT);
        std::pair<Content*, const std::string*> here = {&found, &object};
        H5Aiterate2(
            id, H5_INDEX_NAME, H5_ITER_INC, nullptr,
            [](hid_t, const char* attribute, const H5A_info_t*, void* at) {
              const auto& [all, of] = *static_cast<std::pair<Content*, const std::string*>*>(at);
              all->attributes.push_back({*of, attribute});
              return 0;
            },
            &here);
        H5Oclose(id);
        return 0;
      },
      &out, H5O_INFO_BASIC, H5P_DEFAULT);
  return out;
}

}  // namespace testing_support
