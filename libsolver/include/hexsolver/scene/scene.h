// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "hexmesh/file/lattice_file.h"
#include "hexmesh/geometry/box.h"
#include "hexmesh/geometry/solid.h"
#include "hexmesh/lattice/lattice.h"
#include "hexsolver/core/vectors.h"
#include "hexsolver/scene/history.h"
#include "hexsolver/scene/law.h"

namespace hexsolver {

inline constexpr int most_levels = 30;  ///< that anybody names

enum class SurfacePoints {
  faces,   ///< centres of exposed voxel faces
  voxels,  ///< barycentres of boundary voxels, the paper's
  nodes    ///< lattice nodes that touch an empty or missing cell: ordinary finite elements
};

using hexmesh::Ball;
using hexmesh::HalfSpace;

/// Where a condition acts: the points in any of the balls, the box, the half-space or beside the segment.
struct Selection {
  std::vector<Ball> balls;
  std::optional<hexmesh::Box> box;
  std::optional<HalfSpace> halfspace;
  std::string segment;  ///< boundary shared with this segment; empty = not asked
  SurfacePoints on = SurfacePoints::faces;
  double max_distance = 5;       ///< of a ball's centre from the surface [mm]
  std::filesystem::path markup;  ///< the file that balls or box come from; empty = none
};

/// A rotation about an axis in space.
struct Turn {
  Vec3 axis = Vec3::UnitZ();  ///< of length 1
  double radians = 0;
  Vec3 about = Vec3::Zero();  ///< a point of the axis [mm]
};

/// A [[fix]] or [[displace]] of the scene. In a motion `by` and `turn` are reached evenly at its end.
struct Condition {
  std::string name;
  std::string where;  ///< file:line of its table, for messages
  Selection selection;
  Vec3 by = Vec3::Zero();  ///< [mm]; zero for a fix
  std::array<bool, 3> axes = {true, true, true};
  std::optional<Turn> turn = {};        ///< in place of `by`
  std::optional<History> history = {};  ///< in place of `by` [mm], or of the angle of `turn` (first component, [rad])
};

/// Names one in messages, with its place in the file: "condition 'hilum' (scene.toml:7:1)".
template <class Named>
std::string with_place(const char* kind, const Named& named) {
  return std::string(kind) + " '" + named.name + "' (" + named.where + ")";
}

/// Where a condition moves a point of the body, from its rest position [mm].
Vec3 prescribed_displacement(const Condition& condition, const Vec3& rest, const Progress& progress);

/// A [[force]] of the scene: dead loads, which keep their direction while the body moves, or a pressure that follows.
struct Force {
  std::string name;
  std::string where;  ///< file:line of its table, for messages
  Selection selection;
  Vec3 total = Vec3::Zero();            ///< [N], spread over the selected faces by area, over voxels or nodes evenly
  double pressure = 0;                  ///< [MPa] onto the selected faces
  bool follows = false;                 ///< onto them as they are now, see FollowerPressure
  std::optional<History> history = {};  ///< in place of `total` [N], or a factor of `pressure` (all components alike)
};

/// Names the force in reports, apart from other effects.
inline std::string load_name(const Force& force) { return "force '" + force.name + "'"; }

/// A [[contact]] of the scene: an obstacle that the body may not enter, or two segments that may not enter each other.
struct Contact {
  std::string name;
  std::string where;                    ///< file:line of its table, for messages
  hexmesh::Solid obstacle;              ///< the body stays out of it; in a half-space
  Vec3 by = Vec3::Zero();               ///< how far the obstacle moves [mm]
  double stiffness = 0;                 ///< of each surface point inside it [N/mm]; 0: found, see is_hard()
  std::optional<History> history = {};  ///< in place of `by` [mm], or of the angle of `turn` (first component, [rad])
  double friction = 0;                  ///< mu of Coulomb's law
  std::optional<Turn> turn = {};        ///< in place of `by`
  std::filesystem::path file = {};      ///< that a closed surface comes from; empty = none
  bool grows = false;                   ///< what it exerts grows with the load, as what acts in a [loaded]
  std::optional<std::pair<std::string, std::string>> between = {};  ///< segments, in place of an obstacle
  bool adhesion = false;  ///< segments that touch at rest do not part, they slide
  /// What does not pass through itself, in place of an obstacle: a segment with all that its cells hold together with
  /// it, but for what slides along one of these; empty: the whole body.
  std::optional<std::string> self = {};

  bool is_within_body() const { return between || self; }
};

/// Where an obstacle is then, from where the scene puts it.
Eigen::Isometry3d place_of(const Contact& contact, const Progress& progress);

/// A [[match]] of the scene: what the deformed body is to lie on, seen now. One of the two kinds.
struct Match {
  std::string name;
  std::string where;                           ///< file:line of its table, for messages
  std::filesystem::path file;                  ///< that the target comes from; empty: it is given
  hexmesh::TriangleSurface target;             ///< a surface, whole or in part
  std::string segment;                         ///< of the body, whose surface is to lie there; empty: of the only one
  std::optional<bool> is_partial;              ///< the target is a part of the surface; nothing: if it is open
  std::optional<double> outliers;              ///< what is far [mm], see Influence; 0: nothing; nothing: found
  std::vector<std::filesystem::path> markups;  ///< that landmarks come from
  std::vector<Vec3> from, to;                  ///< landmarks at rest and where they are to be [mm]
  double trust = 0;  ///< distance left where the body resists with a tenth of its Young's modulus [mm]; 0: found

  bool is_of_landmarks() const { return !from.empty(); }
};

/// A [[prestress]] of the scene: what tissue is under in the shape that the lattice shows. One of the two, both
/// symmetric, in patient space.
struct Prestress {
  std::string segment;          ///< whose tissue
  std::string where;            ///< file:line of its table, for messages
  std::optional<Mat3> stretch;  ///< from where the tissue is free of stress to its place
  std::optional<Mat3> stress;   ///< Cauchy's, tension positive [MPa]
};

inline std::string prestress_name(const Prestress& prestress) { return "prestress '" + prestress.segment + "'"; }

inline std::string match_name(const Match& match) { return "match '" + match.name + "'"; }

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
  hold   ///< springs hold them where they are; those that touch other parts by an edge or a corner are left out
};

/// What holds of a patch of faces.
enum class Supports {
  area,   ///< the displacement as a function on its area
  soft,   ///< likewise above level 0: its mean over what cells see firmly, what varies within them by springs
  points  ///< that of the faces' centres, as in the paper
};

/// How large the cells of a level are.
enum class Grading {
  off,   ///< all alike
  scene  ///< smaller where supports, forces and gaps end and obstacles press
};

/// What the error of the last level is estimated from.
enum class ErrorEstimation {
  automatic,  ///< look where the next finer level has at most most_cells_looked_at
  look,       ///< at finer levels, solved roughly: the next, and on to one that has cells enough
  off         ///< not at all, unless an accuracy is asked
};
constexpr std::size_t most_cells_looked_at = 50000;

/// How the linear equations of a step of motion are solved.
enum class StepSolver {
  cg,        ///< conjugate gradients that leave the supports alone, as in the paper
  jacobi,    ///< preconditioned by the 3x3 blocks of the diagonal
  multigrid  ///< preconditioned by one V-cycle
};

/// How a motion goes from step to step.
enum class Integrator {
  implicit_euler,  ///< first order, as in the paper
  bdf2             ///< second order, the backward difference of two steps
};

/// The [dynamics] of a scene.
struct Dynamics {
  double step = 0;      ///< [s]
  double duration = 0;  ///< [s]
  int output_every = 1;
  bool fields_in_every_state = true;  ///< states that are kept have stresses and strains; else the last has
  Integrator integrator = Integrator::implicit_euler;
  StepSolver solver = StepSolver::multigrid;
  int solver_iterations = 0;     ///< of each Newton step; 0 = as many as solve.tolerance takes
  int newton_iterations = 0;     ///< of each step; 0 = as many as solve.tolerance takes
  Vec3 velocity = Vec3::Zero();  ///< of all points at the start [mm/s]
  std::filesystem::path start;   ///< a result whose last state is the first; empty = at rest

  /// The last ends at `duration` or less than a step later.
  int num_steps() const { return static_cast<int>(std::ceil(duration / step * (1 - 1e-12))); }
};

/// Rayleigh damping, mass_per_s M + stiffness_s K.
struct Damping {
  double mass_per_s = 0, stiffness_s = 0;
};

/// How the shape without load is found.
enum class RestMethod {
  newton,      ///< Newton's method for where the nodes are at rest
  fixed_point  ///< the distance from the scan is taken off again and again, accelerated
};

/// The [loaded] of a scene: what acts on the body as the lattice shows it.
struct Loaded {
  RestMethod method = RestMethod::newton;
  std::vector<Condition> conditions;  ///< [[loaded.fix]]; empty: where the scene's own conditions hold
  std::vector<Force> forces;          ///< [[loaded.force]]
  std::vector<Contact> contacts;      ///< [[loaded.contact]]
  Vec3 gravity = Vec3::Zero();        ///< [mm/s^2]
};

/// A scene file. Units inside: mm, N, MPa, s.
struct Scene {
  Elasticity elasticity = Elasticity::corotational;
  bool finds_strain = false;  ///< strain = "auto": Cauchy where rotations change less than the accuracy
  Rotation rotation = Rotation::polar;
  Volumetric volumetric = Volumetric::mean;
  std::optional<Stiffness> stiffness;  ///< nothing: as stiffness_of_cells() says
  std::optional<int> level;            ///< mechanical level; nothing = the finest of at most 20000 cells
  std::optional<double> accuracy;      ///< solve to the first level whose estimated mean error is at most this [mm]
  std::optional<double> reaction_accuracy;  ///< likewise of each reaction, over the largest of them
  std::optional<double> budget;             ///< solve as many levels as this allows [s]
  ErrorEstimation error_estimation = ErrorEstimation::automatic;
  std::optional<Supports> supports;  ///< nothing: as rule_of_supports() says
  Grading grading = Grading::off;
  int coarser_by = 2;  ///< levels that graded cells may be coarser than the finest
  double tolerance = 1e-8;
  /// tolerance = "auto": a level that starts from a coarser one's solution ends once its equations are solved as well
  /// as its cells deserve; `tolerance` holds for all others. Not of a motion, a
  /// [[match]] or a [loaded].
  bool finds_tolerance = false;
  Islands islands = Islands::error;
  bool saves_memory = false;  ///< rather than time; not a key of the file
  bool compromise = false;    ///< incompatible conditions are met by least squares
  std::map<std::string, MaterialOverride> materials;
  std::vector<Condition> conditions;
  std::vector<Force> forces;
  std::vector<Contact> contacts;
  std::vector<Match> matches;
  std::vector<Prestress> prestresses;
  std::optional<Loaded> loaded;           ///< nothing: the lattice shows the body at rest
  bool is_of_lattice = false;             ///< made by loaded_scene(), not a key of the file
  std::optional<Eigen::Isometry3d> pose;  ///< where the body starts from, not a key of the file; nothing: at rest
  Vec3 gravity = Vec3::Zero();            ///< [mm/s^2]
  std::optional<Dynamics> dynamics;       ///< nothing for an equilibrium
  Damping damping;                        ///< of a motion
  std::vector<std::string> warnings;      ///< of what the file says in vain

  /// Whether cells may be free of stress elsewhere than on the lattice.
  bool is_reshaped() const { return loaded.has_value() || !prestresses.empty(); }
  bool is_graded() const { return grading == Grading::scene && coarser_by > 0; }
  bool asks_accuracy() const { return accuracy || reaction_accuracy; }
  /// Cells alike of a level that is asked for are the paper's, firmly held. An accuracy is one of the body: where it
  /// is asked for, and where cells are graded, those are taken that are nearest to the body, condensed and softly held,
  /// if they go with the scene.
  Stiffness stiffness_of_cells() const;
  Supports rule_of_supports() const;
  void keep_cells();  ///< as they are taken now, whatever level is named afterwards
  bool is_open_ended() const { return asks_accuracy() || budget; }  ///< which level it ends on is found on the way
  void name_level(std::optional<int> of);                           ///< in place of what it asks for
};

/// What a call asks for in place of what its scene does. At most one of level, accuracies and budget.
struct Request {
  std::optional<int> level, coarser_by;                       ///< the second: graded cells, see Scene
  std::optional<double> accuracy, reaction_accuracy, budget;  ///< as those of Scene
};

/// @throws Error{usage} for a bad request; Error{input} where the scene does not go with it
void apply(const Request& request, Scene& scene);

/// Read a scene (TOML). Relative paths of markups are relative to the scene file.
/// @param settings  "solve.strain=corotational" overrides a key of the file before it is checked
/// @throws Error{input} "file:line:column: key, what was expected"; Error{usage} for a bad setting
Scene read_scene(const std::filesystem::path& path, const std::string& display_name,
                 const std::vector<std::string>& settings = {});

/// A scene of nothing but settings, as of an empty file.
/// @throws Error{input}, Error{usage} as read_scene()
Scene make_scene(const std::vector<std::string>& settings);

/// The scene of what acts on the body as the lattice shows it. @pre it has a [loaded]
Scene loaded_scene(const Scene& scene);

/// Whether a scene moves, loads or touches the body at all.
bool acts(const Scene& scene);

/// Whether anything is to act on the body after its shape without load is found. @pre it has a [loaded]
bool acts_after_loaded(const Scene& scene);

/// The scene whose conditions hold in the end: where nothing acts afterwards that of the lattice's loads, else itself.
Scene scene_at_end(const Scene& scene);

/// Whether a pressure follows the surface.
bool follows(const Scene& scene);

/// Whether an obstacle is not to be entered at all, rather than as deep as its springs let it.
bool is_hard(const Contact& contact, const Scene& scene);

/// Whether an obstacle has friction: the solution then depends on the way there.
bool has_friction(const Scene& scene);

/// Of a scene with a [[match]]: strain = "auto" becomes one that turns with the body.
/// @throws Error{input} for what does not go with it
void check_matches(Scene& scene);

/// Of a scene with a [loaded]: strain = "auto" becomes "corotational".
/// @throws Error{input} for what does not go with it
void check_loaded(Scene& scene);

/// Of a scene with a [[prestress]]: strain = "auto" becomes "corotational".
/// @throws Error{input} for what does not go with it
void check_prestresses(Scene& scene);

/// The same lattice with the scene's [material.*] in place of its own.
/// @throws Error{input} for an unknown segment or a bad value
hexmesh::Lattice with_overrides(hexmesh::Lattice lattice, const Scene& scene);

/// Where a solution takes elements from: the file's matrices unless the scene changes materials or needs more of them.
hexmesh::Elements source_of_elements(const Scene& scene);

/// What is wanted of a lattice file beside what a solution cannot do without.
struct LatticeNeeds {
  std::vector<int> levels;  ///< as hexmesh::read_lattice()
  bool pictures = false;    ///< labels and picture surface
};

/// A lattice file as a scene is solved on it, with_overrides().
hexmesh::Lattice read_lattice_for(const Scene& scene, const std::filesystem::path& path, const LatticeNeeds& needs);

/// A commented scene for any lattice: the paper's liver experiment, three places on the surface held and a fourth
/// pulled by 40 mm; by less where the body is thin or small.
std::string example_scene(const hexmesh::Lattice& lattice);

}  // namespace hexsolver
