// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

/// HDF5 files that are valid and say what is not so, made from a good lattice or result by the HDF5 library alone.
namespace testing_support {

/// One change of a file.
struct Lie {
  std::string name;              ///< dataset or attribute, and what is done to it; may serve as a file's name
  bool must_be_refused = false;  ///< no reader may take it; the others may be read as something else that is sane
  std::function<void(const std::filesystem::path&)> tell;
};

/// Every dataset and attribute of a file by every kind of change: missing, empty, of another shape, type, order or
/// storage, behind a link, with values that are not finite, huge, negative, repeated, swapped.
std::vector<Lie> lies_about(const std::filesystem::path& good);

/// JSON that is none, of wrong types, deep or large, as report and as costs of a result.
std::vector<Lie> lies_in_reports();

/// Several of them that fit together: a box, levels and counts of another body, cycles of groups.
std::vector<Lie> larger_lies(const std::filesystem::path& good);

/// Datasets of numbers.
std::vector<std::string> numbers_in(const std::filesystem::path& path);

/// Change one number, counted from the start of the dataset and round again; nothing where an earlier lie has left
/// none.
void set_number(const std::filesystem::path& path, const std::string& dataset, std::size_t at, double value);

}  // namespace testing_support
