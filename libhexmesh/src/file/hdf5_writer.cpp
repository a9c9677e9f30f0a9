// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/statvfs.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <string_view>

#include "../core/text.h"
#include "hdf5.h"
#include "hexmesh/core/error.h"

namespace hexmesh::hdf5 {
namespace {

constexpr hsize_t chunk_bytes = 1 << 20;

/// Of a kind of object, without the time at which it is made.
Handle without_times(hid_t kind) {
  Handle list(H5Pcreate(kind), H5Pclose);
  H5Pset_obj_track_times(list, false);
  return list;
}

Handle open_for_writing(const std::filesystem::path& path, Writer::Start start) {
  const Lock lock;
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
  const Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose);
  if (start != Writer::Start::anew_for_all)  // the 1.10 layout has checksums in its indices and headers too
    H5Pset_libver_bounds(access, H5F_LIBVER_V110, H5F_LIBVER_V110);
  return {start == Writer::Start::as_it_is
              ? H5Fopen(path.c_str(), H5F_ACC_RDWR, access)
              : H5Fcreate(path.c_str(), H5F_ACC_TRUNC, without_times(H5P_FILE_CREATE), access),
          H5Fclose};
}

/// What the system said to the call that failed last, e.g. "No space left on device"; empty: nothing.
std::string said_by_system() {
  std::string said;
  const auto find = [](unsigned, const H5E_error2_t* e, void* out) -> herr_t {
    const std::string_view words = e->desc ? e->desc : "", before = "error message = '";
    const std::size_t begin = words.find(before), end = words.find('\'', begin + before.size());
    if (begin != words.npos && end != words.npos)
      *static_cast<std::string*>(out) = words.substr(begin + before.size(), end - begin - before.size());
    return 0;
  };
  H5Ewalk2(H5E_DEFAULT, H5E_WALK_UPWARD, find, &said);
  return said;
}

}  // namespace

Writer::Writer(const std::filesystem::path& path, Start start) : path_(path), file_(open_for_writing(path, start)) {
  check(file_ >= 0, "the beginning");
}

void Writer::check(bool good, const std::string& name, std::string why) const {
  if (good) return;
  if (why.empty()) why = said_by_system();
  throw Error(ErrorKind::output,
              fmt::format("cannot write '{}' into '{}'{}{}", name, path_.string(), why.empty() ? "" : ": ", why));
}

void Writer::make_groups(const std::string& path) {
  for (std::size_t end = path.find('/', 1); end != std::string::npos; end = path.find('/', end + 1)) {
    const std::string group = path.substr(0, end);
    if (H5Lexists(file_, group.c_str(), H5P_DEFAULT) > 0) continue;
    const Handle made(H5Gcreate2(file_, group.c_str(), H5P_DEFAULT, without_times(H5P_GROUP_CREATE), H5P_DEFAULT),
                      H5Gclose);
    check(made >= 0, group);
  }
}

Handle Writer::declare_raw(const std::string& name, hid_t type, const Shape& shape, std::size_t value_size,
                           const Storage& storage) {
  const Handle space(H5Screate_simple(static_cast<int>(shape.size()), shape.data(), nullptr), H5Sclose);
  const Handle layout = without_times(H5P_DATASET_CREATE);
  make_groups(name);
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
  Handle set(H5Dcreate2(file_, name.c_str(), type, space, H5P_DEFAULT, layout, H5P_DEFAULT), H5Dclose);
  check(set >= 0, name);
  return set;
}

void Writer::write_raw(const std::string& name, hid_t type, const void* data, const Shape& shape,
                       std::size_t value_size, const Storage& storage) {
  Handle set = declare_raw(name, type, shape, value_size, storage);
  check(H5Dwrite(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, data) >= 0, name);
  check(set.close(), name);  // what the cache of chunks holds goes to the disk now
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
  Handle set(H5Dopen2(file_, name.c_str(), H5P_DEFAULT), H5Dclose);
  check(set >= 0, name);
  Shape shape;
  const Handle rows = rows_of(set, first, count, shape);
  const Handle memory(H5Screate_simple(static_cast<int>(shape.size()), shape.data(), nullptr), H5Sclose);
  check(H5Dwrite(set, type, memory, rows, H5P_DEFAULT, data) >= 0, name);
  check(set.close(), name);
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
  const Lock lock;
  from.check_storage(from.open(name, {}), 1);
  make_groups(name);
  check(has_room(file_, path_, stored_bytes(from.file_, name)), name, std::strerror(ENOSPC));
  check(H5Ocopy(from.file_, name.c_str(), file_, name.c_str(), H5P_DEFAULT, H5P_DEFAULT) >= 0, name);
}

void Writer::write(const std::string& name, const std::vector<std::string>& values) {
  const Lock lock;
  std::vector<std::string> texts;
  std::size_t size = 1;
  for (const std::string& v : values) {
    texts.push_back(to_utf8(v));
    size = std::max(size, texts.back().size());
  }
  std::string bytes;
  for (const std::string& text : texts) bytes += text + std::string(size - text.size(), '\0');
  write_raw(name, string_type(size), bytes.data(), {values.size()}, size, {});
}

void Writer::variable_text(const std::string& name, const std::string& text) {
  const Lock lock;
  const Handle type = string_type(H5T_VARIABLE, H5T_CSET_ASCII), layout = without_times(H5P_DATASET_CREATE);
  const hsize_t one = 1;
  const Handle space(H5Screate_simple(1, &one, nullptr), H5Sclose);
  make_groups(name);
  Handle set(H5Dcreate2(file_, name.c_str(), type, space, H5P_DEFAULT, layout, H5P_DEFAULT), H5Dclose);
  const char* value = text.c_str();
  check(set >= 0 && H5Dwrite(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, &value) >= 0 && set.close(), name);
}

void Writer::attribute_raw(const std::string& group, const std::string& name, hid_t type, const void* data,
                           std::size_t count) {
  if (group != "/") make_groups(group + "/");
  const hsize_t length = count;
  const Handle space(H5Screate_simple(1, &length, nullptr), H5Sclose);
  const Handle attribute(
      H5Acreate_by_name(file_, group.c_str(), name.c_str(), type, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT),
      H5Aclose);
  check(attribute >= 0 && H5Awrite(attribute, type, data) >= 0, group + ":" + name);
  note(group + ":" + name, type, data, count);
}

void Writer::attribute(const std::string& group, const std::string& name, const std::string& text) {
  const Lock lock;
  const std::string value = to_utf8(text);
  attribute_raw(group, name, string_type(std::max<std::size_t>(value.size(), 1)), value.c_str(), 1);
}

void Writer::ascii_attribute(const std::string& group, const std::string& name, const std::string& text) {
  const Lock lock;
  attribute_raw(group, name, string_type(text.size(), H5T_CSET_ASCII), text.c_str(), 1);
}

void Writer::close() {
  const Lock lock;
  check(H5Fflush(file_, H5F_SCOPE_GLOBAL) >= 0, "what describes its parts");
}

}  // namespace hexmesh::hdf5
