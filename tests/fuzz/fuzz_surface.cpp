// SPDX-License-Identifier: Apache-2.0
// Surface files: the first byte chooses the ending.
#include <array>

#include "fuzz_target.h"
#include "hexmesh/surface/surface_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  static const std::array<std::string, 5> endings = {".obj", ".stl", ".ply", ".off", ".vtp"};
  const auto path = fuzzing::file_of(data + 1, size - 1, endings[data[0] % endings.size()]);
  fuzzing::read_or_refuse([&] { hexmesh::read_shape(path); });
  return 0;
}
