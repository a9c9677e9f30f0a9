// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "hexmesh/lattice/nodes.h"
#include "hexsolver/core/vectors.h"
#include "hexsolver/report/outcome.h"
#include "hexsolver/scene/scene.h"

namespace hexsolver {

class Mesh;
class TimeIntegrator;

/// The motion of one level of a lattice under a scene with [dynamics], by implicit Euler or BDF2 (THEORY.md,
/// "Motion").
///
/// A step that cannot be solved, or after which the body holds more energy than it had and was given, is not accepted
/// but taken in two halves, down to 1/64 of the step asked (one of BDF2 by implicit Euler before). With a fixed number
/// of iterations it is halved down to 1/4 and slowed down where that is not enough: too few iterations make a motion
/// slow, not unstable.
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

  const char* reason() const;  ///< why the last step failed, or a substep of one

  double time() const;  ///< [s]
  /// At the nodes of the level's cells, which graded cells tell exactly.
  const NodeVector& displacement() const;
  const NodeVector& velocity() const;  ///< likewise [mm/s]
  const Energies& energies() const;

  /// What supports, moving obstacles and changing forces have given to the body since the start [N mm].
  double work() const;

  /// By how much more that may be: the forces of supports are taken as they are at the end of each part [N mm].
  double work_uncertainty() const;
  double friction_work() const;  ///< that slips at obstacles took since the start [N mm]

  Vec3 momentum() const;                 ///< [N s]
  const Mesh& mesh() const;              ///< of the cells that move
  hexmesh::CellLocator locator() const;  ///< finds cells of the level, whose nodes the next are
  const std::vector<hexmesh::CellNodes>& cell_nodes() const;

  /// The state as files keep it; with stresses and strains if the scene asks for them in every state.
  hexmesh::MotionStep state() const;

  /// Go on from another state, at the time reached.
  void set_state(const NodeVector& displacement, const NodeVector& velocity);

  /// Take hold of a point of the lattice's picture surface, or move on the hand that holds it: springs pull it and what
  /// is near it to the place, from the next step on and by at most a fiftieth of the body's size in a step. Where no
  /// step can be solved under what hands ask they let go.
  /// @param point  number in lattice.surface.points
  /// @param place  [mm]
  /// @param reach  of the points that are held with it [mm], of a new hold
  /// @returns false where no cell moves the point
  bool grab(std::size_t point, const Vec3& place, double reach = 0);
  void let_go(std::optional<std::size_t> point = {});  ///< nothing: of all

  struct Counts {
    int steps = 0;         ///< of the size asked
    int substeps = 0;      ///< solved, at least one per step
    int failed = 0;        ///< not accepted
    int slowed = 0;        ///< of the substeps solved
    int let_go = 0;        ///< how often what hands asked could not be solved
    std::size_t held = 0;  ///< cells at most that kept their rotation over a step
    int newton = 0, linear = 0;
    int preconditioners = 0;       ///< made
    double relative_residual = 0;  ///< of the last substep
    double largest_residual = 0;   ///< of all
    double largest_gain = 0;       ///< of energy without work in a substep, over the energies that change [1]
  };
  const Counts& counts() const;

  std::vector<ContactReport> contacts() const;  ///< of each obstacle, without moments
  const std::string* ball_inside() const;       ///< name of an obstacle that has gone through the surface, or null
  /// With strain = "auto": since when cells rotate; of a body that hands held: that they did.
  void explain(std::vector<Effect>& effects) const;

  /// Warnings of conditions that are incompatible at any time, and of obstacles that overlap the body and
  /// conditions that are not met at the start.
  /// @throws Error{geometry} as solve_equilibrium
  std::vector<std::string> check() const;

  /// The state as a result, and what follows from it.
  Outcome make_result(SolveReport so_far) const;

private:
  const NodeVector& on_level(const NodeVector& field, NodeVector& told) const;

  std::unique_ptr<TimeIntegrator> integrator_;
  mutable NodeVector displacement_, velocity_;  ///< as told of graded cells
};

/// What a motion is to do next.
enum class NextStep {
  take,
  end,       ///< it ends as asked, with its last state as an output
  interrupt  ///< likewise, and counts as not converged
};

/// The whole motion of a scene.
/// @param on_output  called with the start, after every output_every steps, and with the end
/// @param on_step    called after every step
/// @param next_step  asked before every step, and may grab and let go
/// @throws Error as Motion
Outcome solve_dynamics(const hexmesh::Lattice& lattice, const Scene& scene, int level,
                       const std::function<void(const Motion&)>& on_output = {},
                       const std::function<void(const Motion&)>& on_step = {},
                       const std::function<NextStep(Motion&)>& next_step = {});

}  // namespace hexsolver
