// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "hexmesh/lattice/lattice.h"
#include "hexsolver/report/outcome.h"
#include "hexsolver/scene/scene.h"

namespace hextools {

/// What a solution says that it is off by, and what it is off by.
struct Estimated {
  std::optional<double> estimate;  ///< nothing: unknown
  double error = 0;
};

/// A level against the lattice's finest.
struct LevelErrors {
  int level = 0;
  std::size_t cells = 0, unknowns = 0;
  bool converged = false;
  bool accuracy_missed = false;      ///< as told, where one was asked
  Estimated mean, largest;           ///< of the displacement of the voxels' centres [mm]
  Estimated energy;                  ///< [N mm]
  std::vector<Estimated> reactions;  ///< of each condition [N]
  /// Of the equations, from the same level solved to the end, where the scene's tolerance is "auto": mean [mm], and of
  /// each condition [N].
  std::optional<Estimated> equations;
  std::vector<double> reactions_of_equations;
};

/// The finest level of a lattice under a scene, its cells alike, and other levels against it, graded if the scene is.
class LevelErrorMeter {
public:
  /// @param lattice  with all its levels; must outlive this
  /// @throws Error as solve_equilibrium; Error{geometry} where the finest level does not converge
  LevelErrorMeter(const hexmesh::Lattice& lattice, hexsolver::Scene scene);

  /// A level, solved as the scene says.
  LevelErrors of_level(int level) const;
  /// The level that an accuracy asked [mm] ends on.
  LevelErrors of_accuracy(double accuracy) const;

  double mean_displacement() const;                          ///< of the finest level [mm]
  double largest_reaction() const;                           ///< of its conditions [N]
  double strain_energy() const noexcept { return energy_; }  ///< likewise [N mm]

private:
  LevelErrors measure(const hexsolver::Scene& scene, int level) const;
  void measure_equations(hexsolver::Scene scene, const hexsolver::Outcome& outcome, LevelErrors& row) const;

  const hexmesh::Lattice& lattice_;
  hexsolver::Scene scene_;
  std::vector<hexmesh::Vec3> points_, truth_;
  double energy_ = 0;
  std::vector<hexmesh::Vec3> reactions_;
};

/// The coarsest level of at least so many cells.
int coarsest_level(const hexmesh::Lattice& lattice, std::size_t least_cells);

}  // namespace hextools
