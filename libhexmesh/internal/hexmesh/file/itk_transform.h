// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "hexmesh/warp/displacement_field.h"

namespace hexmesh {

/// A displacement field as ITK's HDF5TransformIO reads it, an itk::DisplacementFieldTransform<double, 3>. ITK's own
/// writer tells the time and the machine: the same field would be other bytes from run to run.
/// @throws Error{output}
void write_itk_transform(const DisplacementField& field, const std::filesystem::path& path);

}  // namespace hexmesh
