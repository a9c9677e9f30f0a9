// SPDX-License-Identifier: Apache-2.0
#include "terms/couplings.h"

#include "kernels/cell_hessian.h"

namespace hexsolver {

void Couplings::clear() {
  pairs_.clear();
  number_.clear();
}

CellMatrix& Couplings::matrix_of(std::int32_t a, std::int32_t b) {
  const auto [entry, is_new] = number_.try_emplace({a, b}, pairs_.size());
  if (is_new) pairs_.push_back({a, b, CellMatrix::Zero()});
  return pairs_[entry->second].matrix;
}

void Couplings::add(std::int32_t a, std::int32_t b, const NodeWeights& of_a, const NodeWeights& of_b,
                    const Mat3& hessian) {
  const Mat3 lost = -hessian;
  add_point_product(of_a.data(), of_b.data(), lost.data(), matrix_of(a, b).data());
}

void Couplings::add(const Couplings& others) {
  for (const Pair& pair : others.pairs_) matrix_of(pair.a, pair.b) += pair.matrix;
}

template <class Vector>
void Couplings::add_product(const Mesh& mesh, const Vector& x, Vector& y) const {
  using Real = typename Vector::Scalar;
  for (const Pair& pair : pairs_) {
    const auto a = static_cast<std::size_t>(pair.a), b = static_cast<std::size_t>(pair.b);
    const CellVector of_a = mesh.gather(a, x).template cast<double>(), of_b = mesh.gather(b, x).template cast<double>();
    CellVector to_a, to_b;
    multiply24_both(pair.matrix.data(), of_a.data(), of_b.data(), to_a.data(), to_b.data());
    mesh.scatter_add(a, to_a.template cast<Real>().eval(), y);
    mesh.scatter_add(b, to_b.template cast<Real>().eval(), y);
  }
}
template void Couplings::add_product(const Mesh&, const NodeVector&, NodeVector&) const;
template void Couplings::add_product(const Mesh&, const FloatNodeVector&, FloatNodeVector&) const;

Couplings Couplings::of_parents(const hexmesh::Merge& merge, std::size_t num_cells) const {
  Couplings out;
  if (empty()) return out;
  std::vector<std::pair<std::int32_t, int>> place(num_cells);  // parent, slot
  for (std::size_t p = 0; p < merge.children.size(); ++p)
    for (int slot = 0; slot < 8; ++slot)
      if (const std::int32_t child = merge.children[p][static_cast<std::size_t>(slot)]; child >= 0)
        place[static_cast<std::size_t>(child)] = {static_cast<std::int32_t>(p), slot};
  for (Pair pair : pairs_) {
    const auto [a, slot_a] = place[static_cast<std::size_t>(pair.a)];
    const auto [b, slot_b] = place[static_cast<std::size_t>(pair.b)];
    interpolate_from_parents({slot_a, merge.factor_of(static_cast<std::size_t>(a))},
                             {slot_b, merge.factor_of(static_cast<std::size_t>(b))}, pair.matrix.data());
    out.matrix_of(a, b) += pair.matrix;
  }
  return out;
}

}  // namespace hexsolver
