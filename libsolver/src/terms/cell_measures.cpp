// SPDX-License-Identifier: Apache-2.0
#include "terms/cell_measures.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <bit>
#include <cmath>
#include <functional>
#include <numbers>

#include "core/parallel.h"
#include "core/rotation.h"

namespace hexsolver {
namespace {

void smooth_pressure(const ElasticCells& cells, const std::function<bool(const Index3&)>& counts,
                     CellMeasures& measures) {
  const Mesh& mesh = cells.mesh();
  struct AtNode {
    double sum = 0, volume = 0, alternating = 0;
    int cells = 0;
  };
  std::vector<AtNode> at(mesh.num_all_nodes());
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
    const double p = measures.pressure[c], volume = cells.model(c).volume;
    for (std::size_t a = 0; a < 8; ++a) {
      AtNode& node = at[mesh.node(c, a)];
      const double sign = std::popcount(a) % 2 == 0 ? 1 : -1;  // around a node no two cells side by side have the same
      node.sum += volume * p;
      node.volume += volume;
      node.alternating += sign * p / 8;
      ++node.cells;
    }
  }
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
    double mean = 0;
    for (int a = 0; a < 8; ++a) {
      const AtNode& node = at[mesh.node(c, a)];
      mean += cells.model(c).mean_shape[a] * node.sum / node.volume;
    }
    measures.smoothed_pressure.push_back(mean);
  }
  double squares = 0;
  std::size_t count = 0;
  for (std::size_t n = 0; n < at.size(); ++n)
    if (at[n].cells == 8 && (!counts || counts(mesh.nodes()[n]))) {
      squares += at[n].alternating * at[n].alternating;
      ++count;
    }
  if (count > 0) measures.pressure_checkerboard = std::sqrt(squares / static_cast<double>(count));
  measures.checkerboard_nodes = count;
}

}  // namespace

CellMeasures measure_cells(const ElasticCells& cells, const NodeVector& u,
                           const std::function<bool(const Index3&)>& counts) {
  CellMeasures out;
  const std::size_t count = cells.mesh().num_cells();
  for (std::vector<double>* values : {&out.principal_stretch[0], &out.principal_stretch[1], &out.principal_stretch[2],
                                      &out.rotation_degrees, &out.von_mises_stress, &out.pressure, &out.young_modulus,
                                      &out.poisson_ratio, &out.min_jacobian, &out.volume_ratio, &out.inverted_part})
    values->resize(count);
  parallel_for(count, [&](std::ptrdiff_t cell) {
    const auto c = static_cast<std::size_t>(cell);
    const Mat3 f = cells.mean_gradient(c, u), elastic = cells.mean_elastic_gradient(c, u);
    const Polar polar = polar_decomposition(elastic);
    Vec3 stretches =
        Eigen::SelfAdjointEigenSolver<Mat3>(polar.stretch, Eigen::EigenvaluesOnly).eigenvalues().cwiseAbs();
    std::sort(stretches.data(), stretches.data() + 3, std::greater<>());
    for (std::size_t d = 0; d < 3; ++d) out.principal_stretch[d][c] = stretches[d];
    const Mat3 rotation = f == elastic ? polar.rotation : polar_decomposition(f).rotation;
    out.rotation_degrees[c] = rotation_angle(rotation) * 180 / std::numbers::pi;
    const Mat3 stress = cells.stress(c, u);
    out.pressure[c] = -stress.trace() / 3;
    out.von_mises_stress[c] = std::sqrt(1.5) * (stress + out.pressure[c] * Mat3::Identity()).norm();
    const double mu = cells.model(c).shear, kappa = cells.model(c).bulk;
    out.young_modulus[c] = 9 * kappa * mu / (3 * kappa + mu);
    out.poisson_ratio[c] = (3 * kappa - 2 * mu) / (2 * (3 * kappa + mu));
    const Jacobians jacobians = cells.jacobians(c, u);
    out.min_jacobian[c] = jacobians.least;
    out.volume_ratio[c] = jacobians.mean;
    out.inverted_part[c] = jacobians.inside_out;
  });
  smooth_pressure(cells, counts, out);
  return out;
}

std::vector<bool> cells_near_folds(const ElasticCells& cells, const NodeVector& u, double least,
                                   const std::function<void(std::vector<bool>&)>& share_nodes) {
  const Mesh& mesh = cells.mesh();
  std::vector<char> folds(mesh.num_cells());
  parallel_for(mesh.num_cells(), [&](std::ptrdiff_t c) {
    folds[static_cast<std::size_t>(c)] = cells.jacobians(static_cast<std::size_t>(c), u).least < least;
  });
  std::vector<bool> at_fold(mesh.num_all_nodes()), out(mesh.num_cells());
  for (std::size_t c = 0; c < folds.size(); ++c)
    for (std::size_t a = 0; folds[c] && a < 8; ++a) at_fold[mesh.node(c, a)] = true;
  if (share_nodes) share_nodes(at_fold);
  for (std::size_t c = 0; c < folds.size(); ++c)
    for (std::size_t a = 0; a < 8; ++a) out[c] = out[c] || at_fold[mesh.node(c, a)];
  return out;
}

}  // namespace hexsolver
