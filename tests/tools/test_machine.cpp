// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <omp.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "cli/machine.h"

namespace test_machine {

using namespace hextools;
namespace fs = std::filesystem;

/// A machine's /proc and /sys with control groups.
class ControlGroups : public testing::Test {
protected:
  void SetUp() override {
    folder_ = fs::path(testing::TempDir()) /
              (std::string("groups_") + testing::UnitTest::GetInstance()->current_test_info()->name());
    fs::remove_all(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }
  void write(const fs::path& file, const std::string& text) {
    fs::create_directories((folder_ / file).parent_path());
    std::ofstream(folder_ / file) << text;
  }
  double processors() const {
    return processors_of_control_group((folder_ / "proc").c_str(), (folder_ / "sys").c_str());
  }

  double memory() const { return memory_of_control_group((folder_ / "proc").c_str(), (folder_ / "sys").c_str()); }

private:
  fs::path folder_;
};

TEST_F(ControlGroups, NoneIsNoLimit) {
  EXPECT_EQ(processors(), 0);
  write("proc/self/cgroup", "0::/user.slice\n");
  EXPECT_EQ(processors(), 0);
  write("sys/fs/cgroup/user.slice/cpu.max", "max 100000\n");
  EXPECT_EQ(processors(), 0);
}

TEST_F(ControlGroups, TheTightestOfAllAroundCounts) {
  write("proc/self/cgroup", "0::/jobs/mine\n");
  write("sys/fs/cgroup/jobs/mine/cpu.max", "150000 100000\n");
  EXPECT_EQ(processors(), 1.5);
  write("sys/fs/cgroup/jobs/cpu.max", "50000 100000\n");
  EXPECT_EQ(processors(), 0.5);
}

TEST_F(ControlGroups, InAContainerTheRootIsTheGroup) {
  write("proc/self/cgroup", "0::/../../docker/8f3c\n");
  write("sys/fs/cgroup/cpu.max", "200000 100000\n");
  EXPECT_EQ(processors(), 2);
}

TEST_F(ControlGroups, OfVersionOneToo) {
  write("proc/self/cgroup", "5:memory:/mine\n4:cpu,cpuacct:/mine\n1:name=systemd:/mine\n");
  write("sys/fs/cgroup/cpu,cpuacct/mine/cpu.cfs_quota_us", "-1\n");
  write("sys/fs/cgroup/cpu,cpuacct/mine/cpu.cfs_period_us", "100000\n");
  EXPECT_EQ(processors(), 0);
  write("sys/fs/cgroup/cpu,cpuacct/mine/cpu.cfs_quota_us", "300000\n");
  EXPECT_EQ(processors(), 3);
}

TEST_F(ControlGroups, MemoryOfBothVersions) {
  write("proc/self/cgroup", "5:memory:/mine\n4:cpu,cpuacct:/mine\n");
  EXPECT_EQ(memory(), 0);
  write("sys/fs/cgroup/memory/mine/memory.limit_in_bytes", "9223372036854771712\n");
  EXPECT_GT(memory(), 1e18) << "a number for none";
  write("sys/fs/cgroup/memory/memory.limit_in_bytes", "2000000000\n");
  EXPECT_EQ(memory(), 2e9);
  write("proc/self/cgroup", "0::/jobs/mine\n");
  write("sys/fs/cgroup/jobs/mine/memory.max", "max\n");
  EXPECT_EQ(memory(), 0);
  write("sys/fs/cgroup/jobs/memory.max", "500000000\n");
  EXPECT_EQ(memory(), 5e8);
}

TEST_F(ControlGroups, GarbledFilesAreNoLimit) {
  write("proc/self/cgroup", "0::/a\nx\n:\n");
  for (const char* text : {"", "x y", "100000", "-5 100000", "100000 0", "nan 100000"}) {
    write("sys/fs/cgroup/a/cpu.max", text);
    EXPECT_EQ(processors(), 0) << text;
    write("sys/fs/cgroup/a/memory.max", std::string("-") + text);
    EXPECT_EQ(memory(), 0) << text;
  }
}

TEST(DefaultThreads, AreAsManyAsTheEnvironmentSays) {
  const int before = omp_get_max_threads();
  setenv("OMP_NUM_THREADS", "3", 1);
  omp_set_num_threads(3);  // as the runtime does when it starts
  EXPECT_EQ(default_threads(), 3);
  unsetenv("OMP_NUM_THREADS");
  EXPECT_LE(default_threads(), 3);
  EXPECT_GE(default_threads(), 1);
  omp_set_num_threads(before);
}

}  // namespace test_machine
