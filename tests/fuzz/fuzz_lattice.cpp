// SPDX-License-Identifier: Apache-2.0
// Lattice files that are valid and lie: what is read is used as tools do.
#include "lying_input.h"
#include "support/small_lattice.h"
#include "use_files.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const fuzzing::LyingInput input([](const auto& path) {
    hexmesh::write_lattice(testing_support::small_lattice(), path, hexmesh::MatrixStorage::all);
  });
  const auto path = input.file_of(data, size);
  fuzzing::read_or_refuse([&] { fuzzing::use_lattice(path); });
  return 0;
}
