// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "hexsolver/contact.h"
#include "hexsolver/equilibrium.h"

namespace hexsolver {

/// The motion of one level of a lattice under a scene with [dynamics], by implicit Euler (THEORY.md, "Motion").
///
/// A step that cannot be solved, or after which the body holds more energy than it had and was given, is not accepted
/// but taken in two halves, down to 1/64 of the step asked. With a fixed number of iterations it is halved down to 1/4
/// and slowed down where that is not enough: too few iterations make a motion slow, not unstable.
///
/// After the first step it asks for no memory, but for a multigrid that is made anew where cells share Hessians (small
/// strain, cells that do not turn): when a step is halved.
class Motion {
public:
  /// @param lattice  with the level; both must outlive this
  /// @throws Error as solve_equilibrium, but nothing need be held; Error{input} for a body without mass or a start
  /// that does not fit
  Motion(const hexmesh::Lattice& lattice, const Scene& scene, int level);
  ~Motion();

  /// One step of [dynamics] step_s.
  /// @returns false if no part of it can be solved: the state is the last that could be
  bool step();

  const char* reason() const;  ///< why the last step failed, or part of one

  double time() const;  ///< [s]
  const NodeVector& displacement() const;
  const NodeVector& velocity() const;  ///< [mm/s]
  const Energies& energies() const;

  /// What supports, moving obstacles and changing forces have given to the body since the start [N mm].
  double work() const;

  /// By how much more that may be: the forces of supports are taken as they are at the end of each part [N mm].
  double work_uncertainty() const;

  Vec3 momentum() const;  ///< [N s]
  const Mesh& mesh() const;
  const Index3& voxels_per_cell() const;

  /// Go on from another state, at the time reached.
  void set_state(const NodeVector& displacement, const NodeVector& velocity);

  struct Counts {
    int steps = 0;   ///< of the size asked
    int parts = 0;   ///< solved, at least one per step
    int failed = 0;  ///< not accepted
    int slowed = 0;  ///< of the parts solved
    int newton = 0, linear = 0;
    int preconditioners = 0;       ///< made
    double relative_residual = 0;  ///< of the last part
    double largest_residual = 0;   ///< of all
    double largest_gain = 0;       ///< of energy without work in a part, over the energies that change [1]
  };
  const Counts& counts() const;

  const PenaltyContact* ball_inside() const;         ///< an obstacle that has gone through the surface, or nullptr
  void explain(std::vector<Effect>& effects) const;  ///< with strain = "auto": how many cells turn

  /// Warnings of conditions that contradict each other at any time, and of obstacles that overlap the body and
  /// conditions that are not met at the start.
  /// @throws Error{geometry} as solve_equilibrium
  void check(SolveReport& report) const;

  /// The state as a result, and what follows from it in the report.
  hexmesh::Result conclude(SolveReport& report) const;

private:
  class Integrator;
  std::unique_ptr<Integrator> integrator_;
};

/// The whole motion of a scene.
/// @param on_output  called with the start, after every output_every steps, and with the end
/// @param on_step    called after every step
/// @throws Error as Motion
hexmesh::Result solve_dynamics(const hexmesh::Lattice& lattice, const Scene& scene, int level, SolveReport& report,
                               const std::function<void(const Motion&)>& on_output = {},
                               const std::function<void(const Motion&)>& on_step = {});

}  // namespace hexsolver
