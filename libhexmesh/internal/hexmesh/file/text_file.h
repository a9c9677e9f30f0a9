// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include "hexmesh/file/atomic_file.h"

namespace hexmesh {

/// All of a text that is kept in memory.
/// @param display_name  of the file in messages
/// @throws Error{input} for what is no file, or has more than `most_bytes`
std::string read_text_file(const std::filesystem::path& path, const std::string& display_name,
                           std::uintmax_t most_bytes = most_text_bytes);

/// Write a file from memory, text or not. @throws Error{output} also where there is no room
void write_whole_file(const std::filesystem::path& path, std::string_view bytes);

}  // namespace hexmesh
