// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include "baseline/tet_law.h"
#include "baseline/tet_problem.h"

namespace hexsolver {

enum class TetLinearSolver {
  cholesky,            ///< CHOLMOD's
  conjugate_gradients  ///< with an incomplete Cholesky factor
};

struct TetOptions {
  TetLaw law = TetLaw::corotational;
  TetLinearSolver solver = TetLinearSolver::cholesky;
  double tolerance = 1e-8;  ///< on |residual| / |sum of absolute forces of tetrahedra and loads|, as for cells
  int max_iterations = 50;  ///< of Newton's method for each load step
};

struct TetReport {
  bool converged = false;
  std::string reason;
  double load_fraction = 0;
  int newton_iterations = 0, linear_iterations = 0;
  double relative_residual = 0;
  double strain_energy = 0;  ///< [N mm]
  double min_jacobian = 1;   ///< at the points of integration
  double setup_seconds = 0;  ///< pattern of the matrix and its ordering
  double solve_seconds = 0;
};

/// Static equilibrium of tetrahedra: Newton's method and load steps are those of cells, on an assembled matrix. 4
/// nodes: one point of integration, 10 nodes: four. On one thread but for CHOLMOD.
/// @returns displacements of the nodes [mm], those of the last load that converged
std::vector<Vec3> solve_tets(const TetProblem& problem, const TetOptions& options, TetReport& report);

/// Motion of tetrahedra by implicit Euler, one linear solution a step with a fixed number of plain conjugate gradient
/// iterations, as in the paper. What is prescribed is there from the first step.
class TetMotion {
public:
  /// @param problem  must outlive this
  /// @param step     [s]
  TetMotion(const TetProblem& problem, TetLaw law, double step, int iterations, const Damping& damping);
  ~TetMotion();
  void step();
  std::vector<Vec3> displacement() const;  ///< [mm]

private:
  class Integrator;
  std::unique_ptr<Integrator> integrator_;
};

}  // namespace hexsolver
