// SPDX-License-Identifier: Apache-2.0
#include "hexsolver/multigrid.h"

#include <Eigen/Cholesky>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <map>
#include <type_traits>
#include <unordered_map>

#include "cell_matrices.h"
#include "hexmesh/core/bytes.h"
#include "lanczos.h"
#include "parallel.h"
#include "pressure_smoother.h"
#include "support_springs.h"

namespace hexsolver {
namespace {

using Eigen::Index;
using hexmesh::bytes_of;

constexpr int chebyshev_degree = 6;
/// The smoother damps eigenvalues of D^-1 A in [largest / smoothing_range, largest].
constexpr double smoothing_range = 80;

/// L^T v, L the trilinear interpolation from the nodes of a parent to those of its child in a slot. Axis by axis, as
/// interpolate_from_parent().
CellVector passed_to_parent(int slot, const Index3& factor, CellVector v) {
  for (int axis = 0; axis < 3; ++axis) {
    if (factor[static_cast<std::size_t>(axis)] == 1) continue;
    for (int a = 0; a < 8; ++a) {
      if (hexmesh::corner_bit(a, axis) == hexmesh::corner_bit(slot, axis)) continue;
      auto half = v.segment<3>(3 * a);
      half *= 0.5;
      v.segment<3>(3 * (a ^ 1 << axis)) += half;
    }
  }
  return v;
}

}  // namespace

Hierarchy::Hierarchy(Mesh finest, const Vec3& corner, std::size_t coarsest_dofs) {
  meshes.push_back(std::move(finest));
  while (meshes.back().num_dofs() > coarsest_dofs) {
    const Mesh& fine = meshes.back();
    const Vec3 size = fine.edges().colwise().norm();
    hexmesh::Merge merge = hexmesh::merge_linked_cells(fine.cells(), fine.cell_nodes(), hexmesh::merge_factor(size));
    const Vec3 factor(merge.factor[0], merge.factor[1], merge.factor[2]);
    Mesh coarse(merge.parents, hexmesh::number_parent_nodes(merge, fine.cell_nodes(), fine.num_nodes()),
                fine.edges() * factor.asDiagonal(), corner);
    if (coarse.num_nodes() >= fine.num_nodes()) break;
    prolongations.emplace_back(fine, coarse, merge);
    merges.push_back(std::move(merge));
    meshes.push_back(std::move(coarse));
  }
}

std::size_t Hierarchy::bytes() const {
  std::size_t sum = 0;
  for (const Mesh& m : meshes) sum += m.bytes();
  for (const hexmesh::Merge& m : merges) sum += bytes_of(m.parents) + bytes_of(m.children);
  for (const Prolongation& p : prolongations) sum += p.bytes();
  return sum;
}

/// What a Multigrid works with.
class Multigrid::Cycles {
public:
  virtual ~Cycles() = default;
  virtual void update() = 0;
  virtual bool is_positive() const noexcept = 0;
  virtual void apply(const NodeVector& r, NodeVector& z) const = 0;
  virtual std::size_t bytes() const = 0;
};

template <class Scalar>
class Multigrid::CyclesOf final : public Multigrid::Cycles {
public:
  CyclesOf(const Hierarchy& hierarchy, const Potential& potential, const Constraints& constraints);
  void update() override;
  bool is_positive() const noexcept override { return positive_; }
  void apply(const NodeVector& r, NodeVector& z) const override;
  std::size_t bytes() const override;

private:
  using Vector = Eigen::Matrix<Scalar, Eigen::Dynamic, 1>;
  using Block = Eigen::Matrix<Scalar, 3, 3>;
  using Point = Eigen::Matrix<Scalar, 3, 1>;
  struct Level {
    CellMatrices<Scalar> matrices;        ///< none on the finest level, whose operator is the potential's
    std::vector<Block> inverse_diagonal;  ///< per node
    double largest_eigenvalue = 0;        ///< of D^-1 A
    std::unique_ptr<PressureSmoother<Scalar>> pressures;  ///< in place of D^-1, where cells are nearly incompressible
    mutable Vector b, x, r, d, t;                         ///< work space of a cycle
  };

  bool knows_pressures() const;
  void choose_support_weights();
  std::int32_t shared_number(std::size_t level, std::size_t cell) const;
  std::vector<std::int32_t> shared_by_parents(std::size_t level, std::vector<std::size_t>& first_of) const;
  void pass_on_dilatations(std::size_t level);
  void coarsen(std::size_t level);
  bool invert_diagonal(Level& level, const std::vector<Mat3>& diagonal);
  void estimate_eigenvalue(std::size_t level);
  void weigh_pressures(std::size_t level);
  void factor_coarsest();
  void solve_coarsest(const Vector& b, Vector& x) const;
  CellMatrix cell_matrix(std::size_t level, std::size_t cell) const;
  void multiply(std::size_t level, const Vector& x, Vector& y) const;
  void scale_by_diagonal(std::size_t level, const Vector& r, Vector& d) const;
  void smooth(std::size_t level, const Vector& b, Vector& x, bool from_zero) const;
  void cycle(std::size_t level, const Vector& b, Vector& x) const;

  const Hierarchy& hierarchy_;
  const Potential& potential_;
  const Constraints& constraints_;
  std::unordered_map<std::size_t, std::vector<std::size_t>> points_of_cell_;  ///< constraint points, finest level
  std::vector<double> support_weight_;                                        ///< w of each condition [N/mm]
  std::vector<Level> levels_;
  Eigen::SimplicialLLT<Eigen::SparseMatrix<double>> coarsest_;
  Eigen::MatrixXd dense_matrix_;
  Eigen::LLT<Eigen::MatrixXd> dense_;  ///< in place of coarsest_ where that is small
  mutable NodeVector dense_x_;
  std::vector<Mat3> diagonal_;  ///< space for coarsen()
  bool positive_ = true;
};

Multigrid::Multigrid(const Hierarchy& hierarchy, const Potential& potential, const Constraints& constraints) {
  if (hierarchy.in_double)
    cycles_ = std::make_unique<CyclesOf<double>>(hierarchy, potential, constraints);
  else
    cycles_ = std::make_unique<CyclesOf<float>>(hierarchy, potential, constraints);
}

Multigrid::~Multigrid() = default;
void Multigrid::update() { cycles_->update(); }
bool Multigrid::is_positive() const noexcept { return cycles_->is_positive(); }
void Multigrid::apply(const NodeVector& r, NodeVector& z) const { cycles_->apply(r, z); }
std::size_t Multigrid::bytes() const { return cycles_->bytes(); }

template <class Scalar>
Multigrid::CyclesOf<Scalar>::CyclesOf(const Hierarchy& hierarchy, const Potential& potential,
                                      const Constraints& constraints)
    : hierarchy_(hierarchy), potential_(potential), constraints_(constraints), levels_(hierarchy.meshes.size()) {
  if (levels_.size() > 1 && knows_pressures())
    for (std::size_t level = 0; level < levels_.size(); ++level)
      levels_[level].pressures =
          std::make_unique<PressureSmoother<Scalar>>(hierarchy.meshes[level], level == 0 ? &constraints : nullptr);
  for (std::size_t p = 0; p < constraints.held().size(); ++p)
    points_of_cell_[static_cast<std::size_t>(constraints.held()[p].cell)].push_back(p);
  choose_support_weights();
  update();
}

template <class Scalar>
void Multigrid::CyclesOf<Scalar>::update() {
  positive_ = true;
  for (std::size_t level = 0; level + 1 < levels_.size() && positive_; ++level) {
    coarsen(level);
    if (!positive_) return;
    estimate_eigenvalue(level);
    if (levels_[level].pressures) weigh_pressures(level);
  }
  if (positive_) factor_coarsest();
}

template <class Scalar>
bool Multigrid::CyclesOf<Scalar>::knows_pressures() const {
  double largest = 0;
  for (std::size_t c = 0; c < hierarchy_.meshes[0].num_cells(); ++c)
    if (const Dilatation d = potential_.dilatation(c); d.bulk > 0) largest = std::max(largest, d.bulk / d.shear);
  return Multigrid::knows_pressures(largest);
}

template <class Scalar>
void Multigrid::CyclesOf<Scalar>::choose_support_weights() {
  std::vector<SupportSprings> springs;
  for (const auto& [cell, members] : points_of_cell_) {
    // As stiff as change of shape: supports stiffer than that would set the pace of smoothers that know pressures.
    CellMatrix k = potential_.cell_hessian(cell);
    if (levels_[0].pressures) k -= potential_.dilatation(cell).hessian();
    const double trace = k.trace();
    for (const std::size_t m : members) {
      const ConstraintPoint& p = constraints_.held()[m];
      const auto condition = static_cast<std::size_t>(p.condition);
      springs.resize(std::max(springs.size(), condition + 1));
      springs[condition].add(p, hierarchy_.meshes[0].cell_nodes()[cell], trace);
    }
  }
  for (const SupportSprings& s : springs) support_weight_.push_back(s.weight());
}

template <class Scalar>
CellMatrix Multigrid::CyclesOf<Scalar>::cell_matrix(std::size_t level, std::size_t cell) const {
  if (level > 0) return levels_[level].matrices.get(cell);
  CellMatrix k = potential_.cell_hessian(cell);
  const auto found = points_of_cell_.find(cell);
  if (found == points_of_cell_.end()) return k;
  for (const std::size_t m : found->second) {
    const ConstraintPoint& p = constraints_.held()[m];
    add_spring(p, support_weight_[static_cast<std::size_t>(p.condition)], k);
  }
  return k;
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
  const auto number_of = [&](std::int32_t cell) {
    return cell < 0 ? Term::no_hessian : shared_number(level, static_cast<std::size_t>(cell));
  };
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
void Multigrid::CyclesOf<Scalar>::pass_on_dilatations(std::size_t level) {
  const hexmesh::Merge& merge = hierarchy_.merges[level];
  const PressureSmoother<Scalar>& from = *levels_[level].pressures;
  const CellMatrices<Scalar>& matrices = levels_[level + 1].matrices;
  levels_[level + 1].pressures->set(
      [&](std::size_t parent) {
        Dilatation sum{CellVector::Zero()};
        double bulk = 0;
        for (int slot = 0; slot < 8; ++slot) {
          const std::int32_t child = merge.children[parent][static_cast<std::size_t>(slot)];
          if (child < 0) continue;
          const Dilatation d = from.get(static_cast<std::size_t>(child));
          sum.divergence += passed_to_parent(slot, merge.factor, d.divergence);
          sum.volume += d.volume;
          bulk += d.volume * d.bulk;
        }
        sum.bulk = bulk / sum.volume;
        return sum;
      },
      [&](std::size_t parent) { return matrices.shared(parent); });
}

template <class Scalar>
void Multigrid::CyclesOf<Scalar>::coarsen(std::size_t level) {
  const Mesh& fine = hierarchy_.meshes[level];
  const Mesh& coarse = hierarchy_.meshes[level + 1];
  const hexmesh::Merge& merge = hierarchy_.merges[level];
  Level& to = levels_[level + 1];

  // Where no two finest cells share, nothing above does.
  bool may_share = false;
  for (std::size_t c = 0; c < hierarchy_.meshes[0].num_cells() && !may_share; ++c)
    may_share = potential_.shared_hessian(c) >= 0;
  std::vector<std::size_t> first_of;  // number of a shared matrix -> a parent that has it
  if (may_share) {
    to.matrices = {};
    to.matrices = CellMatrices<Scalar>(coarse, shared_by_parents(level, first_of));
  } else if (to.matrices.is_empty() || to.matrices.shares()) {
    to.matrices = CellMatrices<Scalar>(coarse);
  }

  if (levels_[level].pressures) {
    if (level == 0)
      levels_[0].pressures->set([&](std::size_t c) { return potential_.dilatation(c); },
                                [&](std::size_t c) { return shared_number(0, c); });
    pass_on_dilatations(level);
  }

  std::vector<CellMatrix> shared_matrices(first_of.size());
  std::vector<Mat3>& diagonal = diagonal_;
  diagonal.assign(fine.num_nodes(), Mat3::Zero());
  coarse.for_each_cell([&](std::size_t parent) {
    const std::int32_t number = to.matrices.shared(parent);
    const bool is_own = number == Term::own_hessian;
    const bool computes = is_own || first_of[static_cast<std::size_t>(number)] == parent;
    CellMatrix sum = CellMatrix::Zero();
    for (int slot = 0; slot < 8; ++slot) {
      const std::int32_t child = merge.children[parent][static_cast<std::size_t>(slot)];
      if (child < 0) continue;
      CellMatrix k = cell_matrix(level, static_cast<std::size_t>(child));
      const Dilatation dilatation =
          to.pressures ? levels_[level].pressures->get(static_cast<std::size_t>(child)) : Dilatation{};
      for (int a = 0; a < 8; ++a)
        diagonal[static_cast<std::size_t>(
            fine.cell_nodes()[static_cast<std::size_t>(child)][static_cast<std::size_t>(a)])] +=
            k.block<3, 3>(3 * a, 3 * a) - dilatation.block(a);
      if (!computes) continue;
      if (dilatation.bulk > 0) k -= dilatation.hessian();
      interpolate_from_parent(slot, merge.factor, k.data());
      sum += k;
    }
    if (to.pressures) sum += to.pressures->get(parent).hessian();
    if (is_own)
      to.matrices.set(parent, sum);
    else if (computes)
      shared_matrices[static_cast<std::size_t>(number)] = sum;
  });
  to.matrices.set_shared([&](std::int32_t number) { return shared_matrices[static_cast<std::size_t>(number)]; });
  positive_ = invert_diagonal(levels_[level], diagonal);
}

template <class Scalar>
bool Multigrid::CyclesOf<Scalar>::invert_diagonal(Level& level, const std::vector<Mat3>& diagonal) {
  level.inverse_diagonal.resize(diagonal.size());
  std::atomic<bool> positive = true;
  for_each_node(static_cast<std::ptrdiff_t>(diagonal.size()), [&](std::ptrdiff_t node) {
    const auto n = static_cast<std::size_t>(node);
    const Eigen::LLT<Mat3> factor(diagonal[n]);
    if (factor.info() != Eigen::Success) positive = false;
    level.inverse_diagonal[n] = factor.solve(Mat3::Identity()).template cast<Scalar>();
  });
  return positive;
}

template <class Scalar>
void Multigrid::CyclesOf<Scalar>::factor_coarsest() {
  // A level of its own is solved at once: K + w (1 - P), which in the range of P is as good as P K P for large w.
  constexpr double held_over_nodal = 1e6;
  const std::size_t level = levels_.size() - 1;
  const Mesh& mesh = hierarchy_.meshes[level];
  const bool is_only = level == 0;
  double largest = 0;
  const auto matrix_of = [&](std::size_t c) {
    CellMatrix k = is_only ? potential_.cell_hessian(c) : cell_matrix(level, c);
    largest = std::max(largest, k.diagonal().maxCoeff());
    return k;
  };
  if (mesh.num_dofs() <= most_dense) {
    const auto size = static_cast<Index>(mesh.num_dofs());
    dense_matrix_.setZero(size, size);
    for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
      const CellMatrix k = matrix_of(c);
      for (std::size_t a = 0; a < 8; ++a)
        for (std::size_t b = 0; b < 8; ++b)
          dense_matrix_.block<3, 3>(3 * Index{mesh.cell_nodes()[c][a]}, 3 * Index{mesh.cell_nodes()[c][b]}) +=
              k.block<3, 3>(3 * static_cast<Index>(a), 3 * static_cast<Index>(b));
    }
    if (is_only)
      constraints_.for_each_held_entry([&](Index row, Index column, double value) {
        dense_matrix_(row, column) += held_over_nodal * largest * value;
      });
    dense_.compute(dense_matrix_);
    positive_ = dense_.info() == Eigen::Success;
    return;
  }
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(576 * mesh.num_cells());
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
    const CellMatrix k = matrix_of(c);
    for (int column = 0; column < 24; ++column)
      for (int row = 0; row < 24; ++row)
        entries.emplace_back(3 * Index{mesh.cell_nodes()[c][static_cast<std::size_t>(row / 3)]} + row % 3,
                             3 * Index{mesh.cell_nodes()[c][static_cast<std::size_t>(column / 3)]} + column % 3,
                             k(row, column));
  }
  if (is_only)
    constraints_.for_each_held_entry([&](Index row, Index column, double value) {
      entries.emplace_back(row, column, held_over_nodal * largest * value);
    });
  const auto size = static_cast<Index>(mesh.num_dofs());
  Eigen::SparseMatrix<double> a(size, size);
  a.setFromTriplets(entries.begin(), entries.end());
  coarsest_.compute(a);
  positive_ = coarsest_.info() == Eigen::Success;
}

template <class Scalar>
void Multigrid::CyclesOf<Scalar>::solve_coarsest(const Vector& b, Vector& x) const {
  if (dense_matrix_.size() == 0) {
    x = coarsest_.solve(b.template cast<double>()).template cast<Scalar>();
    return;
  }
  dense_x_ = b.template cast<double>();
  dense_.solveInPlace(dense_x_);
  x = dense_x_.template cast<Scalar>();
}

template <class Scalar>
void Multigrid::CyclesOf<Scalar>::multiply(std::size_t level, const Vector& x, Vector& y) const {
  if (level > 0) {
    set_zero(y, x.size());
    levels_[level].matrices.add_product(x, y);
  } else {
    potential_.apply(x, y);
  }
  if (level == 0) constraints_.project(y);
}

template <class Scalar>
void Multigrid::CyclesOf<Scalar>::scale_by_diagonal(std::size_t level, const Vector& r, Vector& d) const {
  d.resize(r.size());
  const auto& inverse = levels_[level].inverse_diagonal;
  const auto count = static_cast<std::ptrdiff_t>(inverse.size());
  for_each_node(count, [&](std::ptrdiff_t n) {
    d.template segment<3>(3 * n) = inverse[static_cast<std::size_t>(n)] * r.template segment<3>(3 * n);
  });
  if (level == 0) constraints_.project(d);
}

/// Of D^-1 A, A without what resists change of volume where smoothers know pressures.
template <class Scalar>
void Multigrid::CyclesOf<Scalar>::estimate_eigenvalue(std::size_t level) {
  Level& l = levels_[level];
  Vector& start = l.b;  // free before a cycle
  fill_roughly(start, static_cast<Index>(hierarchy_.meshes[level].num_dofs()));
  // As large in stiff material as in soft, as D^-1 A sees it: what starts at nothing is not found in a few steps.
  const auto count = static_cast<std::ptrdiff_t>(l.inverse_diagonal.size());
  for_each_node(count, [&](std::ptrdiff_t n) {
    start.template segment<3>(3 * n) /= std::sqrt(l.inverse_diagonal[static_cast<std::size_t>(n)].trace());
  });
  if (level == 0) constraints_.project(start);
  const auto multiply_shape = [&](const Vector& x, Vector& y) {
    multiply(level, x, y);
    if (!l.pressures) return;
    l.pressures->subtract_product(x, y);
    if (level == 0) constraints_.project(y);
  };
  l.largest_eigenvalue =
      hexsolver::largest_eigenvalue(LanczosSpace<Vector>{start, l.x, l.r, l.t}, multiply_shape,
                                    [&](const Vector& r, Vector& z) { scale_by_diagonal(level, r, z); });
}

/// D is so large that changes of shape come out at most 1 / of_shape times too large.
template <class Scalar>
void Multigrid::CyclesOf<Scalar>::weigh_pressures(std::size_t level) {
  constexpr double of_shape = 0.6;
  Level& l = levels_[level];
  const auto less = static_cast<Scalar>(1 / (of_shape * l.largest_eigenvalue));
  for_each_node(static_cast<std::ptrdiff_t>(l.inverse_diagonal.size()),
                [&](std::ptrdiff_t n) { l.inverse_diagonal[static_cast<std::size_t>(n)] *= less; });
  l.pressures->prepare(l.inverse_diagonal);
}

template <class Scalar>
void Multigrid::CyclesOf<Scalar>::smooth(std::size_t level, const Vector& b, Vector& x, bool from_zero) const {
  if (levels_[level].pressures) {
    levels_[level].pressures->smooth([this, level](const Vector& u, Vector& f) { multiply(level, u, f); }, b, x,
                                     from_zero, {levels_[level].r, levels_[level].d, levels_[level].t});
    return;
  }
  // Chebyshev iteration for D^-1 A x = D^-1 b on [smallest, largest], each step one pass over the vectors.
  // Source: Saad, Iterative Methods for Sparse Linear Systems, 2nd ed. (2003), algorithm 12.1.
  const Level& l = levels_[level];
  const double largest = l.largest_eigenvalue, smallest = largest / smoothing_range;
  const double theta = (largest + smallest) / 2, delta = (largest - smallest) / 2, sigma = theta / delta;
  const auto inverse = [&](Index n) -> const Block& { return l.inverse_diagonal[static_cast<std::size_t>(n)]; };
  const Index count = static_cast<Index>(l.inverse_diagonal.size());
  l.r.resize(b.size());
  l.d.resize(b.size());
  if (from_zero)
    set_zero(x, b.size());
  else
    multiply(level, x, l.t);
  for_each_node(count, [&](std::ptrdiff_t n) {
    Point r = b.template segment<3>(3 * n);
    if (!from_zero) r -= l.t.template segment<3>(3 * n);
    l.r.template segment<3>(3 * n) = r;
    l.d.template segment<3>(3 * n) = inverse(n) * r * static_cast<Scalar>(1 / theta);
  });
  double rho = 1 / sigma;
  for (int k = 1; k < chebyshev_degree; ++k) {
    if (level == 0) constraints_.project(l.d);
    multiply(level, l.d, l.t);
    const double next = 1 / (2 * sigma - rho);
    const auto keep = static_cast<Scalar>(next * rho), add = static_cast<Scalar>(2 * next / delta);
    for_each_node(count, [&](std::ptrdiff_t n) {
      const Point d = l.d.template segment<3>(3 * n),
                  r = l.r.template segment<3>(3 * n) - l.t.template segment<3>(3 * n);
      x.template segment<3>(3 * n) += d;
      l.r.template segment<3>(3 * n) = r;
      l.d.template segment<3>(3 * n) = keep * d + add * (inverse(n) * r);
    });
    rho = next;
  }
  if (level == 0) constraints_.project(l.d);
  parallel_for(x.size(), [&](Index n) { x[n] += l.d[n]; });
}

template <class Scalar>
void Multigrid::CyclesOf<Scalar>::cycle(std::size_t level, const Vector& b, Vector& x) const {
  if (level + 1 == levels_.size()) {
    solve_coarsest(b, x);
    return;
  }
  const Level& l = levels_[level];
  const Level& coarse = levels_[level + 1];
  smooth(level, b, x, true);
  multiply(level, x, l.t);
  l.r.resize(b.size());
  parallel_for(b.size(), [&](Index n) { l.r[n] = b[n] - l.t[n]; });
  hierarchy_.prolongations[level].restrict_to(l.r, coarse.b);
  cycle(level + 1, coarse.b, coarse.x);
  hierarchy_.prolongations[level].prolongate(coarse.x, l.t);
  if (level == 0) constraints_.project(l.t);
  parallel_for(x.size(), [&](Index n) { x[n] += l.t[n]; });
  smooth(level, b, x, false);
}

template <class Scalar>
std::size_t Multigrid::CyclesOf<Scalar>::bytes() const {
  std::size_t sum = 0;
  for (const Level& l : levels_)
    sum += l.matrices.bytes() + bytes_of(l.inverse_diagonal) + (l.pressures ? l.pressures->bytes() : 0) +
           sizeof(Scalar) * static_cast<std::size_t>(l.b.size() + l.x.size() + l.r.size() + l.d.size() + l.t.size());
  return sum;
}

template <class Scalar>
void Multigrid::CyclesOf<Scalar>::apply(const NodeVector& r, NodeVector& z) const {
  // In units of |r|: single precision has room for digits, not for scales.
  const double scale = r.lpNorm<Eigen::Infinity>();
  if (!(scale > 0)) {
    z.setZero(r.size());
    return;
  }
  const Level& finest = levels_[0];
  finest.b.resize(r.size());
  parallel_for(r.size(), [&](Index n) { finest.b[n] = static_cast<Scalar>(r[n] / scale); });
  cycle(0, finest.b, finest.x);
  z.resize(r.size());
  parallel_for(r.size(), [&](Index n) { z[n] = scale * static_cast<double>(finest.x[n]); });
  constraints_.project(z);
}

}  // namespace hexsolver
