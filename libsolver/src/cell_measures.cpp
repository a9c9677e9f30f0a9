// SPDX-License-Identifier: Apache-2.0
#include "hexsolver/cell_measures.h"

#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include "hexmesh/lattice/element_tree.h"
#include "hexsolver/rotation.h"

namespace hexsolver {
namespace {

double angle_degrees(const Mat3& rotation) {
  return std::acos(std::clamp((rotation.trace() - 1) / 2, -1.0, 1.0)) * 180 / std::numbers::pi;
}

}  // namespace

CellMeasures measure_cells(const hexmesh::Lattice& lattice, int level, const Mesh& mesh, Strain strain,
                           const NodeVector& u) {
  const hexmesh::ElementMatrices matrices(lattice.cell_edges(level));
  std::vector<CellVector> gradients;  // b / V
  std::vector<double> shear, young, poisson;
  for (const hexmesh::Element& e : hexmesh::form_elements(lattice, level)) {
    gradients.emplace_back(matrices.divergence(e) / e.volume());
    const double mu = std::accumulate(e.shear.begin(), e.shear.end(), 0.0) / e.volume();
    const double kappa = e.total_bulk() / e.volume();
    shear.push_back(mu);
    young.push_back(9 * kappa * mu / (3 * kappa + mu));
    poisson.push_back((3 * kappa - 2 * mu) / (2 * (3 * kappa + mu)));
  }
  CellMeasures out;
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
    const auto element = static_cast<std::size_t>(lattice.levels[static_cast<std::size_t>(level)].element[c]);
    const CellVector moved = mesh.gather(c, u);
    Mat3 f = Mat3::Identity();
    for (int a = 0; a < 8; ++a) f += moved.segment<3>(3 * a) * gradients[element].segment<3>(3 * a).transpose();

    const Polar polar = polar_decomposition(f);
    const Vec3 stretches = Eigen::JacobiSVD<Mat3>(f).singularValues();
    for (std::size_t d = 0; d < 3; ++d) out.principal_stretch[d].push_back(stretches[static_cast<Eigen::Index>(d)]);
    out.rotation_degrees.push_back(angle_degrees(polar.rotation));
    Mat3 eps = strain == Strain::cauchy ? Mat3((f + f.transpose()) / 2) : polar.stretch;
    eps -= Mat3::Identity() * eps.trace() / 3;
    out.von_mises_stress.push_back(std::sqrt(1.5) * 2 * shear[element] * eps.norm());
    out.young_modulus.push_back(young[element]);
    out.poisson_ratio.push_back(poisson[element]);
    const double jacobian = f.determinant();
    out.min_jacobian = std::min(out.min_jacobian, jacobian);
    out.inverted_cells += jacobian <= 0;
  }
  return out;
}

}  // namespace hexsolver
