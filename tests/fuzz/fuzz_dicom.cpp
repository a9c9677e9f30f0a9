// SPDX-License-Identifier: Apache-2.0
// A DICOM file: image, SEG or RTSTRUCT, as a scan and as a segmentation with a scan to lie on.
#include "fuzz_target.h"
#include "hexmesh/scan/summary.h"
#include "scan/volume_header.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto path = fuzzing::file_of(data, size, ".dcm");
  hexmesh::ReadOptions options = fuzzing::small_memory();
  options.reference = hexmesh::Grid({8, 7, 6}, {1, 1, 2});
  fuzzing::read_or_refuse([&] {
    if (hexmesh::detect_format(path) == hexmesh::VolumeFormat::dicom) hexmesh::summarize({path}, options);
  });
  return 0;
}
