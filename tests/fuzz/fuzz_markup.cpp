// SPDX-License-Identifier: Apache-2.0
// Markups: the first byte chooses JSON or a fiducial list.
#include "fuzz_target.h"
#include "hexmesh/file/markup_file.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const auto path = fuzzing::file_of(data + 1, size - 1, data[0] % 2 == 0 ? ".mrk.json" : ".fcsv");
  fuzzing::read_or_refuse([&] { hexmesh::read_markup(path); });
  return 0;
}
