// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>

#include "equilibrium/nested_iteration.h"
#include "level/level_problem.h"

namespace hexsolver {

/// A level that one process solves; see the concept EquilibriumLevel.
class LocalLevel {
public:
  using Vector = NodeVector;

  /// @param matchings, shared  see LevelProblem
  LocalLevel(const hexmesh::Lattice& lattice, const Scene& scene, int level, Matchings matchings = {},
             std::shared_ptr<SharedFindings> shared = {})
      : problem_(lattice, scene, level, std::move(matchings), std::move(shared)) {}

  LocalLevel(MeshCells cells, const Scene& scene, Matchings matchings, std::shared_ptr<SharedFindings> shared)
      : problem_(std::move(cells), scene, std::move(matchings), std::move(shared)) {}

  const LevelProblem& problem() const noexcept { return problem_; }
  LevelProblem& mutable_problem() noexcept { return problem_; }

  int level() const { return problem_.level(); }
  int level_of_largest() const { return problem_.cells().levels().back().level; }
  std::size_t num_cells() const { return problem_.mesh().num_cells(); }
  std::size_t num_nodes() const { return problem_.mesh().num_nodes(); }
  double diameter() const { return problem_.mesh().diameter(); }
  std::vector<std::string> check(const Scene& scene) const { return check_level(problem_, scene); }
  RotatingCells build(Elasticity elasticity, const CoarseStart<LocalLevel>* start, NodeVector& u);
  NodeVector make_zero() const { return NodeVector::Zero(static_cast<Eigen::Index>(problem_.mesh().num_dofs())); }
  bool attach(const NodeVector& u, const PullMode& mode) { return problem_.attach(u, mode); }
  bool settle(const NodeVector& u) { return problem_.settle_contacts(u); }
  void unsettle() { problem_.unsettle_contacts(); }
  RoundLimits round_limits(Aim aim) const;
  std::optional<std::string> gone_through(const NodeVector& u) const;
  std::optional<std::string> through_obstacle(const NodeVector& u) const;
  void keep(const NodeVector& u) { problem_.keep_contacts(u); }
  NodeVector make_start() const { return problem_.start(); }
  void set_progress(const Progress& progress) { problem_.set_progress(progress); }
  double largest_load_step() const { return problem_.largest_load_step(); }
  /// to = a field of a coarser level here.
  void prolongate(const LocalLevel& coarser, const NodeVector& from, NodeVector& to) const;
  NewtonOutcome minimize(const NewtonOptions& options, NodeVector& u, const NewtonProgress& progress);
  ElasticCells::Size size_in_material(const NodeVector& field, bool with_islands) const;
  double mean_deformation(const NodeVector& u) const;
  double share_of_turns(double angle, const NodeVector& u) const;
  LevelMeasures measures(const NodeVector& u);
  std::string limit_reached(const NodeVector& u, bool nearly) const;
  std::optional<std::string> why_no_solution(const NodeVector& u) const;
  void add_effect_seconds(SolveReport& report) const { hexsolver::add_effect_seconds(problem_.potential(), report); }

private:
  Index3 ratio_to(const LocalLevel& coarser) const;                       ///< see Prolongation
  std::vector<std::int32_t> parents_in(const LocalLevel& coarser) const;  ///< of the cells here into those

  LevelProblem problem_;
};

}  // namespace hexsolver
