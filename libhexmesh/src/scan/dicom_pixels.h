// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <vector>

namespace hexmesh {

/// Pixels as their file stores them, unpacked; those of fewer stored than allocated bits have their sign extended.
struct DicomPixels {
  std::vector<char> bytes;  ///< all frames one after the other, in this machine's byte order
  int bits = 16;            ///< of a pixel: 8, 16 or 32
  bool is_signed = false;
};

/// Uncompressed, deflated, RLE, JPEG and JPEG-LS by DCMTK, JPEG 2000 by GDCM.
/// @throws Error{input}
DicomPixels decode_pixels(const std::filesystem::path& path);

}  // namespace hexmesh
