// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>
#include <hdf5.h>

#include <filesystem>
#include <string>
#include <vector>

/// Files of ours as other programs see them: by the HDF5 library alone.
namespace testing_support {

/// A dataset.
template <class T>
std::vector<T> read_plain(const std::filesystem::path& path, const std::string& name, hid_t type) {
  const hid_t file = H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  const hid_t set = H5Dopen2(file, name.c_str(), H5P_DEFAULT);
  const hid_t space = H5Dget_space(set);
  std::vector<T> values(static_cast<std::size_t>(H5Sget_simple_extent_npoints(space)));
  EXPECT_GE(H5Dread(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()), 0) << name;
  H5Sclose(space);
  H5Dclose(set);
  H5Fclose(file);
  return values;
}

/// Write new values over a dataset of as many.
template <class T>
void write_plain(const std::filesystem::path& path, const std::string& name, hid_t type, const std::vector<T>& values) {
  const hid_t file = H5Fopen(path.c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
  const hid_t set = H5Dopen2(file, name.c_str(), H5P_DEFAULT);
  EXPECT_GE(H5Dwrite(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()), 0) << name;
  H5Dclose(set);
  H5Fclose(file);
}

/// Multiply a dataset.
inline void scale_dataset(const std::filesystem::path& path, const std::string& name, double factor) {
  std::vector<double> values = read_plain<double>(path, name, H5T_NATIVE_DOUBLE);
  for (double& v : values) v *= factor;
  write_plain(path, name, H5T_NATIVE_DOUBLE, values);
}

/// Change one value of a dataset of whole numbers.
inline void add_to_dataset(const std::filesystem::path& path, const std::string& name, std::size_t at, int number) {
  std::vector<int> values = read_plain<int>(path, name, H5T_NATIVE_INT);
  values.at(at) += number;
  write_plain(path, name, H5T_NATIVE_INT, values);
}

}  // namespace testing_support
