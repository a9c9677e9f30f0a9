// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>

#include "hexmesh/file/toml_reader.h"
#include "hexsolver/scene/scene.h"

// What read_scene() reads the tables of a scene with. All throw Error{input} with the place in the file.

namespace hexsolver {

using hexmesh::TomlReader;

inline constexpr double infinity = std::numeric_limits<double>::infinity();

/// "solve.strain=corotational" or "displace.0.by_mm=[1,2,3]".
/// @throws Error{usage}
void apply_setting(toml::table& root, const std::string& setting);

/// A scene from the tables of a file.
Scene read_scene(toml::table root, const std::string& display_name, const std::vector<std::string>& settings,
                 const std::filesystem::path& folder);

/// What [solve] says of other tables.
struct SolveTable {
  bool moves = false;      ///< the scene is a motion
  bool is_loaded = false;  ///< the lattice shows the body under [loaded]
  std::optional<RestMethod> rest_method;
};
SolveTable read_solve(TomlReader table, Scene& scene);

/// [dynamics].
/// @param folder  that relative paths are relative to
Dynamics read_dynamics(TomlReader table, const std::filesystem::path& folder);

/// [damping].
Damping read_damping(TomlReader table);

/// { point_mm, normal } of a key.
HalfSpace read_halfspace(TomlReader& table, const char* key);

/// What a condition or a force selects.
/// @param line  receives the two ends of a markup that is a line, in a [[displace]]
Selection read_selection(TomlReader& table, const std::filesystem::path& folder, const std::string& condition,
                         std::optional<std::array<Vec3, 2>>& line);

/// [[fix]] or [[displace]].
/// @param number  counts those of its kind, from 1
Condition read_condition(TomlReader table, const std::string& kind, const std::filesystem::path& folder,
                         const std::optional<Dynamics>& dynamics, std::size_t number);

/// [[force]].
Force read_force(TomlReader table, const std::filesystem::path& folder, const std::optional<Dynamics>& dynamics,
                 std::size_t number);

/// [gravity] and [loaded.gravity]: in mm/s^2.
/// @param name  with its brackets
Vec3 read_gravity(TomlReader table, const std::string& name, std::vector<std::string>& warnings);

/// [loaded].
Loaded read_loaded(TomlReader table, const std::filesystem::path& folder, RestMethod method,
                   std::vector<std::string>& warnings);

/// A table of rows [t, ...] of a motion, `count` values each, as vectors; nothing if there is none.
std::optional<History> read_history(TomlReader& table, std::size_t count, const char* values,
                                    const std::optional<Dynamics>& dynamics);

/// The key velocity_mm_s, as displacements of a motion; nothing if there is none.
std::optional<History> read_velocity(TomlReader& table, const std::optional<Dynamics>& dynamics);

/// { axis, degrees, about_mm } of a key `rotate`; without the degrees beside a table of them.
Turn read_turn(TomlReader table, bool has_history);

/// [[contact]].
/// @param folder  that relative paths are relative to
Contact read_contact(TomlReader table, const std::filesystem::path& folder, const std::optional<Dynamics>& dynamics,
                     std::size_t number);

/// [[prestress]].
Prestress read_prestress(TomlReader table);

/// [[match]].
/// @param folder  that relative paths are relative to
Match read_match(TomlReader table, const std::filesystem::path& folder, std::size_t number);

}  // namespace hexsolver
