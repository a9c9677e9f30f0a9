// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <string>

#include "hexmesh/core/error.h"

/// Files, commands and messages.
namespace testing_support {

/// A folder that goes away with this object.
class TemporaryFolder {
public:
  TemporaryFolder();
  ~TemporaryFolder();
  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }
  std::string path(const std::string& name) const { return (path_ / name).string(); }

private:
  std::filesystem::path path_;
};

std::string read_text(const std::filesystem::path& path);
void write_text(const std::filesystem::path& path, const std::string& text);

struct CommandResult {
  int exit_code;
  std::string output, errors;
};

/// Run a shell command with the project's tools first on the PATH.
CommandResult shell(const std::string& command);

/// Real scans beside the project; tests that need them skip where they are not.
std::filesystem::path shared_data();

/// The message of the Error that f throws; fails the test if it throws none of that kind.
template <class F>
std::string message_of(hexmesh::ErrorKind kind, F&& f) {
  try {
    f();
  } catch (const hexmesh::Error& e) {
    EXPECT_EQ(e.kind(), kind) << e.what();
    return e.what();
  }
  ADD_FAILURE() << "no error was thrown";
  return "";
}

}  // namespace testing_support
