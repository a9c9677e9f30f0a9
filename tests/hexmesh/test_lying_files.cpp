// SPDX-License-Identifier: Apache-2.0
// Valid HDF5 that says what is not so: refused in one line, or read as something sane. Under sanitizers, as
// test_damaged_files.cpp.
#include <gtest/gtest.h>

#include "fuzz/use_files.h"
#include "support/files.h"
#include "support/forms.h"
#include "support/lying_files.h"
#include "support/small_lattice.h"

using namespace hexmesh;
using namespace testing_support;

namespace {

/// Each lie told by a copy of a good file, in the short form one in seven.
/// @param use  of what is read, as tools do
template <class Use>
void tell(const std::vector<Lie>& lies, const TemporaryFolder& folder, Use&& use) {
  std::size_t refused = 0, read = 0;
  for (std::size_t n = 0; n < lies.size(); n += whole_or<std::size_t>(1, 13)) {
    const Lie& lie = lies[n];
    std::filesystem::copy_file(folder / "good", folder / "lie", std::filesystem::copy_options::overwrite_existing);
    lie.tell(folder / "lie");
    try {
      use(folder / "lie");
      EXPECT_FALSE(lie.must_be_refused) << lie.name << ": read as if nothing were wrong";
      ++read;
    } catch (const Error& e) {
      const std::string message = e.what();
      EXPECT_EQ(e.kind(), ErrorKind::input) << lie.name << ": " << message;
      EXPECT_EQ(message.find('\n'), std::string::npos) << lie.name << ": " << message;
      EXPECT_LT(message.size(), 600U) << lie.name << ": " << message;
      ++refused;
    } catch (const std::exception& e) {
      ADD_FAILURE() << lie.name << ": " << e.what();
    }
  }
  printf("%zu lies refused, %zu read\n", refused, read);
}

}  // namespace

TEST(LyingFiles, LatticesAreRefusedOrHold) {
  const TemporaryFolder folder;
  for (const MatrixStorage storage : {MatrixStorage::none, MatrixStorage::all}) {
    write_lattice(small_lattice(), folder / "good", storage);
    ASSERT_TRUE(fuzzing::use_lattice(folder / "good"));
    std::vector<Lie> lies = lies_about(folder / "good");
    for (Lie& lie : larger_lies(folder / "good")) lies.push_back(std::move(lie));
    tell(lies, folder, [](const auto& path) { fuzzing::use_lattice(path); });
  }
}

TEST(LyingFiles, ResultsAreRefusedOrFinite) {
  const TemporaryFolder folder;
  write_small_result(folder / "good");
  fuzzing::use_result(folder / "good");
  std::vector<Lie> lies = lies_about(folder / "good");
  for (Lie& lie : larger_lies(folder / "good")) lies.push_back(std::move(lie));
  for (Lie& lie : lies_in_reports()) lies.push_back(std::move(lie));
  tell(lies, folder, [](const auto& path) { fuzzing::use_result(path); });
}

TEST(LyingFiles, CheckSeesWhatReadingDoesNot) {
  const TemporaryFolder folder;
  const auto holds_after = [&](const std::string& dataset, std::size_t at, double value) {
    write_lattice(small_lattice(), folder / "a", MatrixStorage::none);
    set_number(folder / "a", dataset, at, value);
    return fuzzing::use_lattice(folder / "a");
  };
  EXPECT_FALSE(holds_after("/surface/points", 4, 0.5));
  EXPECT_FALSE(holds_after("/segments/color", 0, 0.25));
  // Any other number of parts than that which the voxels give.
  const Lattice good = small_lattice();
  EXPECT_FALSE(holds_after("/levels/2/parts", 0, good.levels[2].parts[0] + 1));
  EXPECT_TRUE(holds_after("/levels/2/parts", 0, good.levels[2].parts[0]));
}
