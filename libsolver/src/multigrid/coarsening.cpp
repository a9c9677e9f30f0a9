// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Cholesky>
#include <algorithm>
#include <atomic>
#include <map>

#include "constraints/support_springs.h"
#include "core/parallel.h"
#include "kernels/cell_hessian.h"
#include "multigrid/cycles.h"

namespace hexsolver {
namespace {

/// L^T v, L the trilinear interpolation from the nodes of a parent to those of its child in a slot. Axis by axis, as
/// interpolate_from_parent().
CellVector passed_to_parent(int slot, const Index3& factor, CellVector v) {
  for (int axis = 0; axis < 3; ++axis) {
    if (factor[axis] == 1) continue;
    for (int a = 0; a < 8; ++a) {
      if (hexmesh::corner_bit(a, axis) == hexmesh::corner_bit(slot, axis)) continue;
      auto half = v.segment<3>(3 * a);
      half *= 0.5;
      v.segment<3>(3 * (a ^ 1 << axis)) += half;
    }
  }
  return v;
}

bool has_children(const hexmesh::Merge& merge, std::size_t parent) {
  return std::any_of(merge.children[parent].begin(), merge.children[parent].end(),
                     [](std::int32_t c) { return c >= 0; });
}

}  // namespace

template <class Scalar>
void Multigrid::CyclesOf<Scalar>::coarsen(std::size_t level) {
  const std::vector<std::size_t> first_of = share_matrices(level);
  Level& to = levels_[level + 1];
  const auto of_parents = [&](const Couplings& couplings) {
    return couplings.of_parents(hierarchy_.merges[level], hierarchy_.meshes[level].num_cells());
  };
  to.couplings = level == 0 ? of_parents(potential_.couplings()) : of_parents(levels_[level].couplings);
  if (to.braess_sarazin) set_dilatations(level);
  const bool is_to_be_gathered = is_gathered(level + 1);
  std::vector<CellMatrix> shared_matrices(first_of.size());
  diagonal_.assign(hierarchy_.meshes[level].num_all_nodes(), Mat3::Zero());
  hierarchy_.meshes[level + 1].for_each_cell([&](std::size_t parent) {
    if (is_to_be_gathered && !has_children(hierarchy_.merges[level], parent)) {
      to.matrices.set(parent, CellMatrix::Zero());
      return;
    }
    const std::int32_t number = to.matrices.shared(parent);
    const bool is_own = number == Term::own_hessian;
    const bool computes = is_own || first_of[number] == parent;
    const CellMatrix sum = sum_of_children(level, parent, computes);
    if (is_own)
      to.matrices.set(parent, sum);
    else if (computes)
      shared_matrices[number] = sum;
  });
  to.matrices.set_shared([&](std::int32_t number) { return shared_matrices[number]; });
  if (is_to_be_gathered) gather_matrices(level + 1);
  if (is_solved_at_once_) return;  // nothing is smoothed
  hierarchy_.meshes[level].collect_blocks(diagonal_);
  if (part(level)) part(level)->add_up(diagonal_);
  positive_ = invert_diagonal(levels_[level], diagonal_);
  if (part(level)) positive_ = part(level)->largest(positive_ ? 0 : 1) == 0;
}

template void Multigrid::CyclesOf<float>::coarsen(std::size_t);
template void Multigrid::CyclesOf<double>::coarsen(std::size_t);

/// Find which cells of the coarser level share their matrix.
/// @returns number of a shared matrix -> the first parent that has it
template <class Scalar>
std::vector<std::size_t> Multigrid::CyclesOf<Scalar>::share_matrices(std::size_t level) {
  const Mesh& coarse = hierarchy_.meshes[level + 1];
  CellMatrices<Scalar>& matrices = levels_[level + 1].matrices;
  // Where no two finest cells share, nothing above does; nor what processes have gathered.
  bool may_share = false;
  const bool is_own = !part(0) || part(level + 1);
  for (std::size_t c = 0; c < hierarchy_.meshes[0].num_cells() && is_own && !may_share; ++c)
    may_share = potential_.shared_hessian(c) >= 0;
  std::vector<std::size_t> first_of;
  if (may_share) {
    matrices = {};
    matrices = CellMatrices<Scalar>(coarse, shared_by_parents(level, first_of));
  } else if (matrices.is_empty() || matrices.shares()) {
    matrices = CellMatrices<Scalar>(coarse);
  }
  return first_of;
}

/// Of the matrix that a cell shares; Term::own_hessian where it has its own.
template <class Scalar>
std::int32_t Multigrid::CyclesOf<Scalar>::shared_number(std::size_t level, std::size_t cell) const {
  if (level > 0) return levels_[level].matrices.shared(cell);
  return points_of_cell_.contains(cell) ? Term::own_hessian : potential_.shared_hessian(cell);
}

/// For each parent: parents with the same shared children share their matrix.
/// @param first_of  number of a shared matrix -> the first parent that has it
template <class Scalar>
std::vector<std::int32_t> Multigrid::CyclesOf<Scalar>::shared_by_parents(std::size_t level,
                                                                         std::vector<std::size_t>& first_of) const {
  const auto number_of = [&](std::int32_t cell) { return cell < 0 ? Term::no_hessian : shared_number(level, cell); };
  const hexmesh::Merge& merge = hierarchy_.merges[level];
  std::vector<std::int32_t> shared(merge.parents.size(), Term::own_hessian);
  std::map<hexmesh::Children, std::int32_t> known;
  for (std::size_t parent = 0; parent < shared.size(); ++parent) {
    hexmesh::Children pattern;
    std::transform(merge.children[parent].begin(), merge.children[parent].end(), pattern.begin(), number_of);
    if (std::find(pattern.begin(), pattern.end(), Term::own_hessian) != pattern.end()) continue;
    const auto [entry, is_new] = known.try_emplace(pattern, static_cast<std::int32_t>(known.size()));
    shared[parent] = entry->second;
    if (is_new) first_of.push_back(parent);
  }
  return shared;
}

/// Coarse cells resist change of their own volume, not of each of their children's, which would lock them.
template <class Scalar>
void Multigrid::CyclesOf<Scalar>::set_dilatations(std::size_t level) {
  if (level == 0)
    levels_[0].braess_sarazin->set([this](std::size_t c) { return potential_.dilatation(c); },
                                   [this](std::size_t c) { return shared_number(0, c); });
  if (is_gathered(level + 1)) {
    const std::vector<Dilatation> all = gather_dilatations(level);
    levels_[level + 1].braess_sarazin->set([&](std::size_t parent) { return all[parent]; },
                                           [](std::size_t) { return Term::own_hessian; });
    return;
  }
  levels_[level + 1].braess_sarazin->set(
      [this, level](std::size_t parent) { return sum_of_dilatations(level, parent); },
      [this, level](std::size_t parent) { return levels_[level + 1].matrices.shared(parent); });
}

/// Of all cells of the next level; each has all its children on one process.
template <class Scalar>
std::vector<Dilatation> Multigrid::CyclesOf<Scalar>::gather_dilatations(std::size_t level) const {
  constexpr Eigen::Index size = 24 + 2;
  std::vector<Dilatation> out(hierarchy_.merges[level].parents.size());
  Eigen::MatrixXd values = Eigen::MatrixXd::Zero(size, static_cast<Eigen::Index>(out.size()));
  for (std::size_t parent = 0; parent < out.size(); ++parent) {
    if (!has_children(hierarchy_.merges[level], parent)) continue;
    const Dilatation d = sum_of_dilatations(level, parent);
    values.col(static_cast<Eigen::Index>(parent)) << d.divergence, d.bulk, d.volume;
  }
  part(level)->sum(std::span<double>(values.data(), static_cast<std::size_t>(values.size())));
  for (std::size_t parent = 0; parent < out.size(); ++parent) {
    const auto of_parent = values.col(static_cast<Eigen::Index>(parent));
    out[parent].divergence = of_parent.head<24>();
    out[parent].bulk = of_parent[24];
    out[parent].volume = of_parent[25];
  }
  return out;
}

/// Of a level that processes have only their own of.
template <class Scalar>
void Multigrid::CyclesOf<Scalar>::gather_matrices(std::size_t level) {
  constexpr std::size_t at_once = 1024, size = 24 * 24;
  CellMatrices<Scalar>& matrices = levels_[level].matrices;
  const std::size_t count = hierarchy_.meshes[level].num_cells();
  std::vector<double> values;
  for (std::size_t first = 0; first < count; first += at_once) {
    const std::size_t end = std::min(count, first + at_once);
    values.resize(size * (end - first));
    for (std::size_t c = first; c < end; ++c) CellMatrix::Map(&values[size * (c - first)]) = matrices.get(c);
    part(level - 1)->sum(std::span<double>(values));
    for (std::size_t c = first; c < end; ++c) matrices.set(c, CellMatrix::Map(&values[size * (c - first)]));
  }
}

template <class Scalar>
Dilatation Multigrid::CyclesOf<Scalar>::sum_of_dilatations(std::size_t level, std::size_t parent) const {
  const hexmesh::Merge& merge = hierarchy_.merges[level];
  Dilatation sum{CellVector::Zero()};
  double bulk = 0;
  for (int slot = 0; slot < 8; ++slot) {
    const std::int32_t child = merge.children[parent][slot];
    if (child < 0) continue;
    const Dilatation d = levels_[level].braess_sarazin->get(child);
    sum.divergence += passed_to_parent(slot, merge.factor_of(parent), d.divergence);
    sum.volume += d.volume;
    bulk += d.volume * d.bulk;
  }
  sum.bulk = bulk / sum.volume;
  return sum;
}

/// The matrix of a parent, of those of its children; their diagonal blocks are added to diagonal_.
/// @param computes  false: the diagonal only
template <class Scalar>
CellMatrix Multigrid::CyclesOf<Scalar>::sum_of_children(std::size_t level, std::size_t parent, bool computes) {
  const Mesh& fine = hierarchy_.meshes[level];
  const hexmesh::Merge& merge = hierarchy_.merges[level];
  const bool has_pressures = levels_[level].braess_sarazin != nullptr;
  CellMatrix sum = CellMatrix::Zero();
  for (int slot = 0; slot < 8; ++slot) {
    const std::int32_t child = merge.children[parent][slot];
    if (child < 0) continue;
    CellMatrix k = cell_matrix(level, child);
    const Dilatation dilatation = has_pressures ? levels_[level].braess_sarazin->get(child) : Dilatation{};
    for (int a = 0; a < 8; ++a) diagonal_[fine.node(child, a)] += k.block<3, 3>(3 * a, 3 * a) - dilatation.block(a);
    if (!computes) continue;
    if (dilatation.bulk > 0) k -= dilatation.hessian();
    interpolate_from_parent({slot, merge.factor_of(parent)}, k.data());
    sum += k;
  }
  if (has_pressures) sum += levels_[level + 1].braess_sarazin->get(parent).hessian();
  return sum;
}

template <class Scalar>
CellMatrix Multigrid::CyclesOf<Scalar>::cell_matrix(std::size_t level, std::size_t cell) const {
  if (level > 0) return levels_[level].matrices.get(cell);
  CellMatrix k = potential_.cell_hessian(cell);
  const auto found = points_of_cell_.find(cell);
  if (found == points_of_cell_.end()) return k;
  for (const std::size_t m : found->second) {
    const ConstraintPoint& p = constraints_.held()[m];
    add_spring(p, support_weight_[p.condition], k);
  }
  return k;
}

/// @returns whether all blocks are positive definite
template <class Scalar>
bool Multigrid::CyclesOf<Scalar>::invert_diagonal(Level& level, const std::vector<Mat3>& diagonal) {
  level.inverse_diagonal.resize(diagonal.size());
  std::atomic<bool> positive = true;
  for_each_node(diagonal.size(), [&](std::ptrdiff_t n) {
    const Eigen::LLT<Mat3> factor(diagonal[n]);
    if (factor.info() != Eigen::Success) positive = false;
    level.inverse_diagonal[n] = factor.solve(Mat3::Identity()).template cast<Scalar>();
  });
  return positive;
}

template <class Scalar>
void Multigrid::CyclesOf<Scalar>::factor_coarsest() {
  const std::size_t level = levels_.size() - 1;
  const bool is_only = level == 0;
  positive_ = coarsest_.compute(
      hierarchy_.meshes[level],
      [&](std::size_t c) { return is_only ? potential_.cell_hessian(c) : cell_matrix(level, c); },
      is_only ? potential_.couplings() : levels_[level].couplings, is_solved_at_once_ ? &constraints_ : nullptr);
}

template void Multigrid::CyclesOf<float>::factor_coarsest();
template void Multigrid::CyclesOf<double>::factor_coarsest();

}  // namespace hexsolver
