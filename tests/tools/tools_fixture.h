// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

#include "support/files.h"

namespace testing_support {

/// A phantom, its lattice and a scene, made once for all tests of a process.
class Tools : public testing::Test {
protected:
  static void SetUpTestSuite() {
    folder = new TemporaryFolder;
    const std::string at = "cd '" + folder->path("") + "' && ";
    ASSERT_EQ(shell(at + "hexscan phantom liver --spacing 4 --intensity-out ct.nrrd -o liver.nrrd").exit_code, 0);
    ASSERT_EQ(
        shell(at + "hexmesh build liver.nrrd --material '*:young_kpa=100,poisson=0.3' -o liver.hexmesh").exit_code, 0);
    ASSERT_EQ(shell(at + "hexsolve liver.hexmesh --example -o liver.toml").exit_code, 0);
  }
  static void TearDownTestSuite() { delete folder; }

  static CommandResult run(const std::string& command) { return shell("cd '" + folder->path("") + "' && " + command); }

  /// Exit code, exactly one line of error that starts with the tool's name and holds the words, and no new file.
  static void expect_failure(const std::string& command, int code, const std::vector<std::string>& words) {
    const auto before = listing();
    const CommandResult r = run(command);
    EXPECT_EQ(r.exit_code, code) << command << "\n" << r.errors;
    EXPECT_EQ(std::count(r.errors.begin(), r.errors.end(), '\n'), 1) << r.errors;
    EXPECT_EQ(r.errors.find(command.substr(0, command.find(' ')) + ": error: "), 0U) << r.errors;
    for (const std::string& word : words) EXPECT_NE(r.errors.find(word), std::string::npos) << r.errors;
    EXPECT_EQ(r.output, "");
    EXPECT_EQ(listing(), before) << command;
  }

  static std::vector<std::string> listing() {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(*folder / "")) names.push_back(entry.path().string());
    std::sort(names.begin(), names.end());
    return names;
  }

  static inline TemporaryFolder* folder = nullptr;
};

}  // namespace testing_support
