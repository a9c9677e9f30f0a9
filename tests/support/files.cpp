// SPDX-License-Identifier: Apache-2.0
#include "files.h"

#include <sys/wait.h>

#include <cstdlib>
#include <fstream>
#include <sstream>

namespace testing_support {

TemporaryFolder::TemporaryFolder() {
  std::string pattern = (std::filesystem::temp_directory_path() / "hextools-test-XXXXXX").string();
  path_ = mkdtemp(pattern.data());
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

std::string read_text(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

void write_text(const std::filesystem::path& path, const std::string& text) {
  std::ofstream(path, std::ios::binary) << text;
}

CommandResult shell(const std::string& command) {
  const TemporaryFolder folder;
  const std::string line = "export PATH='" HEXTOOLS_BIN "':\"$PATH\"; ( " + command + " ) >'" + folder.path("out") +
                           "' 2>'" + folder.path("err") + "'";
  const int status = std::system(line.c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status), read_text(folder / "out"),
          read_text(folder / "err")};
}

std::filesystem::path shared_data() { return std::filesystem::path(HEXTOOLS_SOURCE) / ".." / "shared"; }

}  // namespace testing_support
