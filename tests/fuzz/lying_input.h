// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <bit>
#include <cstring>
#include <limits>

#include "fuzz_target.h"
#include "support/files.h"
#include "support/lying_files.h"

/// HDF5 files from the bytes of a fuzzer: each few bytes are a change of a good file, so that what comes out is valid
/// and its meaning is what varies.
namespace fuzzing {

class LyingInput {
public:
  /// @param write  makes the good file
  template <class Write>
  explicit LyingInput(Write&& write) {
    const testing_support::TemporaryFolder folder;
    write(folder / "good");
    good_ = testing_support::read_text(folder / "good");
    numbers_ = testing_support::numbers_in(folder / "good");
    for (auto make : {testing_support::lies_about, testing_support::larger_lies})
      for (testing_support::Lie& lie : make(folder / "good"))
        // Large ones are for tests: here they would take all the time.
        if (lie.name.find("thousand") == std::string::npos && lie.name.find("million") == std::string::npos)
          lies_.push_back(std::move(lie));
  }

  std::filesystem::path file_of(const std::uint8_t* data, std::size_t size) const {
    const auto path = fuzzing::file_of(reinterpret_cast<const std::uint8_t*>(good_.data()), good_.size(), ".h5");
    constexpr std::size_t change_bytes = 12, most_changes = 4;
    for (std::size_t n = 0; n < std::min(size / change_bytes, most_changes); ++n) change(path, data + n * change_bytes);
    return path;
  }

private:
  void change(const std::filesystem::path& path, const std::uint8_t* bytes) const {
    std::uint16_t which = 0, at = 0;
    double value = 0;
    std::memcpy(&which, bytes, 2);
    std::memcpy(&at, bytes + 2, 2);
    std::memcpy(&value, bytes + 4, 8);
    if (which % 4 == 0) return lies_[which / 4 % lies_.size()].tell(path);
    testing_support::set_number(path, numbers_[which / 4 % numbers_.size()], at, number(bytes[4], value));
  }

  /// Small whole numbers, bounds of types, or any double at all.
  static double number(std::uint8_t kind, double any) {
    constexpr double odd[] = {-1,         1e-300,        1e20, 1e300, 65535, 65536,
                              2147483647, -2147483648.0, 1e9,  0.5,   -0.5,  4294967295.0};
    if (kind < 128) return kind % 16;
    return kind < 240 ? odd[kind % std::size(odd)] : any;
  }

  std::string good_;
  std::vector<std::string> numbers_;
  std::vector<testing_support::Lie> lies_;
};

}  // namespace fuzzing
