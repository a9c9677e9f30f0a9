// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "hexmesh/result/result.h"

namespace hexmesh {

/// The mechanical level as hexahedra in one HDF5 file (.hdf, VTKHDF 1.0, which VTK 9.1 and ParaView 5.10 read): points
/// at rest or deformed as asked, with the point and cell data of a .vtu. Source: "VTKHDF file format", VTK
/// documentation; version 1.0, UnstructuredGrid.
/// @param deformed  whether the points are moved; the displacement is point data either way
/// @throws Error{output}
void write_vtkhdf(const Result& result, bool deformed, const std::filesystem::path& path);

}  // namespace hexmesh
