// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>

#include "equilibrium/local_level.h"
#include "newton/rest_equations.h"

namespace hexsolver {

/// Where the nodes of levels are at rest, from the lattice [mm].
using RestShapes = std::map<int, NodeVector>;

/// A level whose lattice shows the body under load. What is solved for is where it is at rest: the fields of this level
/// are displacements from the lattice to there. See the concept EquilibriumLevel.
class RestLevel : public LocalLevel {
public:
  /// @param scene   of the loads that act, as loaded_scene() makes it
  /// @param shapes  receives what is found under the whole load; must outlive this
  RestLevel(const hexmesh::Lattice& lattice, const Scene& scene, int level, RestShapes& shapes)
      : LocalLevel(lattice, scene, level), shapes_(shapes) {}

  RotatingCells build(Elasticity elasticity, const CoarseStart<RestLevel>* start, NodeVector& to_rest);
  bool attach(const NodeVector& /*to_rest*/, const PullMode& /*mode*/) { return false; }
  NodeVector make_start() const { return make_zero(); }
  void set_progress(const Progress& progress);
  double largest_load_step() const { return 1; }
  NewtonOutcome minimize(const NewtonOptions& options, NodeVector& to_rest, const NewtonProgress& progress);
  LevelMeasures measures(const NodeVector& to_rest);
  std::string limit_reached(const NodeVector& to_rest, bool nearly) const;
  std::optional<std::string> gone_through(const NodeVector& /*to_rest*/) const { return {}; }
  std::optional<std::string> why_no_solution(const NodeVector& /*to_rest*/) const { return {}; }

private:
  NewtonOutcome find_by_newton(const NewtonOptions& options, NodeVector& to_rest, const NewtonProgress& progress);
  NewtonOutcome find_by_fixed_point(const NewtonOptions& options, NodeVector& to_rest, const NewtonProgress& progress);
  RestEquations equations();

  RestShapes& shapes_;
  double fraction_ = 1;  ///< of the load
};

}  // namespace hexsolver
