// SPDX-License-Identifier: Apache-2.0
#include "cli/checksum.h"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <memory>
#include <vector>

#include "hexmesh/core/error.h"
#include "hexmesh/core/sha256.h"

namespace hextools {
namespace {

/// Of a file, or of all files of a folder.
std::string sha256(const std::filesystem::path& path) {
  std::vector<std::filesystem::path> files = {path};
  if (std::filesystem::is_directory(path)) {
    files.clear();
    std::error_code failed;  // of a link that leads to no file
    for (const auto& entry : std::filesystem::recursive_directory_iterator(
             path, std::filesystem::directory_options::skip_permission_denied))
      if (entry.is_regular_file(failed)) files.push_back(entry.path());
    std::sort(files.begin(), files.end());
  }
  hexmesh::Sha256 sum;
  constexpr std::size_t size = 1 << 16;
  const auto block = std::make_unique_for_overwrite<char[]>(size);
  for (const std::filesystem::path& file : files) {
    std::ifstream in(file, std::ios::binary);
    if (!in) throw hexmesh::Error(hexmesh::ErrorKind::input, fmt::format("cannot read '{}'", file.string()));
    while (in.read(block.get(), size), in.gcount() > 0) sum.add(block.get(), static_cast<std::size_t>(in.gcount()));
  }
  return sum.digits();
}

}  // namespace

std::string checksum_line(const std::string& name, const std::filesystem::path& path) {
  return sha256(path) + "  " + name;
}

}  // namespace hextools
