// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "hexmesh/scan/image_io.h"

namespace hexmesh {

enum class VolumeFormat { nrrd, nifti, nifti_gz, meta, vti, dicom, unknown };

/// Told from the first bytes.
/// @throws Error{input} if the file cannot be read
VolumeFormat detect_format(const std::filesystem::path& path);

/// What a header promises, checked before a library sees the file.
struct VolumeHeader {
  std::optional<Grid> grid;   ///< where the format's own rules decide (NIfTI)
  bool has_space = true;      ///< whether the header says which way is left
  std::uintmax_t values = 0;  ///< in all; the library must find the same number
};

// Each refuses a header that contradicts itself, promises more than the file (or the memory limit) holds, or names data
// outside its own folder.
// @throws Error{input}
VolumeHeader check_nrrd(const std::filesystem::path& path, const ReadOptions& options);
VolumeHeader check_meta(const std::filesystem::path& path, const ReadOptions& options);

/// @throws Error{input} if the voxels of one input need more than the limit
void check_memory(const std::filesystem::path& path, std::uintmax_t bytes, const ReadOptions& options);

/// @param best_compression  how many bytes one byte of the file can become
/// @throws Error{input} if the file cannot hold so many bytes of voxels
void check_plausible(const std::filesystem::path& path, std::uintmax_t bytes, std::uintmax_t best_compression);

/// Bytes promised by three or more extents and the size of a value.
/// @throws Error{input} if an extent is not positive or the product does not fit
std::uintmax_t promised_bytes(const std::filesystem::path& path, const std::vector<std::int64_t>& extents,
                              std::size_t value_size);

}  // namespace hexmesh
