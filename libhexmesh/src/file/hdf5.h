// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <hdf5.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <mutex>
#include <numeric>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "hexmesh/core/sha256.h"

namespace hexmesh::hdf5 {

using Shape = std::vector<hsize_t>;

/// HDF5 as most systems have it serves one thread at a time: whoever calls it holds one of these meanwhile.
class Lock {
public:
  Lock() : held_(library()) {}

private:
  static std::recursive_mutex& library();

  std::scoped_lock<std::recursive_mutex> held_;
};

/// Owns one HDF5 identifier.
class Handle {
public:
  using Close = herr_t (*)(hid_t);
  Handle(hid_t id, Close how) : id_(id), close_(how) {}
  ~Handle() { close(); }
  Handle(Handle&& other) noexcept : id_(std::exchange(other.id_, -1)), close_(other.close_) {}
  Handle& operator=(Handle&&) = delete;
  operator hid_t() const { return id_; }

  /// Before its end, to know whether that goes well.
  bool close() {
    if (id_ < 0) return true;
    const Lock lock;
    return close_(std::exchange(id_, -1)) >= 0;
  }

private:
  hid_t id_;
  Close close_;
};

/// Texts of fixed length: unlike those of variable length they lie in chunks and headers, which have checksums.
Handle string_type(std::size_t size, H5T_cset_t characters = H5T_CSET_UTF8);

/// The rows of a dataset as a part of its space.
/// @param shape  receives theirs
Handle rows_of(hid_t set, hsize_t first, hsize_t count, Shape& shape);

template <class T>
hid_t native_type();
template <>
inline hid_t native_type<double>() {
  return H5T_NATIVE_DOUBLE;
}
template <>
inline hid_t native_type<float>() {
  return H5T_NATIVE_FLOAT;
}
template <>
inline hid_t native_type<std::int32_t>() {
  return H5T_NATIVE_INT32;
}
template <>
inline hid_t native_type<std::uint16_t>() {
  return H5T_NATIVE_UINT16;
}
template <>
inline hid_t native_type<std::uint8_t>() {
  return H5T_NATIVE_UINT8;
}
template <>
inline hid_t native_type<std::int64_t>() {
  return H5T_NATIVE_INT64;
}
template <>
inline hid_t native_type<std::uint64_t>() {
  return H5T_NATIVE_UINT64;
}

class Reader;

/// Writes a file. Datasets carry a Fletcher32 checksum per chunk; no object says when it was made, so that the same
/// content is the same bytes. Names are paths; their groups are made as needed. Texts become UTF-8. As with Reader,
/// each is one thread's, and threads may have their own.
class Writer {
public:
  /// The second goes on with a file that an earlier one has closed; the third is read by HDF5 1.8 too.
  enum class Start { anew, as_it_is, anew_for_all };

  /// @throws Error{output}
  explicit Writer(const std::filesystem::path& path, Start start = Start::anew);

  /// @param chunk_rows  rows that are read as one; 0: about a megabyte
  template <class T>
  void write(const std::string& name, std::span<const T> values, const Shape& shape, bool compress = false,
             hsize_t chunk_rows = 0) {
    const Lock lock;
    write_raw(name, native_type<T>(), values.data(), shape, sizeof(T), {compress, chunk_rows});
  }
  void write(const std::string& name, const std::vector<std::string>& values);
  /// One text of variable length, which has no checksum: some readers take nothing else.
  void variable_text(const std::string& name, const std::string& text);

  /// A dataset whose rows, along its first axis, come later by write_rows().
  template <class T>
  void declare(const std::string& name, const Shape& shape, bool compress = false) {
    const Lock lock;
    declare_raw(name, native_type<T>(), shape, sizeof(T), {compress, 0});
  }
  /// Rows `first` to `first` + `count` - 1 of a dataset that is there.
  template <class T>
  void write_rows(const std::string& name, std::span<const T> values, hsize_t first, hsize_t count) {
    const Lock lock;
    write_rows_raw(name, native_type<T>(), values.data(), first, count);
  }

  /// A dataset as it is in another file: it takes no memory. @throws Error{input} as Reader does
  void copy(const Reader& from, const std::string& name);

  template <class T>
  void attribute(const std::string& group, const std::string& name, std::span<const T> values) {
    const Lock lock;
    attribute_raw(group, name, native_type<T>(), values.data(), values.size());
  }
  void attribute(const std::string& group, const std::string& name, const std::string& text);
  /// Text of ASCII characters, told to be no more than that: some readers take nothing else.
  void ascii_attribute(const std::string& group, const std::string& name, const std::string& text);

  /// From here on note what is written, in the order in which it is.
  void begin_checksum();
  /// SHA-256 of the names and values of all datasets and attributes since then.
  std::string checksum() { return noted_->digits(); }

  /// Flush and close. @throws Error{output}
  void close();

private:
  struct Storage {
    bool compress = false;
    hsize_t chunk_rows = 0;
  };
  void write_raw(const std::string& name, hid_t type, const void* data, const Shape& shape, std::size_t value_size,
                 const Storage& storage);
  Handle declare_raw(const std::string& name, hid_t type, const Shape& shape, std::size_t value_size,
                     const Storage& storage);
  void note(const std::string& name, hid_t type, const void* data, hsize_t count);
  void write_rows_raw(const std::string& name, hid_t type, const void* data, hsize_t first, hsize_t count);
  void attribute_raw(const std::string& group, const std::string& name, hid_t type, const void* data,
                     std::size_t count);
  void make_groups(const std::string& path);
  void check(bool good, const std::string& name, std::string why = {}) const;

  std::filesystem::path path_;
  Handle file_;
  std::unique_ptr<Sha256> noted_;  ///< none if nothing is noted
};

/// Reads a file; whatever is missing, of another shape or type, kept against the rules of hdf5_rules.h, or damaged is
/// an Error{input} that names file and dataset.
class Reader {
public:
  /// @param what  named in messages, e.g. "lattice"
  Reader(const std::filesystem::path& path, std::string what);

  bool has(const std::string& name) const;

  /// Shape of a dataset, which has as many values. @throws unless it has that many axes
  Shape shape(const std::string& name, std::size_t rank) const;

  /// @param expected  0 in an axis: any size
  template <class T>
  std::vector<T> read(const std::string& name, const Shape& expected) const {
    const Lock lock;
    const Dataset set = open_numbers(name, expected, native_type<T>(), sizeof(T));
    expect_room(set, set.count() * sizeof(T));
    std::vector<T> values(set.count());
    read_raw(set, native_type<T>(), values.data());
    return values;
  }
  /// Likewise only rows `first` to `first` + `count` - 1 along the first axis.
  template <class T>
  std::vector<T> read_rows(const std::string& name, const Shape& expected, hsize_t first, hsize_t count) const {
    const Lock lock;
    Dataset set = open_numbers(name, expected, native_type<T>(), sizeof(T));
    return rows_of<T>(set, first, count);
  }
  /// All rows, some at a time: take(values, first row). What is wrong with the first rows is told before the last ones
  /// take memory.
  template <class T, class Take>
  void read_in_blocks(const std::string& name, const Shape& expected, hsize_t block_rows, const Take& take) const {
    const Lock lock;
    const Dataset set = open_numbers(name, expected, native_type<T>(), sizeof(T));
    for (hsize_t first = 0; first < set.shape[0]; first += block_rows)
      take(rows_of<T>(set, first, std::min(block_rows, set.shape[0] - first)), first);
  }
  std::vector<std::string> read_strings(const std::string& name) const;

  template <class T>
  std::vector<T> attribute(const std::string& group, const std::string& name, std::size_t count) const {
    const Lock lock;
    std::vector<T> values(count);
    attribute_raw(group, name, native_type<T>(), values.data(), count);
    return values;
  }
  std::string text_attribute(const std::string& group, const std::string& name) const;
  bool has_attribute(const std::string& group, const std::string& name) const;

  /// How many links a group holds. @pre has(group)
  std::size_t count_links(const std::string& group) const;

  /// All datasets, sorted: their paths.
  std::vector<std::string> dataset_names() const;
  bool is_text(const std::string& name) const;
  /// Numbers of any type, and their shape.
  std::vector<double> read_any_numbers(const std::string& name, Shape& shape) const;

  /// @throws Error{input} with the file's name before the message
  [[noreturn]] void fail(const std::string& message) const;

private:
  friend class Writer;  // copies
  /// A dataset that keeps the rules.
  struct Dataset {
    std::string name;
    Handle id;
    Shape shape;
    std::size_t count() const {
      return std::accumulate(shape.begin(), shape.end(), std::size_t{1}, std::multiplies<>());
    }
  };
  Dataset open(const std::string& name, const Shape& expected) const;
  Dataset open_numbers(const std::string& name, const Shape& expected, hid_t type, std::size_t value_size) const;
  void check_storage(const Dataset& set, std::size_t value_size) const;
  void expect_room(const Dataset& set, std::size_t bytes) const;  ///< see core/memory.h
  template <class T>
  std::vector<T> rows_of(const Dataset& set, hsize_t first, hsize_t count) const {
    if (first + count > set.shape[0]) fail_rows(set.name, first, count, set.shape[0]);
    const std::size_t num_values = set.shape[0] == 0 ? 0 : set.count() / set.shape[0] * count;
    expect_room(set, num_values * sizeof(T));
    std::vector<T> values(num_values);
    if (!values.empty()) read_rows_raw(set, native_type<T>(), values.data(), first, count);
    return values;
  }
  std::size_t text_size(hid_t type, const std::string& name) const;
  void check_text(const std::string& text, const std::string& name) const;
  void read_raw(const Dataset& set, hid_t type, void* data) const;
  void read_rows_raw(const Dataset& set, hid_t type, void* data, hsize_t first, hsize_t count) const;
  [[noreturn]] void fail_rows(const std::string& name, hsize_t first, hsize_t count, hsize_t found) const;
  Handle open_attribute(const std::string& group, const std::string& name) const;
  void attribute_raw(const std::string& group, const std::string& name, hid_t type, void* data,
                     std::size_t count) const;

  std::string what_;
  std::filesystem::path path_;
  Handle file_;
  mutable std::set<std::string> kept_well_;  ///< datasets whose storage has been checked
};

}  // namespace hexmesh::hdf5
