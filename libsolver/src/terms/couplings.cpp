// SPDX-License-Identifier: Apache-2.0
#include "terms/couplings.h"

#include <map>

namespace hexsolver {

template <class Vector>
void add_product(const Mesh& mesh, const std::vector<Coupling>& couplings, const Vector& x, Vector& y) {
  using Real = typename Vector::Scalar;
  const auto add = [&](std::int32_t cell, const NodeWeights& weights, const Vec3& force) {
    for (int a = 0; a < 8; ++a)
      y.template segment<3>(
          3 * static_cast<Eigen::Index>(mesh.node(static_cast<std::size_t>(cell), static_cast<std::size_t>(a)))) -=
          (weights[a] * force).template cast<Real>();
  };
  for (const Coupling& c : couplings) {
    const Vec3 of_a = mesh.interpolate(c.a, c.of_a, x), of_b = mesh.interpolate(c.b, c.of_b, x);
    add(c.a, c.of_a, c.hessian * of_b);
    add(c.b, c.of_b, c.hessian * of_a);
  }
}
template void add_product(const Mesh&, const std::vector<Coupling>&, const NodeVector&, NodeVector&);
template void add_product(const Mesh&, const std::vector<Coupling>&, const FloatNodeVector&, FloatNodeVector&);

std::vector<CellCoupling> sums_of_cells(const std::vector<Coupling>& couplings) {
  std::vector<CellCoupling> out;
  std::map<std::pair<std::int32_t, std::int32_t>, std::size_t> number;
  for (const Coupling& c : couplings) {
    const auto [entry, is_new] = number.try_emplace({c.a, c.b}, out.size());
    if (is_new) out.push_back({c.a, c.b, CellMatrix::Zero()});
    CellMatrix& sum = out[entry->second].matrix;
    for (int i = 0; i < 8; ++i)
      for (int j = 0; j < 8; ++j)
        if (const double weight = c.of_a[i] * c.of_b[j]; weight != 0)
          sum.block<3, 3>(3 * i, 3 * j) -= weight * c.hessian;
  }
  return out;
}

std::vector<Coupling> passed_to_parents(const std::vector<Coupling>& couplings, const hexmesh::Merge& merge,
                                        std::size_t num_cells) {
  if (couplings.empty()) return {};
  std::vector<std::pair<std::int32_t, int>> place(num_cells);  // parent, slot
  for (std::size_t p = 0; p < merge.children.size(); ++p)
    for (int slot = 0; slot < 8; ++slot)
      if (const std::int32_t child = merge.children[p][static_cast<std::size_t>(slot)]; child >= 0)
        place[static_cast<std::size_t>(child)] = {static_cast<std::int32_t>(p), slot};
  const auto pass = [&](std::int32_t& cell, NodeWeights& weights) {
    const auto [parent, slot] = place[static_cast<std::size_t>(cell)];
    NodeWeights sum = NodeWeights::Zero();
    for (int a = 0; a < 8; ++a)
      sum += weights[a] * hexmesh::weights_in_parent(slot, a, merge.factor_of(static_cast<std::size_t>(parent)));
    cell = parent;
    weights = sum;
  };
  std::vector<Coupling> out = couplings;
  for (Coupling& c : out) {
    pass(c.a, c.of_a);
    pass(c.b, c.of_b);
  }
  return out;
}

}  // namespace hexsolver
