// SPDX-License-Identifier: Apache-2.0
#include "terms/hyperelastic.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <cassert>
#include <cmath>
#include <limits>

#include "core/rotation.h"
#include "hexmesh/core/bytes.h"
#include "kernels/cell_hessian.h"
#include "kernels/cell_matrices.h"
#include "kernels/cell_vectors.h"

namespace hexsolver {
namespace {

/// J F^-T, also where F is flat.
Mat3 cofactor(const Mat3& f) {
  Mat3 c;
  c << f.col(1).cross(f.col(2)), f.col(2).cross(f.col(0)), f.col(0).cross(f.col(1));
  return c;
}

EnergyDensity green_lagrange(const Invariants& at, double shear, double bulk) {
  const double lambda = bulk - 2 * shear / 3;
  return {.value = shear * at.squared + lambda / 2 * at.trace * at.trace,
          .d1 = -shear / 2 + lambda / 2 * at.trace,
          .d2 = shear / 4,
          .d11 = lambda / 4};
}

EnergyDensity neo_hookean(const Invariants& at, double shear, double bulk) {
  const double i1 = 3 + 2 * at.trace, j = 1 + at.dilation, log_j = std::log1p(at.dilation);
  const double power = std::exp(-2.0 / 3 * log_j);
  return {
      .value = shear * (power * at.trace + 1.5 * std::expm1(-2.0 / 3 * log_j)) + bulk / 2 * at.dilation * at.dilation,
      .d1 = shear / 2 * power,
      .dj = -shear / 3 * power / j * i1 + bulk * at.dilation,
      .d1j = -shear / 3 * power / j,
      .djj = 5.0 / 9 * shear * power / (j * j) * i1 + bulk};
}

EnergyDensity stable_neo_hookean(const Invariants& at, double shear, double bulk) {
  const double inverse = 1 / (4 + 2 * at.trace);  // 1 / (I1 + 1)
  return {.value = shear * (2.0 / 3 * (2 * at.trace - std::log1p(at.trace / 2)) + at.dilation * at.dilation / 12 -
                            at.dilation) +
                   bulk / 2 * at.dilation * at.dilation,
          .d1 = 2.0 / 3 * shear * (1 - inverse),
          .dj = shear * (at.dilation / 6 - 1) + bulk * at.dilation,
          .d11 = 2.0 / 3 * shear * inverse * inverse,
          .djj = shear / 6 + bulk};
}

}  // namespace

Invariants invariants(const Mat3& h) {
  const Mat3 e = (h + h.transpose() + h.transpose() * h) / 2;
  const double trace = h.trace();
  return {e.trace(), e.squaredNorm(),
          trace + (trace * trace - h.cwiseProduct(h.transpose()).sum()) / 2 + h.determinant()};
}

EnergyDensity energy_density(Elasticity law, const Invariants& at, double shear, double bulk) {
  if (law == Elasticity::green_lagrange) return green_lagrange(at, shear, bulk);
  if (law == Elasticity::neo_hookean) return neo_hookean(at, shear, bulk);
  assert(law == Elasticity::stable_neo_hookean);
  return stable_neo_hookean(at, shear, bulk);
}

Mat3 first_piola(const EnergyDensity& w, const Mat3& f) {
  Mat3 p = 2 * w.d1 * f + w.dj * cofactor(f);
  if (w.d2 != 0) p += 4 * w.d2 * f * (f.transpose() * f);
  return p;
}

Tangent tangent(const EnergyDensity& w, const Mat3& f) {
  const Polar polar = polar_decomposition(f);
  Eigen::SelfAdjointEigenSolver<Mat3> eigen;
  eigen.computeDirect(polar.stretch);
  const Vec3 s = eigen.eigenvalues();
  const Vec3 beside(s[1] * s[2], s[2] * s[0], s[0] * s[1]);  // dJ / ds
  Tangent t{polar.rotation * eigen.eigenvectors(), eigen.eigenvectors(), {}, {}, {}};
  t.stretch = 4 * w.d11 * s * s.transpose() + w.djj * beside * beside.transpose() +
              2 * w.d1j * (s * beside.transpose() + beside * s.transpose());
  for (int k = 0; k < 3; ++k) {
    const int i = (k + 1) % 3, j = (k + 2) % 3;
    t.stretch(k, k) += 2 * w.d1 + 12 * w.d2 * s[k] * s[k];
    t.stretch(i, j) += w.dj * s[k];
    t.stretch(j, i) += w.dj * s[k];
    // Of dF'_ij = dF'_ji the factor is same + other = (P_i - P_j) / (s_i - s_j), of dF'_ij = -dF'_ji it is
    // same - other = (P_i + P_j) / (s_i + s_j).
    t.same[k] = 2 * w.d1 + 4 * w.d2 * (s[i] * s[i] + s[j] * s[j]);
    t.other[k] = 4 * w.d2 * s[i] * s[j] - w.dj * s[k];
  }
  return t;
}

Tangent projected(Tangent t, double projection) {
  const auto rest = [projection](const Vec3& v) -> Vec3 { return v.cwiseMax(0) + (1 - projection) * v.cwiseMin(0); };
  Eigen::SelfAdjointEigenSolver<Mat3> eigen;
  eigen.computeDirect(t.stretch);
  t.stretch = eigen.eigenvectors() * rest(eigen.eigenvalues()).asDiagonal() * eigen.eigenvectors().transpose();
  const Vec3 symmetric = rest(t.same + t.other), skew = rest(t.same - t.other);
  t.same = (symmetric + skew) / 2;
  t.other = (symmetric - skew) / 2;
  return t;
}

/// The gradients at the points of a cell and what they have in common.
struct HyperelasticCells::State {
  static constexpr std::size_t most_points = 3 * hexmesh::num_rule_points;
  const CellPoints* points = nullptr;
  std::array<Mat3, most_points> h;  ///< grad u
  std::array<Invariants, most_points> at;
  double volume = 0, bulk = 0;
  double mean_dilation = 0;  ///< mean J - 1
  double pressure = 0;       ///< of the bulk part per volume, tension positive; 0 without mean dilatation [MPa]
};

HyperelasticCells::HyperelasticCells(const Mesh& mesh, std::vector<std::int32_t> elements,
                                     std::vector<ElementModel> models, std::vector<CellPoints> points, Elasticity law,
                                     Volumetric volumetric)
    : ElasticCells(mesh, std::move(elements), std::move(models), std::move(points)),
      law_(law),
      volumetric_(volumetric) {
  assert(law != Elasticity::green_lagrange || volumetric == Volumetric::full);
}

HyperelasticCells::~HyperelasticCells() = default;

HyperelasticCells::State HyperelasticCells::state(std::size_t cell, const NodeVector& u) const {
  return state(points(cell), moved(cell, u));
}

HyperelasticCells::State HyperelasticCells::state(const CellPoints& points, const CellVector& moved) const {
  assert(points.size() <= State::most_points);
  State s;
  s.points = &points;
  const Eigen::Map<const Eigen::Matrix<double, 3, 8>> of_node(moved.data());
  for (std::size_t p = 0; p < s.points->size(); ++p) {
    const CellPoint& point = (*s.points)[p];
    s.h[p].noalias() = of_node * point.gradient;
    s.at[p] = invariants(s.h[p]);
    s.volume += point.volume;
    s.bulk += point.bulk;
    s.mean_dilation += point.volume * s.at[p].dilation;
  }
  s.mean_dilation /= s.volume;
  if (volumetric_ == Volumetric::mean) s.pressure = s.bulk * s.mean_dilation / s.volume;
  return s;
}

EnergyDensity HyperelasticCells::density(const CellPoint& p, const Invariants& at, double pressure) const {
  const bool mean = volumetric_ == Volumetric::mean;
  EnergyDensity w = energy_density(law_, at, p.shear, mean ? 0 : p.bulk);
  w.dj += pressure * p.volume;
  return w;
}

double HyperelasticCells::cell_energy(std::size_t cell, const NodeVector& u) const {
  const State s = state(cell, u);
  double sum = s.volume * s.pressure * s.mean_dilation / 2;
  for (std::size_t p = 0; p < s.points->size(); ++p) {
    if (law_ != Elasticity::stable_neo_hookean && s.at[p].dilation <= -1)
      return std::numeric_limits<double>::infinity();
    sum += density((*s.points)[p], s.at[p], s.pressure).value;
  }
  return sum;
}

Mat3 HyperelasticCells::stress(std::size_t cell, const NodeVector& u) const {
  const State s = state(cell, u);
  Mat3 kirchhoff = Mat3::Zero();
  for (std::size_t p = 0; p < s.points->size(); ++p) {
    const Mat3 f = Mat3::Identity() + s.h[p];
    kirchhoff += first_piola(density((*s.points)[p], s.at[p], s.pressure), f) * f.transpose();
  }
  return cauchy_stress(kirchhoff / s.volume, 1 + s.mean_dilation);
}

void HyperelasticCells::add_gradient(const NodeVector& u, NodeVector& gradient, NodeVector& magnitude) const {
  mesh_.for_each_cell([&](std::size_t c) {
    const CellVector force = this->force(state(c, u));
    mesh_.scatter_add(c, force, gradient);
    mesh_.scatter_add(c, force.cwiseAbs(), magnitude);
  });
}

CellVector HyperelasticCells::force(const State& s) const {
  CellVector force = CellVector::Zero();
  Eigen::Map<Eigen::Matrix<double, 3, 8>> of_node(force.data());
  for (std::size_t p = 0; p < s.points->size(); ++p) {
    const CellPoint& point = (*s.points)[p];
    const Mat3 stress = first_piola(density(point, s.at[p], s.pressure), Mat3::Identity() + s.h[p]);
    of_node.noalias() += stress * point.gradient.transpose();
  }
  return force;
}

std::optional<CellVector> HyperelasticCells::force_on_lattice(std::size_t cell, const CellVector& to_unstressed) const {
  CellPoints here;
  if (!reshape(points_on_lattice(cell), to_unstressed, here)) return {};
  return force(state(here, -to_unstressed));
}

void HyperelasticCells::linearize(const NodeVector& u, double projection) {
  if (!hessians_) hessians_ = std::make_unique<CellMatrices<float>>(mesh_);
  mesh_.for_each_cell([&](std::size_t c) {
    const State s = state(c, u);
    CellMatrix k = CellMatrix::Zero();
    CellVector dilation = CellVector::Zero();  // of sum_p volume_p J_p
    Eigen::Map<Eigen::Matrix<double, 3, 8>> dilation_of(dilation.data());
    for (std::size_t p = 0; p < s.points->size(); ++p) {
      const CellPoint& point = (*s.points)[p];
      const Mat3 f = Mat3::Identity() + s.h[p];
      Tangent t = tangent(density(point, s.at[p], s.pressure), f);
      if (projection > 0) t = projected(t, std::min(projection, Hessian::projected));
      // dF' of each dof, and dP' of that; entries (i, j) at i + 3 j
      Eigen::Matrix<double, 9, 24, Eigen::RowMajor> df, dp;
      const NodeGradients rotated = point.gradient * t.v;
      for (int a = 0; a < 8; ++a)
        for (int j = 0; j < 3; ++j) df.block<3, 3>(3 * j, 3 * a) = rotated(a, j) * t.u.transpose();
      for (int i = 0; i < 3; ++i) {
        const int j = (i + 1) % 3, other = (i + 2) % 3;
        dp.row(4 * i) = t.stretch(i, 0) * df.row(0) + t.stretch(i, 1) * df.row(4) + t.stretch(i, 2) * df.row(8);
        dp.row(i + 3 * j) = t.same[other] * df.row(i + 3 * j) + t.other[other] * df.row(j + 3 * i);
        dp.row(j + 3 * i) = t.same[other] * df.row(j + 3 * i) + t.other[other] * df.row(i + 3 * j);
      }
      add_products24(df.data(), dp.data(), k.data());
      dilation_of.noalias() += point.volume * cofactor(f) * point.gradient.transpose();
    }
    if (volumetric_ == Volumetric::mean) k += s.bulk / (s.volume * s.volume) * dilation * dilation.transpose();
    hessians_->set(c, k);
  });
}

void HyperelasticCells::add_product(const NodeVector& x, NodeVector& y) const {
  single_x_ = x.cast<float>();
  single_y_.setZero(x.size());
  hessians_->add_product(single_x_, single_y_);
  y += single_y_.cast<double>();
}

void HyperelasticCells::add_product(const FloatNodeVector& x, FloatNodeVector& y) const {
  hessians_->add_product(x, y);
}

void HyperelasticCells::add_cell_hessian(std::size_t cell, CellMatrix& h) const { h += hessians_->get(cell); }

std::size_t HyperelasticCells::bytes() const {
  return ElasticCells::bytes() + (hessians_ ? hessians_->bytes() : 0) +
         sizeof(float) * static_cast<std::size_t>(single_x_.size() + single_y_.size());
}

std::string HyperelasticCells::limit_reached(const NodeVector& u, bool nearly) const {
  if (law_ != Elasticity::green_lagrange) return {};
  // Under uniaxial stress the force falls below a stretch of 1 / sqrt(3).
  const double limit = nearly ? 0.65 : 1 / std::sqrt(3.0);
  double least = 1;
  for (std::size_t c = 0; c < mesh_.num_cells(); ++c) {
    const State s = state(c, u);
    for (std::size_t p = 0; p < s.points->size(); ++p) {
      const Mat3 f = Mat3::Identity() + s.h[p];
      const Eigen::SelfAdjointEigenSolver<Mat3> eigen(f.transpose() * f, Eigen::EigenvaluesOnly);
      least = std::min(least, std::sqrt(std::max(0.0, eigen.eigenvalues()[0])));
    }
  }
  if (least > limit) return {};
  return fmt::format(
      "Green-Lagrange cells are compressed to {:.2f} of their length, and below 0.58 they get weaker the more they are "
      "compressed; expected strain = \"corotational\" or law = \"neo-hookean\"",
      least);
}

}  // namespace hexsolver
