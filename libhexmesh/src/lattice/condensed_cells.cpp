// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/lattice/condensed_cells.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <string_view>
#include <unordered_map>

#include "hexmesh/lattice/locator.h"
#include "hexmesh/lattice/merge.h"

namespace hexmesh {
namespace {

using Eigen::Index;

constexpr std::uint8_t none = 255;

/// How the children of a parent hang together: what decides, with their kinds, how it condenses.
struct Pattern {
  Children children;                  ///< their kinds by slot
  std::array<std::uint8_t, 64> node;  ///< of corner a in slot s at 8 s + a: number in the parent, in the order met
  std::uint64_t inner;                ///< bit 8 s + a: whether that is an inner node

  std::string_view bytes() const { return {reinterpret_cast<const char*>(this), sizeof *this}; }
  bool operator==(const Pattern& other) const { return bytes() == other.bytes(); }
  struct Hash {
    std::size_t operator()(const Pattern& p) const { return std::hash<std::string_view>()(p.bytes()); }
  };
};
static_assert(std::has_unique_object_representations_v<Pattern>);

/// The cells of a level as kinds.
struct Kinds {
  std::vector<std::int32_t> of_cell;
  std::vector<Pattern> patterns;      ///< of each kind
  std::vector<std::int32_t> element;  ///< of each kind
};

/// Which parent alone has each node of a level; -1: several have it, or something acts on it.
/// @param acting  on cells of that level
std::vector<std::int32_t> owners_of_nodes(const Level& level, const NodeNumbering& numbering,
                                          const std::vector<std::int32_t>& parents,
                                          const std::vector<ActingPoint>& acting) {
  constexpr std::int32_t nobody = -2;
  std::vector<std::int32_t> owner(numbering.nodes.size(), nobody);
  for (std::size_t c = 0; c < numbering.cell_nodes.size(); ++c)
    for (const std::int32_t node : numbering.cell_nodes[c]) {
      std::int32_t& o = owner[as_size(node)];
      if (o != parents[c]) o = o == nobody ? parents[c] : -1;
    }
  constexpr double nothing = 1e-9;
  for (const ActingPoint& point : acting) {
    const std::size_t cell = as_size(point.cell);
    const NodeWeights weights = shape_functions(local_in_cell(point.index, level.cells[cell], level.voxels_per_cell));
    for (std::size_t a = 0; a < 8; ++a)
      if (std::abs(weights[static_cast<Index>(a)]) > nothing) owner[as_size(numbering.cell_nodes[cell][a])] = -1;
  }
  return owner;
}

/// Whether a corner of a child is one of its parent.
bool is_corner_of_parent(int slot, int corner, const Index3& merge) {
  return weights_in_parent(slot, corner, merge).maxCoeff() == 1;
}

/// @param parents  of the cells of `below`
/// @param finer    the kinds of these
/// @param acting   on these
Kinds kinds_of_parents(const Level& above, const Level& below, const std::vector<std::int32_t>& parents,
                       const std::vector<std::int32_t>& finer, const std::vector<ActingPoint>& acting) {
  const NodeNumbering numbering = nodes_of(below);
  const std::vector<std::int32_t> owner = owners_of_nodes(below, numbering, parents, acting);
  std::vector<Children> children(above.cells.size());
  for (Children& of_parent : children) of_parent.fill(-1);
  for (std::size_t c = 0; c < parents.size(); ++c)
    children[as_size(parents[c])][as_size(slot_in_parent(below.cells[c], above.merge))] = static_cast<std::int32_t>(c);

  std::uint64_t corners_of_parent = 0;
  for (int slot = 0; slot < 8; ++slot)
    for (int corner = 0; corner < 8; ++corner)
      if (is_corner_of_parent(slot, corner, above.merge)) corners_of_parent |= std::uint64_t{1} << (8 * slot + corner);

  Kinds out;
  out.of_cell.resize(above.cells.size());
  std::unordered_map<Pattern, std::int32_t, Pattern::Hash> known;
  for (std::size_t p = 0; p < children.size(); ++p) {
    Pattern pattern{{}, {}, 0};
    pattern.node.fill(none);
    std::array<std::int32_t, 64> met;
    std::uint8_t num_met = 0;
    for (std::size_t slot = 0; slot < 8; ++slot) {
      const std::int32_t child = children[p][slot];
      pattern.children[slot] = child < 0 ? -1 : finer[as_size(child)];
      if (child < 0) continue;
      for (std::size_t a = 0; a < 8; ++a) {
        const std::int32_t node = numbering.cell_nodes[as_size(child)][a];
        const auto number =
            static_cast<std::uint8_t>(std::find(met.begin(), met.begin() + num_met, node) - met.begin());
        if (number == num_met) met[num_met++] = node;
        pattern.node[8 * slot + a] = number;
        const std::uint64_t bit = std::uint64_t{1} << (8 * slot + a);
        if (owner[as_size(node)] >= 0 && !(corners_of_parent & bit)) pattern.inner |= bit;
      }
    }
    const auto [entry, is_new] = known.try_emplace(pattern, static_cast<std::int32_t>(out.patterns.size()));
    out.of_cell[p] = entry->second;
    if (!is_new) continue;
    out.patterns.push_back(pattern);
    out.element.push_back(above.element[p]);
  }
  return out;
}

/// Cells of level 0, as they are.
CondensedLevel condensed_voxels(const Lattice& lattice, CondensedDilatation dilatation) {
  const ElementMatrices matrices(lattice.cell_edges(0));
  const double volume = lattice.voxels.voxel_volume();
  CondensedLevel out{lattice.level(0).element, {}, {}};
  for (const VoxelMaterial& m : lattice.materials) {
    const Element voxel = full_voxel(m.material, volume);
    out.element.push_back(static_cast<std::int32_t>(out.element.size()));
    CondensedElement& c = out.condensed.emplace_back();
    c.volume = volume;
    c.divergence = matrices.divergence(voxel);
    for (int a = 0; a < 8; ++a) c.weight.middleRows<3>(3 * a) = matrices.lumped_mass(voxel)[a] * Mat3::Identity();
    if (dilatation == CondensedDilatation::full) {
      c.stiffness = matrices.stiffness(voxel);
      continue;
    }
    const double bulk = voxel.total_bulk(), of_voxel = std::min(bulk, 2.0 / 3 * voxel.total_shear());
    c.stiffness = mean_dilatation_stiffness(matrices.deviatoric(voxel), c.divergence, of_voxel, volume);
    c.excess = bulk - of_voxel;
  }
  return out;
}

/// With F the forces on inner nodes and M their own matrix, both with what `excess` resists: K' = K_parent -
/// relaxing (2 - relaxing) F^T M^-1 F.
CondensedElement condensed(const Pattern& pattern, const std::vector<CondensedElement>& finer, const Index3& merge) {
  constexpr Index not_inner = -1;
  std::array<Index, 64> row_of_node;
  row_of_node.fill(not_inner);
  Index size = 0;
  for (std::size_t n = 0; n < 64; ++n)
    if (pattern.inner >> n & 1 && row_of_node[pattern.node[n]] == not_inner) {
      row_of_node[pattern.node[n]] = size;
      size += 3;
    }
  Eigen::MatrixXd m = Eigen::MatrixXd::Zero(size, size), force = Eigen::MatrixXd::Zero(size, 24);
  Eigen::VectorXd b_inner = Eigen::VectorXd::Zero(size);
  Eigen::MatrixX3d weight = Eigen::MatrixX3d::Zero(size, 3);
  CondensedElement out;
  for (int slot = 0; slot < 8; ++slot) {
    const std::int32_t child = pattern.children[as_size(slot)];
    if (child < 0) continue;
    const CondensedElement& of = finer[as_size(child)];
    out.excess += of.excess;
    out.volume += of.volume;
    std::array<NodeWeights, 8> weights;  // of the parent's corners in each of the child's
    for (int a = 0; a < 8; ++a) weights[as_size(a)] = weights_in_parent(slot, a, merge);
    CellMatrix forces = CellMatrix::Zero();  // on the child's nodes, of where the parent's are
    for (int a = 0; a < 8; ++a)
      for (int corner = 0; corner < 8; ++corner)
        if (const double w = weights[as_size(a)][corner]; w != 0)
          forces.middleCols<3>(3 * corner) += w * of.stiffness.middleCols<3>(3 * a);
    for (int a = 0; a < 8; ++a) {
      for (int corner = 0; corner < 8; ++corner)
        if (const double w = weights[as_size(a)][corner]; w != 0) {
          out.stiffness.middleRows<3>(3 * corner) += w * forces.middleRows<3>(3 * a);
          out.divergence.segment<3>(3 * corner) += w * of.divergence.segment<3>(3 * a);
          out.weight.middleRows<3>(3 * corner) += w * of.weight.middleRows<3>(3 * a);
        }
      const std::uint8_t* node = &pattern.node[as_size(8 * slot)];
      const Index row = row_of_node[node[a]];
      if (row == not_inner) continue;
      force.middleRows<3>(row) += forces.middleRows<3>(3 * a);
      b_inner.segment<3>(row) += of.divergence.segment<3>(3 * a);
      weight.middleRows<3>(row) += of.weight.middleRows<3>(3 * a);
      for (int other = 0; other < 8; ++other)
        if (const Index column = row_of_node[node[other]]; column != not_inner)
          m.block<3, 3>(row, column) += of.stiffness.block<3, 3>(3 * a, 3 * other);
    }
  }
  if (size > 0) {
    const double factor = out.excess / (out.volume * out.volume);
    m += factor * b_inner * b_inner.transpose();
    force += factor * b_inner * out.divergence.transpose();
    constexpr double rounding = 1e-13;
    m.diagonal().array() += rounding * m.trace() / static_cast<double>(size);
    const Eigen::LLT<Eigen::MatrixXd> factors(m);
    factors.matrixL().solveInPlace(force);
    factors.matrixL().solveInPlace(b_inner);
    factors.matrixL().solveInPlace(weight);
    const CellVector b = out.divergence;
    out.divergence -= relaxing * force.transpose() * b_inner;
    out.stiffness -= relaxing * (2 - relaxing) * force.transpose() * force;
    out.weight -= relaxing * (2 - relaxing) * force.transpose() * weight;
    out.stiffness += factor * (b * b.transpose() - out.divergence * out.divergence.transpose());
  }
  out.stiffness = (out.stiffness + out.stiffness.transpose()).eval() / 2;
  return out;
}

}  // namespace

Condensation::Condensation(const Lattice& lattice, std::vector<ActingPoint> acting, CondensedDilatation dilatation)
    : lattice_(&lattice),
      acting_(std::move(acting)),
      dilatation_(dilatation),
      levels_{condensed_voxels(lattice, dilatation)} {}

bool Condensation::is_of(const Lattice& lattice, const std::vector<ActingPoint>& acting,
                         CondensedDilatation dilatation) const {
  return lattice_ == &lattice && dilatation_ == dilatation && acting_ == acting;
}

const CondensedLevel& Condensation::level(int level) {
  while (levels_.size() <= as_size(level)) {
    const int n = static_cast<int>(levels_.size());
    const Level& above = lattice_->level(n);
    const CondensedLevel& finer = levels_.back();
    std::vector<ActingPoint> acting = acting_;
    if (n > 1)
      for (ActingPoint& point : acting) point.cell = coarser_cell_of(*lattice_, 0, point.cell, n - 1);
    Kinds kinds =
        kinds_of_parents(above, lattice_->level(n - 1), coarser_cells_of(*lattice_, n - 1, n), finer.kind, acting);
    CondensedLevel out{std::move(kinds.of_cell), std::move(kinds.element),
                       std::vector<CondensedElement>(kinds.patterns.size())};
    const auto count = static_cast<std::ptrdiff_t>(kinds.patterns.size());
#pragma omp parallel for schedule(dynamic, 16)
    for (std::ptrdiff_t k = 0; k < count; ++k)
      out.condensed[static_cast<std::size_t>(k)] =
          condensed(kinds.patterns[static_cast<std::size_t>(k)], finer.condensed, above.merge);
    levels_.push_back(std::move(out));
  }
  return levels_[as_size(level)];
}

CondensedLevel Condensation::take(int level) {
  this->level(level);
  CondensedLevel out = std::move(levels_[as_size(level)]);
  levels_.resize(as_size(level));
  return out;
}

}  // namespace hexmesh
