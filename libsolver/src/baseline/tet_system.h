// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/SparseCore>
#include <vector>

#include "baseline/tet_law.h"
#include "baseline/tet_problem.h"

namespace hexsolver {

/// Forces and stiffness of tetrahedra, assembled over the components that nothing holds.
class TetSystem {
public:
  using Vector = Eigen::VectorXd;
  using Matrix = Eigen::SparseMatrix<double>;

  TetSystem(const TetProblem& problem, TetLaw law);

  Eigen::Index num_free() const noexcept { return num_free_; }
  const TetProblem& problem() const noexcept { return problem_; }

  struct Forces {
    double energy = 0;        ///< [N mm]
    double min_jacobian = 1;  ///< det F
    Vector gradient;          ///< of the energy, of all components [N]
    Vector magnitude;         ///< sum of the absolute values it is made of
  };
  Forces forces(const Vector& u) const;

  /// Lower triangle of the derivative of the gradient at u.
  /// @param projection  of negative curvature, see HessianProjection
  /// @param held_step  of all components: where held ones are to go; receives -K held_step of the free ones
  /// @param pull       shape (num_free())
  const Matrix& stiffness(const Vector& u, double projection, const Vector& held_step, Vector& pull);

  Vector free_part(const Vector& all) const;                 ///< shape (num_free())
  Vector only_free(const Vector& free) const;                ///< of all components: these free ones, 0 for held ones
  Vector held_step(const Vector& u, double fraction) const;  ///< to where they are prescribed; 0 for free ones

private:
  static constexpr int most_nodes = 10, most_points = 4;
  struct Point {
    Eigen::Matrix<double, Eigen::Dynamic, 3, 0, most_nodes, 3> gradients;  ///< of the shape functions [1/mm]
    double volume;
  };
  Mat3 deformation(std::size_t tet, const Point& point, const Vector& u) const;

  const TetProblem& problem_;
  TetLaw law_;
  int nodes_each_, points_each_;
  std::vector<Point> points_;       ///< of all tetrahedra
  std::vector<Mat3> edges_;         ///< of each
  std::vector<std::int32_t> free_;  ///< number of each component among the free ones, -1 where held
  Eigen::Index num_free_ = 0;
  Matrix matrix_;
  std::vector<std::int32_t> slot_;  ///< of each entry of each element matrix in the values of matrix_, -1 for none
};

}  // namespace hexsolver
