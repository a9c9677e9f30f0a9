// SPDX-License-Identifier: Apache-2.0
#include "terms/inertia.h"

#include <fmt/format.h>

#include <limits>

#include "core/parallel.h"
#include "hexmesh/core/bytes.h"
#include "hexmesh/core/error.h"

namespace hexsolver {

using Eigen::Index;

std::vector<NodeWeights> lumped_masses(const MeshCells& cells) {
  std::vector<NodeWeights> masses;
  for (const MeshCells::OfLevel& of : cells.levels()) {
    const hexmesh::StoredMatrices& stored = cells.lattice().level(of.level).matrices;
    const hexmesh::ElementMatrices matrices(cells.lattice().cell_edges(of.level));
    if (stored.empty())
      for (const hexmesh::Element& e : form_elements(cells.lattice(), of)) masses.push_back(matrices.lumped_mass(e));
    else if (of.element.empty())
      for (std::size_t e = 0; e < stored.size(); ++e) masses.push_back(stored.lumped_mass(e));
    else
      for (const std::int32_t e : of.element) masses.push_back(stored.lumped_mass(hexmesh::as_size(e)));
  }
  return masses;
}

Inertia::Inertia(const Mesh& mesh, std::vector<std::int32_t> elements, std::vector<NodeWeights> masses, double damping)
    : elements_(std::move(elements)), masses_(std::move(masses)), damping_(damping) {
  std::vector<double> of_all(mesh.num_all_nodes());
  mesh.for_each_cell([&](std::size_t c) {
    const NodeWeights& m = masses_[elements_[c]];
    for (std::size_t a = 0; a < 8; ++a) of_all[mesh.node(c, a)] += m[a];
  });
  node_masses_.assign(of_all.begin(), of_all.begin() + static_cast<std::ptrdiff_t>(mesh.num_nodes()));
  mesh.for_each_support([&](std::size_t hanging, std::int32_t n, double weight) {
    node_masses_[hexmesh::as_size(n)] += weight * of_all[mesh.num_nodes() + hanging];
  });
  for (const double m : node_masses_)
    if (!(m > 0))
      throw hexmesh::Error(hexmesh::ErrorKind::input,
                           "a part of the body has no mass, expected density_kg_m3 > 0 of every segment in a motion");
}

void Inertia::set_step(const NodeVector& u, const NodeVector& velocity, double h) {
  stiffness_ = (1 / h + damping_) / h;
  aim_ = u + h / (1 + damping_ * h) * velocity;
  double sum = 0;
  for (std::size_t n = 0; n < node_masses_.size(); ++n) sum += node_masses_[n] * aim_.segment<3>(3 * n).norm();
  rounding_ = 4 * std::numeric_limits<double>::epsilon() * stiffness_ * sum;
}

void Inertia::inertial_predictor(const Vec3& acceleration, const NodeVector& u, NodeVector& d) const {
  d = aim_ - u;
  for (Index n = 0; n < d.size(); n += 3) d.segment<3>(n) += acceleration / stiffness_;
}

double Inertia::energy(const NodeVector& u) const {
  double sum = 0;
  for (std::size_t n = 0; n < node_masses_.size(); ++n) {
    const auto at = 3 * static_cast<Index>(n);
    sum += node_masses_[n] * (u.segment<3>(at) - aim_.segment<3>(at)).squaredNorm();
  }
  return stiffness_ / 2 * sum;
}

void Inertia::add_gradient(const NodeVector& u, NodeVector& gradient, NodeVector& magnitude) const {
  parallel_for(aim_.size(), [&](Index n) {
    const double force = stiffness_ * node_masses_[n / 3] * (u[n] - aim_[n]);
    gradient[n] += force;
    magnitude[n] += std::abs(force);
  });
}

template <class Vector>
void Inertia::add_product_of(const Vector& x, Vector& y) const {
  using Real = typename Vector::Scalar;
  const auto size = 3 * static_cast<Index>(node_masses_.size());
  parallel_for(size, [&](Index n) { y[n] += static_cast<Real>(stiffness_ * node_masses_[n / 3]) * x[n]; });
}

void Inertia::add_product(const NodeVector& x, NodeVector& y) const { add_product_of(x, y); }
void Inertia::add_product(const FloatNodeVector& x, FloatNodeVector& y) const { add_product_of(x, y); }

void Inertia::add_cell_hessian(std::size_t cell, CellMatrix& h) const {
  const NodeWeights& m = masses_[elements_[cell]];
  for (int a = 0; a < 24; ++a) h(a, a) += stiffness_ * m[a / 3];
}

void Inertia::add_diagonal(std::size_t cell, NodeBlocks& blocks) const {
  const NodeWeights& m = masses_[elements_[cell]];
  for (std::size_t a = 0; a < 8; ++a) blocks[a].diagonal().array() += stiffness_ * m[a];
}

std::size_t Inertia::bytes() const {
  return hexmesh::bytes_of(elements_) + hexmesh::bytes_of(masses_) + hexmesh::bytes_of(node_masses_) +
         sizeof(double) * static_cast<std::size_t>(aim_.size());
}

double Inertia::kinetic_energy(const NodeVector& velocity) const {
  double sum = 0;
  for (std::size_t n = 0; n < node_masses_.size(); ++n)
    sum += node_masses_[n] * velocity.segment<3>(3 * n).squaredNorm();
  return sum / 2;
}

Vec3 Inertia::momentum(const NodeVector& velocity) const {
  Vec3 sum = Vec3::Zero();
  for (std::size_t n = 0; n < node_masses_.size(); ++n) sum += node_masses_[n] * velocity.segment<3>(3 * n);
  return sum;
}

}  // namespace hexsolver
