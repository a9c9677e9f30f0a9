// SPDX-License-Identifier: Apache-2.0
// Results likewise; the first byte chooses a changed file, or the rest as the JSON of a report.
#include "lying_input.h"
#include "support/small_lattice.h"
#include "use_files.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  if (data[0] % 2 == 1) {
    hexmesh::Result result{hexmesh::Grid({1, 1, 1}, {1, 1, 1}), {}, {}};
    result.report.assign(data + 1, data + size);
    fuzzing::read_or_refuse([&] { hextools::report_of(result); });
    return 0;
  }
  static const fuzzing::LyingInput input([](const auto& path) { testing_support::write_small_result(path); });
  const auto path = input.file_of(data + 1, size - 1);
  fuzzing::read_or_refuse([&] { fuzzing::use_result(path); });
  return 0;
}
