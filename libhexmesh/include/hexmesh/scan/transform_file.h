// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "hexmesh/warp/displacement_field.h"

namespace hexmesh {

/// Write a displacement field as an ITK transform, x -> x + d(x), linear between voxel centres and the identity beyond
/// the outermost ones: an itk::DisplacementFieldTransform (.h5; 3D Slicer and ITK open it as a transform), or an image
/// of vectors (.nrrd, .nii.gz, .nii, .mha; ANTs and SimpleITK). LPS, mm.
/// @throws Error{output}
void write_transform(const DisplacementField& field, const std::filesystem::path& path);

}  // namespace hexmesh
