// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <hdf5.h>

#include <array>
#include <cstddef>
#include <filesystem>
#include <string>
#include <vector>

/// Datasets of an HDF5 file as plain bytes, to put others in their place: by the HDF5 library alone.
namespace testing_support {

using Shape = std::vector<hsize_t>;

/// How a dataset is kept.
enum class Keep { as_ours, contiguous, compact, without_checksum, foreign, external };

/// A file that is open for changes.
struct File {
  explicit File(const std::filesystem::path& path) : id(H5Fopen(path.c_str(), H5F_ACC_RDWR, H5P_DEFAULT)) {
    H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);  // what lies leave behind is not always there for the next one
  }
  ~File() { H5Fclose(id); }
  File(const File&) = delete;
  File& operator=(const File&) = delete;
  hid_t id;
};

/// A dataset in memory, of the type that the file has.
struct Values {
  hid_t type = -1;  ///< never closed: there are few
  Shape shape;
  std::vector<char> bytes;

  std::size_t size_of_value() const { return H5Tget_size(type); }
  std::size_t count() const { return size_of_value() == 0 ? 0 : bytes.size() / size_of_value(); }
  std::size_t row_bytes() const { return shape[0] == 0 ? 0 : bytes.size() / shape[0]; }
  bool is_float() const { return H5Tget_class(type) == H5T_FLOAT; }
  bool is_text() const { return H5Tget_class(type) == H5T_STRING; }
  void resize_rows(hsize_t rows);

  /// Only of numbers; nothing beyond the last one.
  void set(std::size_t n, double value);
  double get(std::size_t n) const;
};

/// Nothing, of no type, where there is no such dataset or one that is too large.
Values read(hid_t file, const std::string& name);

/// In place of what has that name.
void put(hid_t file, const std::string& name, const Values& values, Keep keep = Keep::as_ours);

/// A claim of so many rows, of which none is there.
void put_claim(hid_t file, const std::string& name, Values values, hsize_t rows);

/// As a part of a dataset of another file.
void put_virtual(hid_t file, const std::string& name, const Values& values);

Values converted(Values values, hid_t type);
Values texts(const std::vector<std::string>& lines);

/// An attribute's place.
struct Attribute {
  std::string object, name;
};

/// Paths of all datasets and all attributes of a file.
struct Content {
  std::vector<std::string> datasets;
  std::vector<Attribute> attributes;
};
Content content_of(const std::filesystem::path& path);

}  // namespace testing_support
