// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/file/dataset_compare.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <set>

#include "hdf5.h"
#include "refuse.h"

namespace hexmesh {
namespace {

class DatasetFile {
public:
  explicit DatasetFile(const std::filesystem::path& path)
      : path_(path), file_(H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose) {
    if (file_ < 0) refuse(path, "is not a readable HDF5 file");
    H5Ovisit_by_name2(  // the second, which HDF5 1.10 and 1.14 both have, each with its own kind of info
        file_, "/", H5_INDEX_NAME, H5_ITER_NATIVE,
        [](hid_t, const char* name, const auto* info, void* names) {
          if (info->type == H5O_TYPE_DATASET) static_cast<std::set<std::string>*>(names)->insert(name);
          return 0;
        },
        &names_, H5O_INFO_BASIC, H5P_DEFAULT);
    names_.erase("history");
    names_.erase("costs");
  }

  const std::set<std::string>& names() const noexcept { return names_; }

  struct Values {
    hdf5::Shape shape;
    bool is_text = false;
    std::string bytes;            ///< of texts, or of numbers as doubles
    std::vector<double> numbers;  ///< none of texts
  };
  Values read(const std::string& name) const {
    const hdf5::Handle set(H5Dopen2(file_, name.c_str(), H5P_DEFAULT), H5Dclose);
    const hdf5::Handle type(H5Dget_type(set), H5Tclose);
    const hdf5::Handle space(H5Dget_space(set), H5Sclose);
    Values v;
    v.shape.resize(static_cast<std::size_t>(std::max(0, H5Sget_simple_extent_ndims(space))));
    H5Sget_simple_extent_dims(space, v.shape.data(), nullptr);
    v.is_text = H5Tget_class(type) == H5T_STRING;
    const auto count = static_cast<std::size_t>(std::max<hssize_t>(0, H5Sget_simple_extent_npoints(space)));
    herr_t status = 0;
    if (v.is_text) {
      v.bytes.resize(count * H5Tget_size(type));
      status = H5Dread(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, v.bytes.data());
    } else {
      v.numbers.resize(count);
      status = H5Dread(set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, v.numbers.data());
    }
    if (status < 0) refuse(path_, "has a damaged '/{}'", name);
    return v;
  }

private:
  std::filesystem::path path_;
  hdf5::Handle file_;
  std::set<std::string> names_;
};

}  // namespace

std::vector<DatasetDifference> compare_datasets(const std::filesystem::path& first,
                                                const std::filesystem::path& second) {
  const DatasetFile a(first), b(second);
  std::vector<DatasetDifference> out;
  for (const std::string& name : a.names())
    if (!b.names().contains(name)) out.push_back({"/" + name, "is only in the first"});
  for (const std::string& name : b.names())
    if (!a.names().contains(name)) out.push_back({"/" + name, "is only in the second"});
  for (const std::string& name : a.names()) {
    if (!b.names().contains(name)) continue;
    const DatasetFile::Values x = a.read(name), y = b.read(name);
    if (x.shape != y.shape || x.is_text != y.is_text) {
      out.push_back({"/" + name, "has another shape or type"});
    } else if (x.is_text) {
      if (x.bytes != y.bytes) out.push_back({"/" + name, "has another text"});
    } else if (std::memcmp(x.numbers.data(), y.numbers.data(), sizeof(double) * x.numbers.size()) != 0) {
      DatasetDifference d{"/" + name, "has other numbers"};
      for (std::size_t n = 0; n < x.numbers.size(); ++n) {
        const double difference = std::abs(x.numbers[n] - y.numbers[n]);
        if (!(difference <= d.largest)) d.largest = difference;
      }
      out.push_back(std::move(d));
    }
  }
  return out;
}

}  // namespace hexmesh
