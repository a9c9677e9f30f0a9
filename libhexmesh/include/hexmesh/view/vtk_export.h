// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "hexmesh/result/result.h"

namespace hexmesh {

/// Whether files hold the rest shape with the displacement as point data, or the deformed shape (and the data too).
enum class Configuration { rest, deformed };

/// The mechanical level as hexahedra (.vtu, VTK XML): point data `displacement` [mm] unless at rest, `displacement_raw`
/// [mm] if the result has it, `velocity` [mm/s] of a motion, `load` [N] of forces and gravity at rest, `contact_force`
/// [N] of obstacles; cell data `segment` (label), `segment_color` (RGB, 0 to 255) and every cell field of the result;
/// field data `segments` and `units`.
/// @param path  ends in .vtu
/// @throws Error{output}
void write_vtu(const Result& result, Configuration configuration, const std::filesystem::path& path);

/// The embedded surface as triangles (.vtp, VTK XML): point data `displacement` [mm] unless at rest, cell data
/// `segment` (label) and `segment_color`.
/// @param path  ends in .vtp
/// @throws Error{output}
void write_vtp(const Result& result, Configuration configuration, const std::filesystem::path& path);

/// What a condition came to.
struct ConditionForce {
  std::string name;
  Vec3 reaction;  ///< force of the support on the body [N]
};

/// The points that conditions hold (.vtp, VTK XML), as vertices: point data `name`, `condition` (number),
/// `displacement` [mm], `axes` (1 = this component is prescribed) and `reaction` [N], that of the whole condition.
/// @param forces  in the order of the result's conditions
/// @param path  ends in .vtp
/// @throws Error{output}
void write_conditions_vtp(const Result& result, const std::vector<ConditionForce>& forces, Configuration configuration,
                          const std::filesystem::path& path);

/// A list of files and the times that they show (.pvd, ParaView's), which names them relative to its own folder.
/// @throws Error{output}
void write_pvd(const std::vector<std::pair<double, std::string>>& files, const std::filesystem::path& path);

}  // namespace hexmesh
