// SPDX-License-Identifier: Apache-2.0
// Image files: which one is told by the macro READS.
#include "fuzz_target.h"
#include "hexmesh/scan/summary.h"
#include "scan/volume_header.h"

using hexmesh::VolumeFormat;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto path = fuzzing::file_of(data, size, "");
  fuzzing::read_or_refuse([&] {
    const VolumeFormat format = hexmesh::detect_format(path);
    const bool packed = VolumeFormat::READS == VolumeFormat::nifti && format == VolumeFormat::nifti_gz;
    if (format == VolumeFormat::READS || packed) hexmesh::summarize({path}, fuzzing::small_memory());
  });
  return 0;
}
