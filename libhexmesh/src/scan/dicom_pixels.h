// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <vector>

class DcmFileFormat;

namespace hexmesh {

/// Pixels as their file stores them, unpacked; those of fewer stored than allocated bits have their sign extended.
struct DicomPixels {
  std::vector<char> bytes;  ///< all frames one after the other, in this machine's byte order
  int bits = 16;            ///< of a pixel: 8, 16 or 32
  bool is_signed = false;
};

/// Pixel bytes as DCMTK unpacks them, words in this machine's byte order.
/// @throws Error{input} where it does not know the transfer syntax, or the data are damaged
std::vector<char> unpack_pixels(const std::filesystem::path& path, DcmFileFormat& file);

/// Uncompressed, deflated, RLE, JPEG and JPEG-LS by DCMTK, JPEG 2000 by GDCM.
/// @throws Error{input}
DicomPixels decode_pixels(const std::filesystem::path& path);

}  // namespace hexmesh
