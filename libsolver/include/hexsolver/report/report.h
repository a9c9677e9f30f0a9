// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "hexsolver/core/vectors.h"
#include "hexsolver/scene/effects.h"
#include "hexsolver/scene/law.h"

namespace hexsolver {

/// Where the time went [s].
struct NewtonSeconds {
  double forces = 0;     ///< and energies, with the frames of cells
  double linearize = 0;  ///< what else Hessians of cells take
  double set_up = 0;     ///< of the multigrid levels
  double cycles = 0;     ///< of multigrid
  double products = 0;   ///< with the Hessian, outside of cycles

  NewtonSeconds& operator+=(const NewtonSeconds& other);
};

struct NewtonReport {
  bool converged = false;
  std::string reason;  ///< why it ended
  int iterations = 0;
  int linear_iterations = 0;
  double relative_residual = 0;
  bool interrupted = false;
  double moving = 0;                     ///< what matches pull to, at the end, beside the displacement; 0: at rest
  std::size_t preconditioner_bytes = 0;  ///< of memory
  NewtonSeconds seconds;
};

struct ConditionReport {
  std::string name;
  std::size_t points = 0;
  std::size_t kept = 0;             ///< directions that hold exactly; points that share nodes share them
  double misfit_mm = 0;             ///< largest distance of a point from its prescribed place
  Vec3 reaction_n = Vec3::Zero();   ///< force of the support on the body [N]
  Vec3 moment_n_mm = Vec3::Zero();  ///< of these forces, see BalanceReport [N mm]
};

struct ForceReport {
  std::string name;
  Vec3 total_n = Vec3::Zero();      ///< [N]
  Vec3 moment_n_mm = Vec3::Zero();  ///< see BalanceReport [N mm]
};

struct ContactReport {
  std::string name;
  std::size_t points = 0;           ///< of the surface that touch
  double deepest_mm = 0;            ///< how far one is inside
  double nearest_mm = 0;            ///< distance of the nearest one, < 0 inside
  Vec3 force_n = Vec3::Zero();      ///< on the body [N]
  Vec3 moment_n_mm = Vec3::Zero();  ///< see BalanceReport [N mm]
  std::size_t slipping = 0;         ///< of the points, which friction did not hold in the last step
};

/// Distances, by area or of landmarks.
struct DistanceReport {
  double mean_mm = 0, percentile95_mm = 0, largest_mm = 0;
};

/// How far the body is from what a [[match]] asks.
struct MatchReport {
  std::string name;
  std::size_t points = 0;                        ///< of the target
  double trust_mm = 0;                           ///< the scene's, or the one found
  std::size_t eased_points = 0;                  ///< of the body, pulled less since cells would fold there
  bool is_part = false;                          ///< the target is one of the surface
  double left_out = 0;                           ///< part of both areas that is far beside the rest and pulls no more
  double unreached = 0;                          ///< of the target's, without pieces of their own
  double uncovered = 0;                          ///< of the body's
  double kept_mean_mm = 0;                       ///< of the rest
  DistanceReport distance;                       ///< both ways together
  DistanceReport target_to_body;                 ///< of points of the target from the body
  std::optional<DistanceReport> body_to_target;  ///< nothing where the target is a part of the surface
  std::size_t worst = 0;                         ///< number of the landmark that is farthest off, from 1 on
  DistanceReport at_start;                       ///< as `distance`, after the rigid alignment alone
  Vec3 force_n = Vec3::Zero();                   ///< on the body [N]
  Vec3 moment_n_mm = Vec3::Zero();               ///< see BalanceReport [N mm]
};

/// All that acts on the body. In equilibrium, and in a motion with inertia, it adds up to nothing but rounding and what
/// the tolerance leaves. Moments are about the middle of the lattice's box; forces act where the points of the body
/// have come to, with small strain where they were at rest.
struct BalanceReport {
  struct Row {
    std::string
        name;  ///< of a condition, a force, gravity, a contact, a match, islands (their springs), inertia, damping
    Vec3 force_n = Vec3::Zero();      ///< on the body [N]
    Vec3 moment_n_mm = Vec3::Zero();  ///< [N mm]
  };
  Vec3 about_mm = Vec3::Zero();
  std::vector<Row> acting;

  Row sum() const;
};

/// How far a level is expected to be from the finest one of the lattice, and that one from cells of no size; see
/// ErrorEstimator. Nothing: unknown.
struct ErrorEstimate {
  std::optional<double> mean_mm, max_mm;           ///< of the displacement, over the material
  std::optional<double> strain_energy_n_mm;        ///< [N mm]
  std::vector<std::optional<double>> reactions_n;  ///< of each condition [N]
  std::optional<double> of_reactions;              ///< the largest of these over the largest reaction [1]
  bool is_hidden = false;  ///< unknown: cells average over layers, or gaps end in them, as on the levels compared with
  std::optional<double> algebraic_mm;  ///< mean, of the equations of this level not being solved to the end
};

/// One of the levels passed on the way from the coarsest.
struct LevelReport {
  int level = 0;
  std::size_t cells = 0, nodes = 0;
  double seconds = 0;
  NewtonReport newton;
  ErrorEstimate error;
};

/// What a body in motion holds [N mm].
struct Energies {
  double kinetic = 0;
  double strain = 0;
  double contact = 0;  ///< in the springs of obstacles and islands
  double loads = 0;    ///< of forces and gravity, zero at rest
  double total() const { return kinetic + strain + contact + loads; }
};

/// Of a motion.
struct MotionReport {
  struct Row {
    double time = 0;  ///< [s]
    Energies energies;
    double work = 0;               ///< given by supports, moving obstacles and changing forces since the start [N mm]
    double work_uncertainty = 0;   ///< by how much more that may be [N mm]
    double friction_work = 0;      ///< that slips at obstacles took since the start [N mm]
    Vec3 momentum = Vec3::Zero();  ///< [N s]
    std::vector<ContactReport> contacts;  ///< without moments
  };
  std::vector<Row> rows;    ///< one per output
  int steps = 0;            ///< of the size asked
  int substeps = 0;         ///< solved, at least one per step
  int failed_substeps = 0;  ///< not accepted, and halved
  int slowed_substeps = 0;  ///< solved with too few iterations, and slowed down
  double largest_residual = 0;
  double largest_gain = 0;  ///< of energy without work in a substep, over the energies [1]
};

struct SolveReport;

/// Of a body that the lattice shows under load, solve.reference = "loaded".
struct LoadedReport {
  std::shared_ptr<const SolveReport> scan;  ///< the state on the lattice, and how the shape without load was found
  double mean_mm = 0, largest_mm = 0;       ///< from the lattice to where the material is at rest
};

struct SolveReport {
  bool converged = false;
  std::string reason;
  double load_fraction = 0;  ///< of the prescribed displacements and forces, 1 where converged
  double relative_residual = 0;
  double constraint_violation_mm = 0;
  double strain_energy_n_mm = 0;
  double min_jacobian = 1;           ///< least det F where there is material (see cell_measures.h)
  double pressure_checkerboard = 0;  ///< [MPa], likewise
  std::size_t inverted_cells = 0;    ///< with material that is inside out
  std::size_t inverted_voxels = 0;   ///< of material that is, each cell's rounded up
  double volume_change = 0;          ///< of the body, over its volume at rest
  double least_volume_ratio = 1, largest_volume_ratio = 1;  ///< of a cell, its volume over that at rest
  std::size_t kept_directions = 0;
  std::vector<ConditionReport> conditions;
  std::vector<ForceReport> forces;  ///< each [[force]], then gravity if there is any
  std::vector<ContactReport> contacts;
  std::vector<MatchReport> matches;
  std::optional<Eigen::Isometry3d> pose;  ///< the rigid motion that matches began from
  BalanceReport balance;
  /// Coarse to fine, the last is the mechanical level; graded ones first where cells alike took over from them.
  std::vector<LevelReport> levels;
  std::vector<Effect> effects;
  Elasticity elasticity = Elasticity::corotational;  ///< the scene's, or the one found
  std::vector<std::string> warnings;
  bool interrupted = false;          ///< a motion that was asked to end before its time
  bool accuracy_missed = false;      ///< converged, but the estimated error is above the accuracy asked
  std::size_t dropped_cells = 0;     ///< islands that are left out
  std::size_t held_cells = 0;        ///< islands held by springs
  Vec3 held_force_n = Vec3::Zero();  ///< of these springs on the body [N]
  double setup_seconds = 0, solve_seconds = 0;
  /// Memory of the mechanical level by what it is for, and of the lattice.
  std::vector<std::pair<std::string, std::size_t>> bytes;
  std::optional<MotionReport> motion;
  std::optional<LoadedReport> loaded;
};

}  // namespace hexsolver
