// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "baseline/tet_solver.h"
#include "hexmesh/file/result_file.h"
#include "hexmesh/lattice/lattice.h"
#include "hexmesh/result/result.h"
#include "hexmesh/tetra/tet_mesh.h"
#include "hexsolver/scene/scene.h"

namespace hextools {

/// A body under a scene, to be solved in many ways.
struct Experiment {
  hexmesh::Lattice lattice;  ///< with the materials of the scene
  hexsolver::Scene scene;    ///< an equilibrium
};

/// One way to discretize and solve an experiment.
struct Method {
  enum class Kind {
    cells,            ///< of a level, as soft as what they hold: the paper's
    condensed_cells,  ///< of a level, condensed and softly held, as accuracies take them
    graded_cells,     ///< of a level where supports end, larger elsewhere, likewise
    uniform_cells,    ///< of a level, the fill-weighted full cell
    tets,             ///< of 4 nodes, as large everywhere
    graded_tets,      ///< of 4 nodes, smaller at supports
    quadratic_tets    ///< of 10 nodes, smaller at supports: the reference
  };
  Kind kind = Kind::cells;
  hexsolver::Elasticity law = hexsolver::Elasticity::corotational;  ///< up to green_lagrange
  bool fast = false;                                                ///< tetrahedra: the paper's fast co-rotation (QR)
  int level = 0;                                                    ///< of cells
  double size = 0;                                                  ///< edges of tetrahedra [mm]
  const hexmesh::TetMesh* mesh = nullptr;                           ///< in place of a size
  std::string mesh_name;                                            ///< of that, where it has one
  hexsolver::TetLinearSolver solver = hexsolver::TetLinearSolver::cholesky;
  double tolerance = 1e-6;

  bool is_cells() const {
    return kind == Kind::cells || kind == Kind::condensed_cells || kind == Kind::graded_cells ||
           kind == Kind::uniform_cells;
  }
  std::string name() const;  ///< of the kind with its rotation and solver, e.g. "tetrahedra, QR, CG"
};

std::string law_name(hexsolver::Elasticity law);  ///< as solve.strain names it

/// The state that a method ends with.
struct Outcome {
  bool converged = false;
  std::string reason;
  std::size_t elements = 0, nodes = 0, dofs = 0;
  int newton_iterations = 0, linear_iterations = 0;
  double mesh_seconds = 0;   ///< levels from voxels, or tetrahedra from them
  double setup_seconds = 0;  ///< what does not depend on the loads, as far as the solver tells
  double solve_seconds = 0;
  double memory_mb = 0;      ///< by which the process grew at most
  double strain_energy = 0;  ///< [N mm]
  std::size_t held = 0;      ///< points of cells, nodes of tetrahedra that conditions select
  double total_seconds() const { return mesh_seconds + setup_seconds + solve_seconds; }

  /// Displacements at places of the body at rest [mm].
  std::function<std::vector<hexmesh::Vec3>(const std::vector<hexmesh::Vec3>&)> at;
  std::shared_ptr<const hexmesh::TetMesh> tets;  ///< nothing for cells
};

/// Displacements of tetrahedra whose nodes are displaced by u at places of the body at rest [mm].
std::vector<hexmesh::Vec3> displacement_at(const hexmesh::TetMesh& mesh, const std::vector<hexmesh::Vec3>& u,
                                           const std::vector<hexmesh::Vec3>& places);

std::vector<hexmesh::Vec3> surface_centers(const hexmesh::Lattice& lattice);  ///< of exposed faces [mm]

/// Steps of the paper: 0.02 s, a fixed number of conjugate gradient iterations, linearized once.
hexsolver::Dynamics paper_dynamics(double duration, int iterations);

/// @throws Error as the solvers do
Outcome run(const Method& method, const Experiment& experiment);

/// The edges with which a body is filled by about so many tetrahedra [mm].
double size_of_tets(const hexmesh::Lattice& lattice, double count);

/// Tetrahedra of that size, smaller at the supports of the scene if asked.
hexmesh::TetMesh mesh_for(const Experiment& experiment, double size, bool graded);

double filled_volume(const hexmesh::Lattice& lattice);  ///< [mm^3]

}  // namespace hextools
