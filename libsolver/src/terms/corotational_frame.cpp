// SPDX-License-Identifier: Apache-2.0
#include "terms/corotational_frame.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <cmath>

#include "core/rotation.h"

namespace hexsolver {
namespace {

std::array<double, 6> upper(const Mat3& m) { return {m(0, 0), m(0, 1), m(0, 2), m(1, 1), m(1, 2), m(2, 2)}; }
Mat3 symmetric(const std::array<double, 6>& m) {
  Mat3 out;
  out << m[0], m[1], m[2], m[1], m[3], m[4], m[2], m[4], m[5];
  return out;
}

}  // namespace

StressTerm stress_term(const CorotationalFrame& f, const NodeGradients& gradient) {
  StressTerm e;
  e.a = f.a;
  for (int a = 0; a < 8; ++a) {
    const Vec3 ga = gradient.row(a), fa = f.f.segment<3>(3 * a);
    e.t.block<3, 3>(0, 3 * a) = f.inverse_m * cross_matrix(ga);
    e.l.block<3, 3>(0, 3 * a) = f.h * ga.transpose() - ga * f.h.transpose() + cross_matrix(fa);
  }
  return e;
}

Mat3 stress_matrix(const CorotationalFrame& f) {
  const Eigen::Map<const Eigen::Matrix<double, 3, 8>> y(f.y.data()), force(f.f.data());
  const Mat3 yf = y * force.transpose(), a = yf - cross_matrix(f.h) * f.s;
  Mat3 out = 0.5 * (a + a.transpose());
  out.diagonal().array() -= yf.trace();
  return out;
}

void pack(const CorotationalFrame& f, RotatedCells<double>& cells, std::size_t lane) {
  const auto put = [lane](auto& of_lanes, const double* values) {
    for (std::size_t n = 0; n < of_lanes.size(); ++n) of_lanes[n][lane] = values[n];
  };
  put(cells.y, f.y.data());
  put(cells.f, f.f.data());
  put(cells.r, f.r.data());
  put(cells.inverse_m, upper(f.inverse_m).data());
  put(cells.a, upper(f.a).data());
  put(cells.h, f.h.data());
}

CorotationalFrame unpacked(const RotatedCells<double>& cells, std::size_t lane) {
  const auto get = [lane](const auto& of_lanes, double* values) {
    for (std::size_t n = 0; n < of_lanes.size(); ++n) values[n] = of_lanes[n][lane];
  };
  CorotationalFrame f;
  get(cells.y, f.y.data());
  get(cells.f, f.f.data());
  get(cells.r, f.r.data());
  std::array<double, 6> inverse_m, a;
  get(cells.inverse_m, inverse_m.data());
  get(cells.a, a.data());
  f.inverse_m = symmetric(inverse_m);
  f.a = symmetric(a);
  get(cells.h, f.h.data());
  return f;
}

PositivePart positive_part(const StressTerm& e) {
  // E = T^T N + N^T T with N = L + A T / 2 is (P^T P - M^T M) / 2 with P, M = S T +- S^-T N for any S. P^T P + M^T M is
  // least, and what is kept nearest to the positive part, where S^T S is the geometric mean of (T T^T)^-1 and N N^T.
  constexpr double nothing = 1e-12;  // of the largest
  const Eigen::Matrix<double, 3, 24> n = e.l + (0.5 * e.a).lazyProduct(e.t);
  Eigen::SelfAdjointEigenSolver<Mat3> of_t, of_both;
  of_t.computeDirect(e.t.lazyProduct(e.t.transpose()));
  const Vec3 sizes = of_t.eigenvalues().cwiseMax(nothing * of_t.eigenvalues()[2]).cwiseSqrt();
  const Mat3& q = of_t.eigenvectors();
  const Mat3 root = q * sizes.asDiagonal() * q.transpose(),
             inverse = q * sizes.cwiseInverse().asDiagonal() * q.transpose();
  const Mat3 nn = n.lazyProduct(n.transpose());
  of_both.computeDirect(root * nn * root);
  PositivePart z;
  for (int i = 0; i < 3; ++i) {
    const double squared = of_both.eigenvalues()[i];
    if (!(squared > nothing * of_both.eigenvalues()[2]) || !(sizes[0] > 0)) continue;
    const double scale = std::sqrt(0.5 * std::sqrt(squared));
    const Vec3 v = of_both.eigenvectors().col(i);
    z.c.col(i) = 1 / (2 * scale) * (root * v);
    z.b.col(i) = scale * (inverse * v) + 0.5 * (e.a * z.c.col(i));
  }
  return z;
}

void pack(const PositivePart& part, PositiveParts& parts, std::size_t lane) {
  for (std::size_t n = 0; n < 9; ++n) {
    parts.b[n][lane] = static_cast<float>(part.b.data()[n]);
    parts.c[n][lane] = static_cast<float>(part.c.data()[n]);
  }
}

PositivePart unpacked(const PositiveParts& parts, std::size_t lane) {
  PositivePart part;
  for (std::size_t n = 0; n < 9; ++n) {
    part.b.data()[n] = static_cast<double>(parts.b[n][lane]);
    part.c.data()[n] = static_cast<double>(parts.c[n][lane]);
  }
  return part;
}

}  // namespace hexsolver
