// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "hexmesh/file/result_file.h"

namespace hextools {

/// The model that was solved as a CalculiX deck (.inp).
/// @throws Error{input} naming what a deck does not hold
void write_deck(const hexmesh::Result& result, const std::filesystem::path& path);

}  // namespace hextools
