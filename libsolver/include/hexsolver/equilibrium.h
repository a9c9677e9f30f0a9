// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "hexmesh/file/result_file.h"
#include "hexsolver/newton.h"
#include "hexsolver/scene.h"

namespace hexsolver {

struct ConditionReport {
  std::string name;
  std::size_t points = 0;
  double misfit_mm = 0;            ///< largest distance of a point from its prescribed place
  Vec3 reaction_n = Vec3::Zero();  ///< force of the support on the body [N]
};

struct ForceReport {
  std::string name;
  Vec3 total_n = Vec3::Zero();  ///< [N]
};

/// One of the levels passed on the way from the coarsest.
struct LevelReport {
  int level = 0;
  std::size_t cells = 0, nodes = 0;
  double seconds = 0;
  NewtonReport newton;
};

struct SolveReport {
  bool converged = false;
  std::string reason;
  double load_fraction = 0;  ///< of the prescribed displacements and forces, 1 where converged
  double relative_residual = 0;
  double constraint_violation_mm = 0;
  double strain_energy_n_mm = 0;
  double min_jacobian = 1;  ///< least det F of a cell (see cell_measures.h)
  std::size_t inverted_cells = 0;
  std::size_t kept_directions = 0;
  std::vector<ConditionReport> conditions;
  std::vector<ForceReport> forces;  ///< each [[force]], then gravity if there is any
  std::vector<LevelReport> levels;  ///< coarse to fine, the last is the mechanical level
  double setup_seconds = 0, solve_seconds = 0;
};

/// Told after every Newton step: level, load fraction, iteration, relative residual, linear iterations of the step.
using SolveProgress = std::function<void(int, double, int, double, int)>;

/// The mechanical level a scene asks for; without one the finest of at most 20000 cells.
/// @throws Error{input} if the lattice has no such level
int mechanical_level(const Scene& scene, const hexmesh::Lattice& lattice);

/// Static equilibrium of a lattice under a scene, solved from the coarsest level with at least 64 cells down to
/// `level`, each starting from the one before; where Newton fails the load is cut back and raised in steps.
/// @param lattice  with its levels from `level` up
/// @throws Error{geometry} for selections, conflicts and missing supports, before anything is solved
hexmesh::Result solve_equilibrium(const hexmesh::Lattice& lattice, const Scene& scene, int level, SolveReport& report,
                                  const SolveProgress& progress = {});

/// The same lattice with the scene's [material.*] in place of its own.
/// @throws Error{input} for an unknown segment or a bad value
hexmesh::Lattice with_overrides(hexmesh::Lattice lattice, const Scene& scene);

/// A commented scene for any lattice: the paper's liver experiment, three places on the surface held and a fourth
/// pulled by 40 mm.
std::string example_scene(const hexmesh::Lattice& lattice);

}  // namespace hexsolver
