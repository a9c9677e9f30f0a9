// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace hexmesh {

/// A dataset that two files do not share.
struct DatasetDifference {
  std::string name;
  std::string what;    ///< e.g. "is only in the first"
  double largest = 0;  ///< difference of two numbers, where both have as many
};

/// What is not the same, bit for bit, in two HDF5 files of ours, dataset by dataset. History and costs, which differ
/// from run to run, are left out.
/// @throws Error{input} where one cannot be read
std::vector<DatasetDifference> compare_datasets(const std::filesystem::path& first,
                                                const std::filesystem::path& second);

}  // namespace hexmesh
