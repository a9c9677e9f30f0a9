// SPDX-License-Identifier: Apache-2.0
// A limit is the whole process's: each of these runs in one of its own.
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <cstdlib>
#include <new>
#include <stdexcept>
#include <system_error>
#include <vector>

#include "hexmesh/core/error.h"
#include "hexmesh/core/memory.h"
#include "hexmesh/lattice/lattice.h"
#include "support/bodies.h"

#if defined(__linux__) && !defined(__SANITIZE_ADDRESS__)

namespace test_memory {

using namespace hexmesh;
using namespace testing_support;

constexpr double much = 1e12;

/// What asks for too much ends with 0, anything else otherwise.
template <class F>
[[noreturn]] void exit_by(F&& ask) {
  try {
    ask();
  } catch (const std::bad_alloc&) {
    std::_Exit(0);
  } catch (const Error& e) {
    std::fputs(e.what(), stderr);
    std::_Exit(3);
  }
  std::_Exit(1);
}

class Memory : public testing::Test {
protected:
  void SetUp() override { GTEST_FLAG_SET(death_test_style, "threadsafe"); }
};

TEST_F(Memory, HasNoLimitUnlessItIsSet) {
  EXPECT_GT(memory_left(), much);
  EXPECT_NO_THROW(expect_memory(1'000'000'000'000, "it"));
}

TEST_F(Memory, BeyondTheWallThereIsNone) {
  const auto ask = [](double limit, std::size_t bytes) {
    exit_by([=] {
      limit_memory(limit);
      const std::vector<char> asked(bytes, 'a');
      std::_Exit(asked[bytes / 2] == 'a' ? 2 : 1);
    });
  };
  EXPECT_EXIT(ask(2e8, 700'000'000), testing::ExitedWithCode(0), "");
  EXPECT_EXIT(ask(8e8, 700'000'000), testing::ExitedWithCode(2), "");
}

TEST_F(Memory, LimitsOfTheProcessStay) {
  const auto data_limit_after = [](double bytes) {
    rlimit of_data{};
    getrlimit(RLIMIT_DATA, &of_data);
    of_data.rlim_cur = 3'000'000'000;
    setrlimit(RLIMIT_DATA, &of_data);
    limit_memory(bytes);
    getrlimit(RLIMIT_DATA, &of_data);
    std::_Exit(of_data.rlim_cur == 3'000'000'000 ? 0 : 4);
  };
  EXPECT_EXIT(data_limit_after(1e10), testing::ExitedWithCode(0), "");
  EXPECT_EXIT(data_limit_after(1e300), testing::ExitedWithCode(0), "");
  EXPECT_EXIT(data_limit_after(1e8), testing::ExitedWithCode(4), "");
}

TEST_F(Memory, OfThreadsToo) {
  EXPECT_TRUE(is_out_of_memory(std::bad_alloc()));
  EXPECT_TRUE(is_out_of_memory(std::system_error(std::make_error_code(std::errc::resource_unavailable_try_again))));
  EXPECT_FALSE(is_out_of_memory(std::system_error(std::make_error_code(std::errc::permission_denied))));
  EXPECT_FALSE(is_out_of_memory(std::runtime_error("the lattice is empty")));
}

TEST_F(Memory, WhatIsForeseenIsRefusedBeforeItIsTaken) {
  const auto foresee = [](std::size_t bytes) {
    exit_by([=] {
      limit_memory(2e8, much);
      expect_memory(bytes, "the lattice");
    });
  };
  EXPECT_EXIT(foresee(300'000'000), testing::ExitedWithCode(3),
              "the lattice takes about 300 MB, expected at most 200 MB, what is left of 200 MB \\(--max-memory\\)");
  EXPECT_EXIT(foresee(50'000'000), testing::ExitedWithCode(1), "");
  const auto build = [](std::int32_t size) {
    exit_by([=] {
      limit_memory(1.5e8, much);
      one_material(
          {size, size, size}, {1, 1, 1}, [](const Index3&) { return true; }, 3, 0.3);
    });
  };
  EXPECT_EXIT(build(160), testing::ExitedWithCode(3), "a lattice of 4096000 voxels takes about 176 MB");
  EXPECT_EXIT(build(40), testing::ExitedWithCode(1), "");
}

}  // namespace test_memory

#endif
