// SPDX-License-Identifier: Apache-2.0
// Scenes and materials: the first byte chooses.
#include "fuzz_target.h"
#include "hexmesh/file/material_file.h"
#include "hexsolver/scene/scene.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const auto path = fuzzing::file_of(data + 1, size - 1, ".toml");
  fuzzing::read_or_refuse([&] {
    if (data[0] % 2 == 0)
      hexsolver::read_scene(path, path.string(), {});
    else
      hexmesh::read_materials(path, path.string());
  });
  return 0;
}
