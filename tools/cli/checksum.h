// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

namespace hextools {

/// SHA-256, two blanks and the name of a file, as sha256sum prints them. A folder's is that of its files' contents one
/// after the other, sorted by name.
/// @param name  as on the command line
std::string checksum_line(const std::string& name, const std::filesystem::path& path);

}  // namespace hextools
