// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "hexmesh/file/result_file.h"

namespace hexmesh {

/// Whether files hold the rest shape with the displacement as point data, or the deformed shape (and the data too).
enum class Configuration { rest, deformed };

/// The mechanical level as hexahedra (.vtu, VTK XML): point data `displacement` [mm] unless at rest and `velocity`
/// [mm/s] of a motion; cell data `segment` (label) and every cell field of the result.
/// @param path  ends in .vtu
/// @throws Error{output}
void write_vtu(const Result& result, Configuration configuration, const std::filesystem::path& path);

/// The embedded surface as triangles (.vtp, VTK XML): point data `displacement` [mm] unless at rest, cell data
/// `segment` (label).
/// @param path  ends in .vtp
/// @throws Error{output}
void write_vtp(const Result& result, Configuration configuration, const std::filesystem::path& path);

/// A list of files and the times that they show (.pvd, ParaView's), which names them relative to its own folder.
/// @throws Error{output}
void write_pvd(const std::vector<std::pair<double, std::string>>& files, const std::filesystem::path& path);

}  // namespace hexmesh
