// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <zlib.h>

#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

namespace hexmesh {

/// At most `count` bytes from the start of a file.
/// @throws Error{input} if it cannot be read
std::string first_bytes(const std::filesystem::path& path, std::size_t count);

/// A gzip or zlib stream that starts somewhere in a file.
class Inflater {
public:
  Inflater(const std::filesystem::path& path, std::uintmax_t offset);
  ~Inflater();
  Inflater(const Inflater&) = delete;
  Inflater& operator=(const Inflater&) = delete;

  /// @returns bytes written, fewer than asked only at the end of the data
  /// @throws Error{input} where the data are cut or damaged
  std::size_t read(char* to, std::size_t count);

private:
  void refill();

  std::filesystem::path path_;
  std::ifstream file_;
  std::vector<char> input_;
  z_stream stream_{};
  std::uintmax_t total_ = 0;
  bool ended_ = false;
};

}  // namespace hexmesh
