// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "hexmesh/file/markup.h"
#include "hexmesh/lattice/lattice.h"
#include "hexsolver/elastic.h"

namespace hexsolver {

enum class SurfacePoints {
  faces,   ///< centres of exposed voxel faces
  voxels,  ///< barycentres of boundary voxels, the paper's
  nodes    ///< lattice nodes that touch an empty or missing cell: ordinary finite elements
};

/// All points within `radius` of `center`; radius 0 = the one nearest point.
struct Ball {
  Vec3 center;    ///< [mm]
  double radius;  ///< [mm]
};

struct HalfSpace {
  Vec3 point, normal;  ///< points p with (p - point) . normal >= 0
};

/// Where a condition acts: the points in any of the balls, the box, the half-space or beside the segment.
struct Selection {
  std::vector<Ball> balls;
  std::optional<hexmesh::Box> box;
  std::optional<HalfSpace> halfspace;
  std::string segment;  ///< boundary shared with this segment; empty = not asked
  SurfacePoints on = SurfacePoints::faces;
  double max_distance = 5;  ///< of a ball's centre from the surface [mm]
};

/// A [[fix]] or [[displace]] of the scene.
struct Condition {
  std::string name;
  std::string where;  ///< file:line of its table, for messages
  Selection selection;
  Vec3 by = Vec3::Zero();  ///< [mm]; zero for a fix
  std::array<bool, 3> axes = {true, true, true};
};

/// A [[force]] of the scene: dead loads, which keep their direction while the body moves.
struct Force {
  std::string name;
  std::string where;  ///< file:line of its table, for messages
  Selection selection;
  Vec3 total = Vec3::Zero();  ///< [N], spread over the selected faces by area, over voxels or nodes evenly
  double pressure = 0;        ///< [MPa] onto the selected faces
};

/// Names the force in reports, apart from other effects.
inline std::string load_name(const Force& force) { return "force '" + force.name + "'"; }

/// A [[contact]] of the scene: an obstacle that the body may not enter.
struct Contact {
  std::string name;
  std::string where;                       ///< file:line of its table, for messages
  std::variant<HalfSpace, Ball> obstacle;  ///< the body stays in the half-space, or out of the ball
  Vec3 by = Vec3::Zero();                  ///< how far the obstacle moves [mm]
  double stiffness = 0;                    ///< of each surface point inside it [N/mm]
};

inline std::string contact_name(const Contact& contact) { return "contact '" + contact.name + "'"; }

/// What [material.NAME] replaces.
struct MaterialOverride {
  std::string where;  ///< file:line of its table, for messages
  std::optional<double> young_kpa, poisson, density_kg_m3;
};

/// What is done about parts of the body that nothing holds.
enum class Islands {
  error,
  drop,  ///< their voxels are left out
  hold   ///< springs hold them where they are; those that hang on other parts by an edge or a corner are left out
};

/// A scene file. Units inside: mm, N, MPa, s.
struct Scene {
  Elasticity elasticity = Elasticity::corotational;
  bool finds_strain = false;  ///< strain = "auto": Cauchy where rotations change less than the accuracy
  Rotation rotation = Rotation::polar;
  Volumetric volumetric = Volumetric::mean;
  Stiffness stiffness = Stiffness::exact;
  std::optional<int> level;        ///< mechanical level; nothing = the finest of at most 20000 cells
  std::optional<double> accuracy;  ///< solve to the first level whose estimated mean error is at most this [mm]
  std::optional<double> budget;    ///< solve as many levels as this allows [s]
  double tolerance = 1e-8;
  Islands islands = Islands::error;
  bool compromise = false;  ///< conditions that contradict each other are met by least squares
  std::map<std::string, MaterialOverride> materials;
  std::vector<Condition> conditions;
  std::vector<Force> forces;
  std::vector<Contact> contacts;
  Vec3 gravity = Vec3::Zero();  ///< [mm/s^2]
};

/// Read a scene (TOML). Relative paths of markups are relative to the scene file.
/// @param settings  "solve.strain=corotational" overrides a key of the file before it is checked
/// @throws Error{input} "file:line:column: key, what was expected"; Error{usage} for a bad setting
Scene read_scene(const std::filesystem::path& path, const std::string& display_name,
                 const std::vector<std::string>& settings = {});

/// The same lattice with the scene's [material.*] in place of its own.
/// @throws Error{input} for an unknown segment or a bad value
hexmesh::Lattice with_overrides(hexmesh::Lattice lattice, const Scene& scene);

/// A commented scene for any lattice: the paper's liver experiment, three places on the surface held and a fourth
/// pulled by 40 mm.
std::string example_scene(const hexmesh::Lattice& lattice);

}  // namespace hexsolver
