// SPDX-License-Identifier: Apache-2.0
#include "hdf5.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "../core/text.h"
#include "hdf5_rules.h"
#include "hexmesh/core/error.h"
#include "hexmesh/core/memory.h"
#include "refuse.h"

namespace hexmesh::hdf5 {
namespace {

constexpr double most_values = 0x1p36;
constexpr std::size_t most_texts = std::size_t{1} << 20, most_bytes_of_texts = std::size_t{1} << 26;
constexpr std::ptrdiff_t most_depth = 8;
constexpr std::size_t most_datasets = std::size_t{1} << 20;

std::string name_of(hid_t native) {
  return fmt::format("{}{}",
                     H5Tget_class(native) == H5T_FLOAT     ? "float"
                     : H5Tget_sign(native) == H5T_SGN_NONE ? "uint"
                                                           : "int",
                     8 * H5Tget_size(native));
}

constexpr std::size_t most_text_bytes = std::size_t{1} << 24;

Handle open_for_reading(const std::filesystem::path& path) {
  const Lock lock;
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  return {H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose};
}

}  // namespace

std::recursive_mutex& Lock::library() {
  static std::recursive_mutex mutex;
  return mutex;
}

Handle string_type(std::size_t size, H5T_cset_t characters) {
  Handle type(H5Tcopy(H5T_C_S1), H5Tclose);
  H5Tset_size(type, size);
  H5Tset_cset(type, characters);
  H5Tset_strpad(type, H5T_STR_NULLPAD);
  return type;
}

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

Reader::Reader(const std::filesystem::path& path, std::string what)
    : what_(std::move(what)), path_(path), file_(open_for_reading(path)) {
  if (file_ < 0) fail("is not a readable HDF5 file (truncated or another format)");
}

void Reader::fail(const std::string& message) const {
  throw Error(ErrorKind::input, fmt::format("{} file '{}' {}", what_, path_.string(), message));
}

bool Reader::has(const std::string& name) const {
  const Lock lock;
  std::string problem;
  const bool found = is_reached(file_, name, problem);
  if (!problem.empty()) fail(problem);
  return found;
}

Reader::Dataset Reader::open(const std::string& name, const Shape& expected) const {
  if (!has(name)) fail(fmt::format("has no '{}'", name));
  Dataset set{name, Handle(H5Dopen2(file_, name.c_str(), H5P_DEFAULT), H5Dclose), {}};
  if (set.id < 0) fail(fmt::format("has no readable dataset '{}'", name));
  if (const std::string problem = place_problem(set.id); !problem.empty())
    fail(fmt::format("has a '{}' that {}", name, problem));
  const Handle space(H5Dget_space(set.id), H5Sclose);
  const int rank = H5Sget_simple_extent_type(space) == H5S_SIMPLE ? H5Sget_simple_extent_ndims(space) : 0;
  set.shape.resize(static_cast<std::size_t>(std::max(rank, 0)));
  if (!set.shape.empty()) H5Sget_simple_extent_dims(space, set.shape.data(), nullptr);
  if (!expected.empty() && set.shape.size() != expected.size())
    fail(fmt::format("has '{}' with {} axes, expected {}", name, set.shape.size(), expected.size()));
  if (rank < 1) fail(fmt::format("has '{}' without axes, expected some", name));
  for (std::size_t d = 0; d < expected.size(); ++d)
    if (expected[d] != 0 && set.shape[d] != expected[d])
      fail(fmt::format("has '{}' of shape ({}), expected ({}) where 0 is any", name, fmt::join(set.shape, ", "),
                       fmt::join(expected, ", ")));
  return set;
}

Shape Reader::shape(const std::string& name, std::size_t rank) const {
  const Lock lock;
  const Dataset set = open(name, Shape(rank));
  check_storage(set, H5Tget_size(Handle(H5Dget_type(set.id), H5Tclose)));
  return set.shape;
}

Reader::Dataset Reader::open_numbers(const std::string& name, const Shape& expected, hid_t type,
                                     std::size_t value_size) const {
  Dataset set = open(name, expected);
  if (!is_kept_as(Handle(H5Dget_type(set.id), H5Tclose), type))
    fail(fmt::format("has '{}' of another type, expected {}", name, name_of(type)));
  check_storage(set, value_size);
  return set;
}

void Reader::check_storage(const Dataset& set, std::size_t value_size) const {
  if (kept_well_.contains(set.name)) return;
  double count = 1;
  for (const hsize_t n : set.shape) count *= static_cast<double>(n);
  const double bytes = count * static_cast<double>(value_size);
  const hsize_t stored = H5Dget_storage_size(set.id);
  if (count > most_values)
    fail(fmt::format("claims '{}' of shape ({}), more than can be", set.name, fmt::join(set.shape, ", ")));
  if (const std::string problem = storage_problem(set.id, set.shape, bytes); !problem.empty())
    fail(fmt::format("has a '{}' that {}", set.name, problem));
  // What is packed cannot claim more than its bytes unpack to.
  if (bytes / best_deflation > static_cast<double>(stored) || stored > std::filesystem::file_size(path_))
    fail(fmt::format("claims '{}' of shape ({}) but stores {} bytes for it", set.name, fmt::join(set.shape, ", "),
                     stored));
  kept_well_.insert(set.name);
}

void Reader::expect_room(const Dataset& set, std::size_t bytes) const {
  expect_memory(bytes, fmt::format("'{}' of {} file '{}'", set.name, what_, path_.string()));
}

void Reader::read_raw(const Dataset& set, hid_t type, void* data) const {
  if (H5Dread(set.id, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, data) < 0)
    fail(fmt::format("has a damaged '{}' (checksum or type)", set.name));
}

void Reader::read_rows_raw(const Dataset& set, hid_t type, void* data, hsize_t first, hsize_t count) const {
  Shape shape;
  const Handle rows = hdf5::rows_of(set.id, first, count, shape);
  const Handle memory(H5Screate_simple(static_cast<int>(shape.size()), shape.data(), nullptr), H5Sclose);
  if (H5Dread(set.id, type, memory, rows, H5P_DEFAULT, data) < 0)
    fail(fmt::format("has a damaged '{}' (checksum or type)", set.name));
}

void Reader::fail_rows(const std::string& name, hsize_t first, hsize_t count, hsize_t found) const {
  fail(fmt::format("has {} rows in '{}', expected at least {}", found, name, first + count));
}

std::vector<std::string> Reader::read_strings(const std::string& name) const {
  const Lock lock;
  const Dataset set = open(name, {0});
  const std::size_t size = text_size(Handle(H5Dget_type(set.id), H5Tclose), name);
  check_storage(set, size);
  if (set.shape[0] > most_texts || set.shape[0] * size > most_bytes_of_texts)
    fail(fmt::format("has {} texts of {} bytes in '{}', expected at most {} MB", set.shape[0], size, name,
                     most_bytes_of_texts >> 20));
  std::string bytes(set.shape[0] * size, '\0');
  read_raw(set, string_type(size), bytes.data());
  std::vector<std::string> values;
  for (std::size_t at = 0; at < bytes.size(); at += size) {
    values.emplace_back(bytes.substr(at, size).c_str());
    check_text(values.back(), name);
  }
  return values;
}

void Reader::check_text(const std::string& text, const std::string& name) const {
  if (!is_utf8(text)) fail(fmt::format("has a text in '{}' that is not UTF-8", name));
}

std::size_t Reader::text_size(hid_t type, const std::string& name) const {
  const std::size_t size = H5Tget_size(type);
  if (H5Tget_class(type) != H5T_STRING || H5Tis_variable_str(type) != 0 || size < 1 || size > most_text_bytes)
    fail(fmt::format("has '{}' of another type, expected texts of fixed length", name));
  return size;
}

Handle Reader::open_attribute(const std::string& group, const std::string& name) const {
  if (!has(group)) fail(fmt::format("has no '{}'", group));
  Handle attribute(H5Aopen_by_name(file_, group.c_str(), name.c_str(), H5P_DEFAULT, H5P_DEFAULT), H5Aclose);
  if (attribute < 0) fail(fmt::format("has no attribute '{}' of '{}'", name, group));
  return attribute;
}

void Reader::attribute_raw(const std::string& group, const std::string& name, hid_t type, void* data,
                           std::size_t count) const {
  const Handle attribute = open_attribute(group, name);
  const Handle space(H5Aget_space(attribute), H5Sclose);
  const Handle kept_as(H5Aget_type(attribute), H5Tclose);
  const bool is_text = H5Tget_class(type) == H5T_STRING;
  if (!is_text && !is_kept_as(kept_as, type))
    fail(fmt::format("has an attribute '{}' of '{}' of another type, expected {}", name, group, name_of(type)));
  if (H5Sget_simple_extent_npoints(space) != static_cast<hssize_t>(count) || H5Aread(attribute, type, data) < 0)
    fail(fmt::format("has an unreadable attribute '{}' of '{}', expected {} values", name, group, count));
}

std::string Reader::text_attribute(const std::string& group, const std::string& name) const {
  const Lock lock;
  const Handle type(H5Aget_type(open_attribute(group, name)), H5Tclose);
  const std::size_t size = text_size(type, name);
  std::string bytes(size, '\0');
  attribute_raw(group, name, string_type(size), bytes.data(), 1);
  check_text(bytes.c_str(), group + ":" + name);
  return bytes.c_str();
}

bool Reader::has_attribute(const std::string& group, const std::string& name) const {
  const Lock lock;
  return has(group) && H5Aexists_by_name(file_, group.c_str(), name.c_str(), H5P_DEFAULT) > 0;
}

std::size_t Reader::count_links(const std::string& group) const {
  const Lock lock;
  H5G_info_t info;
  if (H5Gget_info_by_name(file_, group.c_str(), &info, H5P_DEFAULT) < 0)
    fail(fmt::format("has no readable group '{}'", group));
  return info.nlinks;
}

std::vector<std::string> Reader::dataset_names() const {
  const Lock lock;
  std::set<std::string> names;
  const herr_t status = H5Ovisit_by_name2(  // the second, which HDF5 1.10 and 1.14 both have, each with its own info
      file_, "/", H5_INDEX_NAME, H5_ITER_NATIVE,
      [](hid_t, const char* name, const auto* info, void* to) {
        auto& found = *static_cast<std::set<std::string>*>(to);
        const std::string path = name;
        if (std::count(path.begin(), path.end(), '/') > most_depth || found.size() > most_datasets) return -1;
        if (info->type == H5O_TYPE_DATASET) found.insert("/" + path);
        return 0;
      },
      &names, H5O_INFO_BASIC, H5P_DEFAULT);
  if (status < 0) fail("has too many or too deep groups, or damaged ones");
  return {names.begin(), names.end()};
}

bool Reader::is_text(const std::string& name) const {
  const Lock lock;
  return H5Tget_class(Handle(H5Dget_type(open(name, {}).id), H5Tclose)) == H5T_STRING;
}

std::vector<double> Reader::read_any_numbers(const std::string& name, Shape& shape) const {
  const Lock lock;
  const Dataset set = open(name, {});
  const Handle type(H5Dget_type(set.id), H5Tclose);
  if (H5Tget_class(type) != H5T_INTEGER && H5Tget_class(type) != H5T_FLOAT)
    fail(fmt::format("has '{}' of another type, expected numbers", name));
  check_storage(set, H5Tget_size(type));
  std::vector<double> values(set.count());
  read_raw(set, H5T_NATIVE_DOUBLE, values.data());
  shape = set.shape;
  return values;
}

}  // namespace hexmesh::hdf5
