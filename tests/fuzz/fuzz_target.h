// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>

#include "hexmesh/core/error.h"
#include "hexmesh/scan/image_io.h"

namespace fuzzing {

/// The bytes as a file in memory; one name per process and ending.
std::filesystem::path file_of(const std::uint8_t* data, std::size_t size, const std::string& ending);

/// Small enough that a wild allocation is seen.
inline hexmesh::ReadOptions small_memory() {
  hexmesh::ReadOptions options;
  options.max_memory = 16'000'000;
  return options;
}

/// Refusing is right; anything else thrown is a finding.
template <class Read>
void read_or_refuse(Read&& read) {
  try {
    read();
  } catch (const hexmesh::Error&) {
  }
}

}  // namespace fuzzing
