// SPDX-License-Identifier: Apache-2.0
#include "fuzz_target.h"

#include <fmt/format.h>
#include <unistd.h>

#include <fstream>

/// The libraries leak where they refuse a file.
extern "C" const char* __asan_default_options() { return "detect_leaks=0:allocator_may_return_null=0"; }

namespace fuzzing {

std::filesystem::path file_of(const std::uint8_t* data, std::size_t size, const std::string& ending) {
  const std::filesystem::path memory = "/dev/shm";
  const std::filesystem::path folder =
      std::filesystem::is_directory(memory) ? memory : std::filesystem::temp_directory_path();
  static const struct Removed {
    std::filesystem::path folder;
    ~Removed() {
      std::error_code ignored;
      std::filesystem::remove_all(folder, ignored);
    }
  } own{folder / fmt::format("hextools-fuzz-{}", getpid())};
  std::filesystem::create_directories(own.folder);
  const std::filesystem::path path = own.folder / ("input" + ending);
  std::ofstream(path, std::ios::binary).write(reinterpret_cast<const char*>(data), static_cast<std::streamsize>(size));
  return path;
}

}  // namespace fuzzing
