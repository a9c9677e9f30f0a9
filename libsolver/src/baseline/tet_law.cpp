// SPDX-License-Identifier: Apache-2.0
#include "baseline/tet_law.h"

#include <Eigen/Eigenvalues>
#include <limits>

#include "core/rotation.h"

namespace hexsolver {
namespace {

/// That of Hooke's law in a frame R: dP = R C : sym(R^T dF).
Tangent hooke_tangent(const Mat3& rotation, double shear, double lambda) {
  return {rotation, Mat3::Identity(), 2 * shear * Mat3::Identity() + lambda * Mat3::Ones(), Vec3::Constant(shear),
          Vec3::Constant(shear)};
}

/// Hooke's law in a frame that is held.
TetState held_frame(const Mat3& f, const Mat3& rotation, double shear, double lambda) {
  const Mat3 turned_back = rotation.transpose() * f;
  const Mat3 strain = (turned_back + turned_back.transpose()) / 2 - Mat3::Identity();
  const Mat3 stress = 2 * shear * strain + lambda * strain.trace() * Mat3::Identity();
  return {strain.cwiseProduct(stress).sum() / 2, rotation * stress, hooke_tangent(rotation, shear, lambda)};
}

/// As held_frame() with R of the polar decomposition, but exact in the change of R.
/// Source of the tangent: Smith, de Goes, Kim, "Analytic eigensystems for isotropic distortion energies" (2019).
TetState polar_frame(const Mat3& f, double shear, double lambda) {
  const Polar polar = polar_decomposition(f);
  TetState state = held_frame(f, polar.rotation, shear, lambda);
  Eigen::SelfAdjointEigenSolver<Mat3> eigen;
  eigen.computeDirect(polar.stretch);
  const Vec3 s = eigen.eigenvalues();
  Tangent& t = state.tangent;
  t.u = polar.rotation * eigen.eigenvectors();
  t.v = eigen.eigenvectors();
  for (int k = 0; k < 3; ++k) {
    const double sum = std::max(s[(k + 1) % 3] + s[(k + 2) % 3], polar_floor);
    const double turning = 2 * shear + (lambda * (s.sum() - 3) - 2 * shear) * 2 / sum;
    t.same[k] = shear + turning / 2;
    t.other[k] = shear - turning / 2;
  }
  return state;
}

}  // namespace

TetState tet_state(TetLaw law, const Mat3& f, const Mat3& edges, double shear, double lambda) {
  switch (law) {
    case TetLaw::cauchy:
      return held_frame(f, Mat3::Identity(), shear, lambda);
    case TetLaw::corotational:
      return polar_frame(f, shear, lambda);
    case TetLaw::corotational_qr:
      return held_frame(f, orthonormalized(f * edges) * orthonormalized(edges).transpose(), shear, lambda);
    case TetLaw::green_lagrange:
      break;
  }
  const Invariants at = invariants(f - Mat3::Identity());
  const EnergyDensity w = energy_density(Elasticity::green_lagrange, at, shear, lambda + 2 * shear / 3);
  const double energy = at.dilation > -1 ? w.value : std::numeric_limits<double>::infinity();
  return {energy, first_piola(w, f), tangent(w, f)};
}

Eigen::Matrix<double, 9, 9> tangent_matrix(const Tangent& t) {
  // dP = U dP' V^T, dF' = U^T dF V
  Eigen::Matrix<double, 9, 9> inner = Eigen::Matrix<double, 9, 9>::Zero(), turn;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) inner(4 * i, 4 * j) = t.stretch(i, j);
    const int j = (i + 1) % 3, k = (i + 2) % 3;
    inner(i + 3 * j, i + 3 * j) = inner(j + 3 * i, j + 3 * i) = t.same[k];
    inner(i + 3 * j, j + 3 * i) = inner(j + 3 * i, i + 3 * j) = t.other[k];
  }
  for (int j = 0; j < 3; ++j)
    for (int b = 0; b < 3; ++b) turn.block<3, 3>(3 * j, 3 * b) = t.v(b, j) * t.u.transpose();
  return turn.transpose() * inner * turn;
}

}  // namespace hexsolver
