// SPDX-License-Identifier: Apache-2.0
#include "hdf5.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sys/resource.h>
#include <sys/statvfs.h>

#include <algorithm>

#include "hexmesh/core/error.h"
#include "refuse.h"

namespace hexmesh::hdf5 {
namespace {

constexpr hsize_t chunk_bytes = 1 << 20;
constexpr std::size_t most_values = std::size_t{1} << 36;

/// Texts of fixed length: unlike those of variable length they lie in chunks and headers, which have checksums.
Handle string_type(std::size_t size) {
  Handle type(H5Tcopy(H5T_C_S1), H5Tclose);
  H5Tset_size(type, size);
  H5Tset_cset(type, H5T_CSET_UTF8);
  H5Tset_strpad(type, H5T_STR_NULLPAD);
  return type;
}

constexpr std::size_t most_text_bytes = std::size_t{1} << 24;

Handle open_for_reading(const std::filesystem::path& path) {
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  return {H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose};
}

Handle open_for_writing(const std::filesystem::path& path, Writer::Start start) {
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  // The 1.10 layout has checksums in its indices and headers too.
  const Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  H5Pset_libver_bounds(access, H5F_LIBVER_V110, H5F_LIBVER_V110);
  return {start == Writer::Start::anew ? H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, access)
                                       : H5Fopen(path.c_str(), H5F_ACC_RDWR, access),
          H5Fclose};
}

Handle make_groups() {
  Handle list(H5Pcreate(H5P_LINK_CREATE), H5Pclose);
  H5Pset_create_intermediate_group(list, 1);
  return list;
}

/// The rows of a dataset as a part of its space.
Handle rows_of(hid_t set, hsize_t first, hsize_t count, Shape& shape) {
  Handle space(H5Dget_space(set), H5Sclose);
  shape.resize(static_cast<std::size_t>(std::max(H5Sget_simple_extent_ndims(space), 1)));
  H5Sget_simple_extent_dims(space, shape.data(), nullptr);
  Shape begin(shape.size());
  begin[0] = first;
  shape[0] = count;
  H5Sselect_hyperslab(space, H5S_SELECT_SET, begin.data(), nullptr, shape.data(), nullptr);
  return space;
}

}  // namespace

Writer::Writer(const std::filesystem::path& path, Start start) : path_(path), file_(open_for_writing(path, start)) {
  check(file_ >= 0, "file");
}

void Writer::check(bool good, const std::string& name) const {
  if (!good) throw Error(ErrorKind::output, fmt::format("cannot write '{}' into '{}'", name, path_.string()));
}

Handle Writer::declare_raw(const std::string& name, hid_t type, const Shape& shape, std::size_t value_size,
                           const Storage& storage) {
  const Handle space(H5Screate_simple(static_cast<int>(shape.size()), shape.data(), nullptr), H5Sclose);
  const Handle layout(H5Pcreate(H5P_DATASET_CREATE), H5Pclose);
  const hsize_t row = std::accumulate(shape.begin() + 1, shape.end(), hsize_t{1}, std::multiplies<>());
  if (shape[0] > 0 && row > 0) {
    Shape chunk = shape;
    const hsize_t rows = storage.chunk_rows > 0 ? storage.chunk_rows : chunk_bytes / (row * value_size);
    chunk[0] = std::clamp<hsize_t>(rows, 1, shape[0]);
    H5Pset_chunk(layout, static_cast<int>(chunk.size()), chunk.data());
    if (storage.compress) {
      H5Pset_shuffle(layout);
      H5Pset_deflate(layout, 1);
    }
    H5Pset_fletcher32(layout);
  }
  Handle set(H5Dcreate2(file_, name.c_str(), type, space, make_groups(), layout, H5P_DEFAULT), H5Dclose);
  check(set >= 0, name);
  return set;
}

void Writer::write_raw(const std::string& name, hid_t type, const void* data, const Shape& shape,
                       std::size_t value_size, const Storage& storage) {
  const Handle set = declare_raw(name, type, shape, value_size, storage);
  check(H5Dwrite(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, data) >= 0, name);
  note(name, type, data, std::accumulate(shape.begin(), shape.end(), hsize_t{1}, std::multiplies<>()));
}

void Writer::begin_checksum() { noted_ = std::make_unique<Sha256>(); }

void Writer::note(const std::string& name, hid_t type, const void* data, hsize_t count) {
  if (!noted_) return;
  noted_->add(name.c_str(), name.size() + 1);
  noted_->add(data, H5Tget_size(type) * count);
}

void Writer::write_rows_raw(const std::string& name, hid_t type, const void* data, hsize_t first, hsize_t count) {
  if (count == 0) return;
  const Handle set(H5Dopen2(file_, name.c_str(), H5P_DEFAULT), H5Dclose);
  check(set >= 0, name);
  Shape shape;
  const Handle rows = rows_of(set, first, count, shape);
  const Handle memory(H5Screate_simple(static_cast<int>(shape.size()), shape.data(), nullptr), H5Sclose);
  check(H5Dwrite(set, type, memory, rows, H5P_DEFAULT, data) >= 0, name);
  note(name, type, data, std::accumulate(shape.begin(), shape.end(), hsize_t{1}, std::multiplies<>()));
}

namespace {

/// What the datasets of a group take in their file.
hsize_t stored_bytes(hid_t file, const std::string& group) {
  hsize_t bytes = 0;
  const auto add = [](hid_t object, const char* name, const H5O_info_t* info, void* sum) -> herr_t {
    if (info->type == H5O_TYPE_DATASET)
      *static_cast<hsize_t*>(sum) += H5Dget_storage_size(Handle(H5Dopen2(object, name, H5P_DEFAULT), H5Dclose));
    return 0;
  };
  H5Ovisit_by_name2(file, group.c_str(), H5_INDEX_NAME, H5_ITER_NATIVE, add, &bytes, H5O_INFO_BASIC, H5P_DEFAULT);
  return bytes;
}

/// H5Ocopy of HDF5 1.10 does not survive a disk that is full.
bool has_room(hid_t file, const std::filesystem::path& path, hsize_t bytes) {
  bytes += 1 << 14;  // for what describes the datasets
  hsize_t now = 0;
  rlimit most{};
  if (H5Fget_filesize(file, &now) >= 0 && getrlimit(RLIMIT_FSIZE, &most) == 0 && now + bytes > most.rlim_cur)
    return false;
  struct statvfs disk {};
  return statvfs(path.c_str(), &disk) != 0 || bytes <= static_cast<hsize_t>(disk.f_bavail) * disk.f_frsize;
}

}  // namespace

void Writer::copy(const Reader& from, const std::string& name) {
  check(has_room(file_, path_, stored_bytes(from.file_, name)), name);
  check(H5Ocopy(from.file_, name.c_str(), file_, name.c_str(), H5P_DEFAULT, H5P_DEFAULT) >= 0, name);
}

void Writer::write(const std::string& name, const std::vector<std::string>& values) {
  std::size_t size = 1;
  for (const std::string& v : values) size = std::max(size, v.size());
  std::string bytes;
  for (const std::string& v : values) bytes += v + std::string(size - v.size(), '\0');
  write_raw(name, string_type(size), bytes.data(), {values.size()}, size, {});
}

void Writer::attribute_raw(const std::string& group, const std::string& name, hid_t type, const void* data,
                           std::size_t count) {
  if (group != "/" && H5Lexists(file_, group.c_str(), H5P_DEFAULT) <= 0)
    Handle(H5Gcreate2(file_, group.c_str(), make_groups(), H5P_DEFAULT, H5P_DEFAULT), H5Gclose);
  const hsize_t length = count;
  const Handle space(H5Screate_simple(1, &length, nullptr), H5Sclose);
  const Handle attribute(
      H5Acreate_by_name(file_, group.c_str(), name.c_str(), type, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT),
      H5Aclose);
  check(attribute >= 0 && H5Awrite(attribute, type, data) >= 0, group + ":" + name);
  note(group + ":" + name, type, data, count);
}

void Writer::attribute(const std::string& group, const std::string& name, const std::string& text) {
  attribute_raw(group, name, string_type(std::max<std::size_t>(text.size(), 1)), text.c_str(), 1);
}

void Writer::close() { check(H5Fflush(file_, H5F_SCOPE_GLOBAL) >= 0, "file"); }

Reader::Reader(const std::filesystem::path& path, std::string what)
    : what_(std::move(what)), path_(path), file_(open_for_reading(path)) {
  if (file_ < 0) fail("is not a readable HDF5 file (truncated or another format)");
}

void Reader::fail(const std::string& message) const {
  throw Error(ErrorKind::input, fmt::format("{} file '{}' {}", what_, path_.string(), message));
}

bool Reader::has(const std::string& name) const {
  for (std::size_t slash = name.find('/', 1); slash != std::string::npos; slash = name.find('/', slash + 1))
    if (H5Lexists(file_, name.substr(0, slash).c_str(), H5P_DEFAULT) <= 0) return false;
  return H5Lexists(file_, name.c_str(), H5P_DEFAULT) > 0;
}

Shape Reader::shape(const std::string& name, std::size_t rank) const {
  if (!has(name)) fail(fmt::format("has no '{}'", name));
  const Handle set(H5Dopen2(file_, name.c_str(), H5P_DEFAULT), H5Dclose);
  if (set < 0) fail(fmt::format("has no readable '{}'", name));
  const Handle space(H5Dget_space(set), H5Sclose);
  if (H5Sget_simple_extent_ndims(space) != static_cast<int>(rank))
    fail(fmt::format("has '{}' with {} axes, expected {}", name, H5Sget_simple_extent_ndims(space), rank));
  Shape found(rank);
  H5Sget_simple_extent_dims(space, found.data(), nullptr);
  return found;
}

Shape Reader::checked_shape(const std::string& name, const Shape& expected, std::size_t value_size) const {
  const Shape found = shape(name, expected.size());
  std::size_t count = 1;
  for (std::size_t d = 0; d < found.size(); ++d) {
    if (expected[d] != 0 && found[d] != expected[d])
      fail(fmt::format("has '{}' of shape ({}), expected ({}) where 0 is any", name, fmt::join(found, ", "),
                       fmt::join(expected, ", ")));
    if (found[d] > most_values || count > most_values / std::max<hsize_t>(found[d], 1))
      fail(fmt::format("claims '{}' of shape ({}), more than can be", name, fmt::join(found, ", ")));
    count *= found[d];
  }
  // What is not compressed cannot claim more values than the file has bytes for.
  const Handle set(H5Dopen2(file_, name.c_str(), H5P_DEFAULT), H5Dclose);
  const hsize_t stored = H5Dget_storage_size(set);
  if (count * value_size / best_deflation > stored || stored > std::filesystem::file_size(path_))
    fail(fmt::format("claims '{}' of shape ({}) but stores {} bytes for it", name, fmt::join(found, ", "), stored));
  return found;
}

void Reader::read_raw(const std::string& name, hid_t type, void* data) const {
  const Handle set(H5Dopen2(file_, name.c_str(), H5P_DEFAULT), H5Dclose);
  if (H5Dread(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, data) < 0)
    fail(fmt::format("has a damaged '{}' (checksum or type)", name));
}

void Reader::read_rows_raw(const std::string& name, hid_t type, void* data, hsize_t first, hsize_t count) const {
  const Handle set(H5Dopen2(file_, name.c_str(), H5P_DEFAULT), H5Dclose);
  Shape shape;
  const Handle rows = rows_of(set, first, count, shape);
  const Handle memory(H5Screate_simple(static_cast<int>(shape.size()), shape.data(), nullptr), H5Sclose);
  if (H5Dread(set, type, memory, rows, H5P_DEFAULT, data) < 0)
    fail(fmt::format("has a damaged '{}' (checksum or type)", name));
}

void Reader::fail_rows(const std::string& name, hsize_t first, hsize_t count, hsize_t found) const {
  fail(fmt::format("has {} rows in '{}', expected at least {}", found, name, first + count));
}

std::vector<std::string> Reader::read_strings(const std::string& name) const {
  shape(name, 1);
  const Handle set(H5Dopen2(file_, name.c_str(), H5P_DEFAULT), H5Dclose);
  const std::size_t size = text_size(Handle(H5Dget_type(set), H5Tclose), name);
  const Shape found = checked_shape(name, {0}, size);
  std::string bytes(found[0] * size, '\0');
  read_raw(name, string_type(size), bytes.data());
  std::vector<std::string> values;
  for (std::size_t at = 0; at < bytes.size(); at += size) values.emplace_back(bytes.substr(at, size).c_str());
  return values;
}

std::size_t Reader::text_size(hid_t type, const std::string& name) const {
  const std::size_t size = H5Tget_size(type);
  if (H5Tget_class(type) != H5T_STRING || H5Tis_variable_str(type) != 0 || size < 1 || size > most_text_bytes)
    fail(fmt::format("has '{}' of another type, expected texts of fixed length", name));
  return size;
}

void Reader::attribute_raw(const std::string& group, const std::string& name, hid_t type, void* data,
                           std::size_t count) const {
  const Handle attribute(H5Aopen_by_name(file_, group.c_str(), name.c_str(), H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
  if (attribute < 0) fail(fmt::format("has no attribute '{}' of '{}'", name, group));
  const Handle space(H5Aget_space(attribute), H5Sclose);
  if (H5Sget_simple_extent_npoints(space) != static_cast<hssize_t>(count) || H5Aread(attribute, type, data) < 0)
    fail(fmt::format("has an unreadable attribute '{}' of '{}', expected {} values", name, group, count));
}

std::string Reader::text_attribute(const std::string& group, const std::string& name) const {
  const Handle attribute(H5Aopen_by_name(file_, group.c_str(), name.c_str(), H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
  if (attribute < 0) fail(fmt::format("has no attribute '{}' of '{}'", name, group));
  const std::size_t size = text_size(Handle(H5Aget_type(attribute), H5Tclose), name);
  std::string bytes(size, '\0');
  attribute_raw(group, name, string_type(size), bytes.data(), 1);
  return bytes.c_str();
}

}  // namespace hexmesh::hdf5
