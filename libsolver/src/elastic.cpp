// SPDX-License-Identifier: Apache-2.0
#include "hexsolver/elastic.h"

#include <Eigen/Geometry>
#include <Eigen/LU>

#include "cell_product.h"

namespace hexsolver {
namespace {

CellVector times(const CellMatrix& k, const CellVector& x) {
  CellVector y;
  multiply24(k.data(), x.data(), y.data());
  return y;
}

/// Rotate the vector of each node.
CellVector rotate(const Mat3& r, const CellVector& x) {
  CellVector y;
  for (int a = 0; a < 8; ++a) y.segment<3>(3 * a) = r * x.segment<3>(3 * a);
  return y;
}

Mat3 cross_matrix(const Vec3& v) {
  Mat3 m;
  m << 0, -v[2], v[1], v[2], 0, -v[0], -v[1], v[0], 0;
  return m;
}

}  // namespace

Elastic::Elastic(const Mesh& mesh, std::vector<std::int32_t> elements, std::vector<CellMatrix> stiffness,
                 Strain strain)
    : mesh_(mesh), elements_(std::move(elements)), stiffness_(std::move(stiffness)), strain_(strain) {
  const Mat3 inverse = mesh.edges().inverse();
  gradients_ = hexmesh::shape_gradients(Vec3::Constant(0.5)) * inverse;
  for (int a = 0; a < 8; ++a) {
    Vec3 corner;
    for (int d = 0; d < 3; ++d) corner[d] = hexmesh::corner_bit(a, d) - 0.5;
    rest_.segment<3>(3 * a) = mesh.edges() * corner;
  }
}

Elastic::Frame Elastic::frame(std::size_t cell, const NodeVector& u) const {
  CellVector x = mesh_.gather(cell, u) + rest_;
  Vec3 mean = Vec3::Zero();
  Mat3 f = Mat3::Zero();
  for (int a = 0; a < 8; ++a) mean += x.segment<3>(3 * a) / 8;
  for (int a = 0; a < 8; ++a) {
    x.segment<3>(3 * a) -= mean;
    f += x.segment<3>(3 * a) * gradients_.row(a);
  }
  const Polar polar = polar_decomposition(f);
  Frame frame{polar.rotation, polar.stretch, polar.inverse_m, rotate(polar.rotation.transpose(), x), {}, {}};
  frame.f = times(stiffness_[static_cast<std::size_t>(elements_[cell])], frame.y - rest_);
  Vec3 torque = Vec3::Zero();
  for (int a = 0; a < 8; ++a)
    torque += Vec3(frame.y.segment<3>(3 * a)).cross(Vec3(frame.f.segment<3>(3 * a)));
  frame.h = polar.inverse_m * torque;
  return frame;
}

std::vector<double> Elastic::cell_energies(const NodeVector& u) const {
  std::vector<double> energies(mesh_.num_cells());
  mesh_.for_each_cell([&](std::size_t c) {
    if (strain_ == Strain::cauchy) {
      const CellVector v = mesh_.gather(c, u);
      energies[c] = 0.5 * v.dot(times(stiffness_[static_cast<std::size_t>(elements_[c])], v));
    } else {
      const Frame f = frame(c, u);
      energies[c] = 0.5 * (f.y - rest_).dot(f.f);
    }
  });
  return energies;
}

double Elastic::energy(const NodeVector& u) const {
  const std::vector<double> energies = cell_energies(u);
  return Eigen::Map<const Eigen::VectorXd>(energies.data(), static_cast<Eigen::Index>(energies.size())).sum();
}

void Elastic::gradient(const NodeVector& u, NodeVector& gradient, NodeVector& magnitude) const {
  gradient.setZero(static_cast<Eigen::Index>(mesh_.num_dofs()));
  magnitude.setZero(static_cast<Eigen::Index>(mesh_.num_dofs()));
  mesh_.for_each_cell([&](std::size_t c) {
    CellVector force;
    if (strain_ == Strain::cauchy) {
      force = times(stiffness_[static_cast<std::size_t>(elements_[c])], mesh_.gather(c, u));
    } else {
      Frame f = frame(c, u);
      for (int a = 0; a < 8; ++a) f.f.segment<3>(3 * a) -= f.h.cross(Vec3(gradients_.row(a)));
      force = rotate(f.r, f.f);
    }
    mesh_.scatter_add(c, force, gradient);
    mesh_.scatter_add(c, force.cwiseAbs(), magnitude);
  });
}

void Elastic::linearize(const NodeVector& u, double stress_weight) {
  if (strain_ == Strain::cauchy) return;
  stress_weight_ = stress_weight;
  frames_.resize(mesh_.num_cells());
  mesh_.for_each_cell([&](std::size_t c) { frames_[c] = frame(c, u); });
}

void Elastic::apply(const NodeVector& x, NodeVector& y) const {
  y.setZero(static_cast<Eigen::Index>(mesh_.num_dofs()));
  if (strain_ == Strain::cauchy) {
    mesh_.for_each_cell([&](std::size_t c) {
      mesh_.scatter_add(c, times(stiffness_[static_cast<std::size_t>(elements_[c])], mesh_.gather(c, x)), y);
    });
    return;
  }
  mesh_.for_each_cell([&](std::size_t c) {
    const Frame& f = frames_[c];
    const CellVector v = rotate(f.r.transpose(), mesh_.gather(c, x));
    Vec3 axial = Vec3::Zero();
    Mat3 b = Mat3::Zero();
    for (int a = 0; a < 8; ++a) {
      const Vec3 va = v.segment<3>(3 * a), ga = gradients_.row(a);
      axial += ga.cross(va);
      b += va * ga.transpose();
    }
    const Vec3 w = f.inverse_m * axial;
    CellVector dy;
    for (int a = 0; a < 8; ++a) dy.segment<3>(3 * a) = v.segment<3>(3 * a) - w.cross(Vec3(f.y.segment<3>(3 * a)));
    CellVector df = times(stiffness_[static_cast<std::size_t>(elements_[c])], dy);
    Vec3 torque = Vec3::Zero(), stress_torque = Vec3::Zero();
    for (int a = 0; a < 8; ++a) {
      torque += Vec3(f.y.segment<3>(3 * a)).cross(Vec3(df.segment<3>(3 * a)));
      stress_torque += Vec3(dy.segment<3>(3 * a)).cross(Vec3(f.f.segment<3>(3 * a)));
    }
    const Mat3 ds = b - cross_matrix(w) * f.s;
    stress_torque -= ds.trace() * f.h - ds * f.h;
    const Vec3 dh = f.inverse_m * (torque + stress_weight_ * stress_torque);
    for (int a = 0; a < 8; ++a) {
      const Vec3 ga = gradients_.row(a);
      const Vec3 p = Vec3(f.f.segment<3>(3 * a)) - f.h.cross(ga);
      df.segment<3>(3 * a) += stress_weight_ * w.cross(p) - dh.cross(ga);
    }
    mesh_.scatter_add(c, rotate(f.r, df), y);
  });
}

CellMatrix Elastic::cell_hessian(std::size_t cell) const {
  const CellMatrix& k = stiffness_[static_cast<std::size_t>(elements_[cell])];
  if (strain_ == Strain::cauchy) return k;
  // The linear maps of apply() written as matrices: w = T v, dh = M^-1 D v, H = K + (P - K Y) T + G M^-1 D.
  using Columns = Eigen::Matrix<double, 24, 3>;
  using Rows = Eigen::Matrix<double, 3, 24>;
  const Frame& f = frames_[cell];
  Columns y, g, p;
  Rows stress;
  Vec3 sh = f.s * f.h;
  Rows trace_part;
  for (int a = 0; a < 8; ++a) {
    const Vec3 ga = gradients_.row(a);
    const Vec3 pa = Vec3(f.f.segment<3>(3 * a)) - f.h.cross(ga);
    y.block<3, 3>(3 * a, 0) = -cross_matrix(f.y.segment<3>(3 * a));
    g.block<3, 3>(3 * a, 0) = cross_matrix(ga);
    p.block<3, 3>(3 * a, 0) = -stress_weight_ * cross_matrix(pa);
    stress.block<3, 3>(0, 3 * a) = -cross_matrix(f.f.segment<3>(3 * a));
    trace_part.block<3, 3>(0, 3 * a) = f.h * ga.transpose();
    trace_part.block<3, 3>(0, 3 * a).diagonal().array() -= ga.dot(f.h);
  }
  const Rows t = -f.inverse_m * g.transpose();
  const Columns ky = k * y;
  const Rows torque = ky.transpose() - (y.transpose() * ky) * t;
  const Rows stress_torque = stress - (stress * y) * t - trace_part + cross_matrix(sh) * t;
  const Rows d = torque + stress_weight_ * stress_torque;
  CellMatrix h = k + (p - ky) * t + g * (f.inverse_m * d);
  CellMatrix out;
  for (int a = 0; a < 8; ++a)
    for (int b = 0; b <= a; ++b) {
      const Mat3 block = 0.5 * (h.block<3, 3>(3 * a, 3 * b) + h.block<3, 3>(3 * b, 3 * a).transpose());
      out.block<3, 3>(3 * a, 3 * b) = f.r * block * f.r.transpose();
      out.block<3, 3>(3 * b, 3 * a) = out.block<3, 3>(3 * a, 3 * b).transpose();
    }
  return out;
}

}  // namespace hexsolver
