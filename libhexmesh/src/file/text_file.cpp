// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/file/text_file.h"

#include <fmt/format.h>

#include <fstream>
#include <iterator>

#include "hexmesh/core/error.h"

namespace hexmesh {

std::string read_text_file(const std::filesystem::path& path, const std::string& display_name,
                           std::uintmax_t most_bytes) {
  const auto refuse = [&](const std::string& what) {
    throw Error(ErrorKind::input, fmt::format("'{}' {}", display_name, what));
  };
  std::error_code failed;
  const std::filesystem::file_status status = std::filesystem::status(path, failed);
  if (!std::filesystem::exists(status)) refuse(fmt::format("cannot be read: {}, expected a file", failed.message()));
  if (!std::filesystem::is_regular_file(status)) refuse("is no file, expected one");
  const std::uintmax_t bytes = std::filesystem::file_size(path, failed);
  if (failed || bytes > most_bytes)
    refuse(fmt::format("has more than {} MB, expected a text that people write", most_bytes >> 20));
  std::ifstream file(path, std::ios::binary);
  if (!file) refuse("cannot be read, expected a readable file");
  std::string text((std::istreambuf_iterator<char>(file)), {});
  if (file.bad()) refuse("cannot be read to its end, expected a readable file");
  return text;
}

void write_whole_file(const std::filesystem::path& path, std::string_view bytes) {
  std::ofstream file(path, std::ios::binary);
  file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  if (!file.flush())
    throw Error(ErrorKind::output, fmt::format("cannot write '{}', expected room for it", path.string()));
}

}  // namespace hexmesh
