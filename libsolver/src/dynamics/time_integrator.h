// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "dynamics/backward_difference.h"
#include "dynamics/cell_rotations.h"
#include "dynamics/step_equations.h"
#include "dynamics/table_corners.h"
#include "hexsolver/dynamics/motion.h"
#include "level/on_level.h"
#include "newton/newton.h"
#include "terms/inertia.h"
#include "terms/stiffness_damping.h"

namespace hexsolver {

/// Steps of implicit Euler or of BDF2. A step that cannot be solved, or after which the
/// body holds more energy than it had and was given, is taken in substeps (THEORY.md, "Motion").
class TimeIntegrator {
public:
  /// @param lattice  must outlive this
  /// @throws Error as Motion
  TimeIntegrator(const hexmesh::Lattice& lattice, const Scene& scene, int level);

  bool step();  ///< see Motion::step()
  void set_state(const NodeVector& u, const NodeVector& v);

  // As Motion's:
  bool grab(std::size_t point, const Vec3& place, double reach);
  void let_go(std::optional<std::size_t> point);

  /// After a substep that failed the terms are in the midst of it: reactions are then those without acceleration.
  void be_at_rest_if_failed();

  std::vector<std::string> check();  ///< see check_motion()

  double time() const;  ///< [s]
  const NodeVector& displacement() const noexcept { return u_; }
  const NodeVector& velocity() const noexcept { return v_; }
  const Energies& energies() const noexcept { return energies_; }
  double work() const noexcept { return work_; }
  double work_uncertainty() const noexcept { return work_uncertainty_; }
  double friction_work() const noexcept { return friction_work_; }
  Vec3 momentum() const { return inertia_->momentum(v_); }
  const Motion::Counts& counts() const noexcept { return counts_; }
  const char* reason() const noexcept { return reason_; }  ///< why the last substep was not accepted; empty if it was

  const LevelProblem& problem() const noexcept { return problem_; }
  const OnLevel* on_level() const noexcept { return on_level_.get(); }  ///< null: cells alike
  const Scene& scene() const noexcept { return scene_; }
  const hexmesh::Lattice& lattice() const noexcept { return lattice_; }
  std::size_t preconditioner_bytes() const { return equations_->preconditioner_bytes(); }
  const CellRotations& rotations() const { return *rotations_; }
  const std::string* ball_inside() const;  ///< see Motion

private:
  struct Work {
    double done = 0, uncertain = 0;  ///< [N mm]
  };
  void start();
  Progress progress(double ahead = 0) const;
  NewtonOptions newton_options() const;
  bool lets_go();
  bool fail(const char* why);
  enum class Form { euler, bdf2, start_of_bdf2 };
  bool take_substep(double h);
  bool try_substep(double h, Form form);
  void begin_terms();
  NewtonEnd solve_step(const Newton<NodeVector>::Accept& accept);
  NewtonEnd attach_contacts();
  bool fail(NewtonEnd end);
  bool is_to_tolerance() const { return settings_.newton_iterations == 0; }
  int smallest_substep() const;
  bool is_smallest(double h) const;
  bool accept(const NodeVector& projected);
  bool slow_down();
  Work work_of_supports(const NodeVector& projected) const;
  bool hold_rotations(const NodeVector* tried);
  void begin_to_rotate();

  const hexmesh::Lattice& lattice_;
  const Scene scene_;
  const Dynamics settings_;
  LevelProblem problem_;
  std::unique_ptr<const OnLevel> on_level_;  ///< of graded cells
  Inertia* inertia_ = nullptr;               ///< in the potential
  StiffnessDamping* damping_ = nullptr;      ///< likewise
  std::optional<CellRotations> rotations_;
  std::optional<StepEquations> equations_;
  std::optional<Newton<NodeVector>> newton_;
  Newton<NodeVector>::Accept accept_;

  BackwardDifference difference_;
  const TableCorners corners_;
  NodeVector u_, v_;
  Energies energies_;
  double work_ = 0, work_uncertainty_ = 0, friction_work_ = 0, obstacle_work_ = 0;
  Motion::Counts counts_;
  const char* reason_ = "";
  std::int64_t ticks_ = 0;        ///< smallest substeps done
  std::int64_t most_linear_ = 0;  ///< iterations by the end of this step
  NodeVector support_force_;      ///< at u_ [N]
  double largest_energy_ = 0, rounding_of_places_ = 0;
  double lost_ = 0;  ///< energy that all steps have taken, which one of BDF2 may give back [N mm]

  // Of the substep that is tried:
  double h_ = 0;
  Energies before_;  ///< at its begin, under the loads of its end
  NodeVector end_, velocity_, predictor_, support_step_, projected_;
};

}  // namespace hexsolver
