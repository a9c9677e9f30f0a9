// SPDX-License-Identifier: Apache-2.0
#include "distributed/shared_level.h"

#include <algorithm>
#include <cmath>

#include "constraints/patch_springs.h"
#include "constraints/select_points.h"
#include "distributed/cell_flags.h"
#include "distributed/shared_supports.h"
#include "level/level_problem.h"
#include "terms/loads.h"
#include "terms/make_elastic_cells.h"
#include "terms/turns.h"

namespace hexsolver::mpi {

using hexmesh::Lattice;

SharedLevel::SharedLevel(const Processes& all, const hexmesh::LatticeReader& file, const Lattice& outline,
                         const Scene& scene, int level, Matchings matchings)
    : all_(all),
      file_(file),
      outline_(outline),
      scene_(scene),
      level_(level),
      elasticity_(scene.elasticity),
      matchings_(std::move(matchings)) {
  all.all_or_none([&] { num_cells_ = file.num_cells(level); });
  piece_ = std::make_unique<Piece>(all, file, outline, level, num_cells_,
                                   scene.stiffness_of_cells() == Stiffness::condensed ? 2 : 1);
  const SharedMerges merges = merges_of_parts(outline.cell_size(level), num_cells_, all.count());
  part_.emplace(take_part(all, file, outline, level, *piece_, merges.block));
  make_hierarchy(merges);

  check(VecCreateMPI(all.comm(), 3 * nodes_->num_own(), 3 * nodes_->num_all(), pattern_.address()));
  check(VecSetBlockSize(pattern_, 3));
  copies_ = NodeCopies(pattern_, nodes_->numbers());

  std::vector<SharedConstraints::Point> holding;
  all.all_or_none([&] { holding = select(); });  // what is not found, nobody finds
  check_supports(*this, holding);
  build_potential(scene.elasticity, {});
  constraints_ = std::make_unique<SharedConstraints>(points_, scene, outline.cell_edges(level), outline.corner(),
                                                     *nodes_, pattern_);
  find_springs();
  hold_in_part();
  check(MatCreateShell(all.comm(), 3 * nodes_->num_own(), 3 * nodes_->num_own(), PETSC_DETERMINE, PETSC_DETERMINE, this,
                       product_.address()));
  check(MatSetUp(product_));
  check(MatShellSetOperation(product_, MATOP_MULT, reinterpret_cast<void (*)()>(+[](Mat a, Vec x, Vec y) {
                               SharedLevel* self = nullptr;
                               PetscErrorCode code = MatShellGetContext(a, &self);
                               if (code == 0) self->apply(x, y);
                               return code;
                             })));
}

void SharedLevel::build_potential(Elasticity elasticity, std::vector<bool> rotating) {
  // Processes without cells have no flags of cells.
  if (potential_ && elasticity == elasticity_ && all_.sum(rotating.size()) == 0) return;
  elasticity_ = elasticity;
  rotating_ = rotating;
  auto elastic = make_elastic_cells(mesh(), {part_->lattice, level_},
                                    elastic_settings(scene_, elasticity, std::move(rotating), condense_part()));
  elastic_ = elastic.get();
  if (scene_.stiffness_of_cells() == Stiffness::condensed && scene_.gravity != Vec3::Zero())
    loads_.back() = forces_of(*make_weight(scene_.gravity, {part_->lattice, level_}, *elastic), mesh(), copies_);
  rounding_ = std::sqrt(all_.sum(elastic->rounding() * elastic->rounding()));
  energy_rounding_ = all_.sum(elastic->energy_rounding());
  potential_ = std::make_unique<Potential>(mesh());
  potential_->add(std::move(elastic));
  if (!matched_.empty()) add_matches();
  if (!sprung_.empty()) potential_->add(std::make_unique<PatchSprings>(mesh(), sprung_));
}

std::vector<bool> SharedLevel::cells_rotated_by(double angle, const SharedLevel& coarser, const Index3& merge,
                                                Vec u) const {
  coarser.copies_.get(u, coarser.x_);
  std::vector<bool> rotated;
  for (const double turn : turns_of(*coarser.elastic_, coarser.x_)) rotated.push_back(turn > angle);
  return CellFlags(coarser, rotated).of(parents(coarser, merge));
}

std::vector<Piece::Holder> SharedLevel::parents(const SharedLevel& coarser, const Index3& merge) const {
  if (outline_.parting.any()) return coarser.piece().holders_of(part_->voxels);
  std::vector<Piece::Holder> out;
  for (const Key& cell : keys().cells) out.push_back({{hexmesh::coarser_index(cell.index, merge)}});
  return out;
}

double SharedLevel::diameter() const {
  Vec3 extent = Vec3::Zero();
  for (const Key& cell : keys().cells)
    extent = extent.cwiseMax(Vec3(cell.index[0] + 1, cell.index[1] + 1, cell.index[2] + 1));
  for (double& e : extent) e = all_.largest(e);
  return (mesh().edges().cwiseAbs() * extent).norm();
}

std::vector<SharedConstraints::Point> SharedLevel::select() {
  Selector selector({piece_->lattice(), level_}, piece_->mesh(), piece_->share());
  if (scene_.stiffness_of_cells() == Stiffness::condensed) selector.note_what_acts();
  std::vector<SharedConstraints::Point> own;
  for (const ConstraintPoint& p : select_points(scene_, selector)) {
    SharedConstraints::Point point = in_piece({p.cell, p.weights, {}});
    point.condition = p.condition;
    point.axes = p.axes;
    point.area = p.area;
    point.is_quarter = p.is_quarter;
    point.is_soft = p.is_soft;
    point.num_alike = p.num_alike;
    own.push_back(point);
  }
  points_ = all_.gather(own);
  // In the order in which one process finds them.
  std::stable_sort(points_.begin(), points_.end(),
                   [](const auto& a, const auto& b) { return a.condition < b.condition; });

  std::vector<SharedConstraints::Point> holding = points_;
  const std::vector<SharedConstraints::Point> matched = find_matched(selector);
  holding.insert(holding.end(), matched.begin(), matched.end());

  const auto add = [&](const std::vector<std::unique_ptr<Load>>& loads, const Mesh& mesh, const NodeCopies& copies) {
    for (const auto& load : loads) loads_.push_back(forces_of(*load, mesh, copies));
  };
  Scene part = scene_;
  part.gravity = Vec3::Zero();
  const NodeCopies of_piece(pattern_, nodes_->find(piece_->keys().nodes));
  add(make_loads(part, {piece_->lattice(), level_}, piece_->mesh(), selector), piece_->mesh(), of_piece);
  part = scene_;
  part.forces.clear();
  add(make_loads(part, {part_->lattice, level_}, mesh(), selector), mesh(), copies_);
  acting_ = acting_of_all(selector.acting());
  return holding;
}

OwnedVec SharedLevel::forces_of(const Load& load, const Mesh& mesh, const NodeCopies& copies) const {
  const NodeVector rest = NodeVector::Zero(static_cast<Eigen::Index>(mesh.num_dofs()));
  NodeVector gradient = rest, magnitude = rest;
  load.add_gradient(rest, gradient, magnitude);
  OwnedVec out = make_vector();
  copies.add_to(-gradient, out);
  return out;
}

std::vector<Acting> SharedLevel::acting_of_all(const std::vector<Acting>& own) const {
  const Vec3 low(0, 0, piece_->rows().low * piece_->level().voxels_per_cell[2]);
  using Numbers = std::array<double, 8>;
  std::vector<Numbers> in_whole;
  for (const Acting& a : own) {
    const Vec3 index = a.index + low, center = a.center + low;
    in_whole.push_back({index[0], index[1], index[2], center[0], center[1], center[2], a.reach, a.in_all ? 1.0 : 0.0});
  }
  std::vector<Acting> out;
  for (const Numbers& n : all_.gather(in_whole))
    out.push_back({Vec3(n[0], n[1], n[2]) - low, Vec3(n[3], n[4], n[5]) - low, n[6], n[7] != 0});
  return out;
}

std::vector<hexmesh::CondensedLevel> SharedLevel::condense_piece() const {
  if (scene_.stiffness_of_cells() != Stiffness::condensed || level_ == 0) return {};
  const Lattice layers = piece_->with_finer_levels(file_, outline_);
  std::optional<hexmesh::Condensation> of_layers;
  return condense({layers, level_}, scene_, acting_, of_layers);
}

std::vector<hexmesh::CondensedLevel> SharedLevel::condense_part() const {
  std::vector<hexmesh::CondensedLevel> out = condense_piece();
  for (hexmesh::CondensedLevel& level : out) level = take_condensed(all_, *piece_, *part_, level);
  return out;
}

SharedConstraints::Point SharedLevel::in_piece(const SurfacePoint& p) const {
  const Piece::Holder of = piece_->cell(static_cast<std::size_t>(p.cell));
  SharedConstraints::Point out;
  out.cell = of.cell;
  out.corners = of.corners;
  NodeWeights::Map(out.weights.data()) = p.weights;
  return out;
}

void SharedLevel::make_hierarchy(SharedMerges merges) {
  const Lattice& lattice = part_->lattice;
  Mesh part = part_->keys.make_mesh(part_->low, lattice.cell_edges(level_), lattice.corner());
  nodes_ = std::make_unique<SharedNodes>(all_, piece_->layers(), keys().nodes);
  const std::size_t dofs = coarsest_dofs(outline_, scene_);
  if (3 * static_cast<std::size_t>(nodes_->num_all()) <= dofs) merges.factors = {{1, 1, 1}};  // all have the whole
  if (all_.count() == 1)
    hierarchy_ = std::make_unique<Hierarchy>(std::move(part), lattice.corner(), dofs);
  else
    hierarchy_ = std::make_unique<Hierarchy>(make_part_hierarchy(all_, std::move(part), keys().nodes, part_->low,
                                                                 lattice.corner(), outline_.corner(), merges, dofs));
  hierarchy_->in_double = is_of_high_contrast(outline_);
}

void SharedLevel::set_progress(const Progress& progress) {
  constraints_->prescribe(scene_, progress);
  for (std::size_t n = 0; n < sprung_.size(); ++n)
    sprung_[n].value = constraints_->local().held()[number_of_sprung_[n]].value;
  load_factor_ = progress.fraction;
  for (MatchTerm* m : matches_) m->set_progress(progress);
}

double SharedLevel::strain_energy(Vec u) const {
  copies_.get(u, x_);
  return all_.sum(elastic_->energy(x_));
}

double SharedLevel::energy(Vec u) const {
  copies_.get(u, x_);
  double sum = all_.sum(potential_->energy(x_));
  for (const OwnedVec& load : loads_) sum -= load_factor_ * dot(load, u);
  return sum;
}

double SharedLevel::gradient(Vec u, Vec gradient) const {
  copies_.get(u, x_);
  NodeVector magnitude;
  potential_->gradient(x_, y_, magnitude);
  check(VecZeroEntries(gradient));
  copies_.add_to(y_, gradient);
  const OwnedVec sum = make_vector(), size = make_vector();
  copies_.add_to(magnitude, sum);
  for (const OwnedVec& load : loads_) {
    check(VecAXPY(gradient, -load_factor_, load));
    check(VecCopy(load, size));
    check(VecAbs(size));
    check(VecAXPY(sum, std::abs(load_factor_), size));
  }
  return norm(sum);
}

double SharedLevel::inner_forces(Vec u) const {
  copies_.get(u, x_);
  NodeVector forces = NodeVector::Zero(x_.size()), magnitude = forces;
  elastic_->add_gradient(x_, forces, magnitude);
  const OwnedVec sum = make_vector();
  copies_.add_to(forces, sum);
  return norm(sum);
}

double SharedLevel::rounding(Vec u) const {
  const double in_half_edges = norm(u, NORM_INFINITY) / (0.5 * mesh().edges().colwise().norm().minCoeff());
  return is_linear() ? std::min(1.0, in_half_edges) * rounding_ : rounding_;
}

void SharedLevel::linearize(Vec u, double clamping) {
  copies_.get(u, x_);
  potential_->linearize(x_, clamping);
}

void SharedLevel::apply_unheld(Vec x, Vec y) const {
  copies_.get(x, x_);
  potential_->apply(x_, y_);
  check(VecZeroEntries(y));
  copies_.add_to(y_, y);
}

void SharedLevel::apply(Vec x, Vec y) const {
  if (!projected_) projected_ = make_vector();
  check(VecCopy(x, projected_));
  constraints_->project(projected_);
  apply_unheld(projected_, y);
  constraints_->project(y);
}

NodeVector SharedLevel::part_of(Vec field) const {
  NodeVector values;
  copies_.get(field, values);
  return values;
}

void SharedLevel::put_own(const NodeVector& values, Vec field) const {
  PetscScalar* to = nullptr;
  check(VecGetArray(field, &to));
  for (std::size_t n = 0; n < mesh().num_nodes(); ++n)
    if (const PetscInt number = nodes_->numbers()[n]; nodes_->owns(number))
      Vec3::Map(to + 3 * (number - nodes_->first_own())) = values.segment<3>(3 * static_cast<Eigen::Index>(n));
  check(VecRestoreArray(field, &to));
}

void SharedLevel::prolongate(const SharedLevel& coarser, const Index3& merge, Vec from, Vec to) const {
  // Of each node, a cell of the part at it and which corner of that it is.
  std::vector<std::pair<std::size_t, int>> corner_at(mesh().num_nodes());
  for (std::size_t c = 0; c < mesh().num_cells(); ++c)
    for (int a = 0; a < hexmesh::num_cell_nodes; ++a) corner_at[mesh().node(c, static_cast<std::size_t>(a))] = {c, a};
  struct Share {
    std::size_t node;
    double weight;
    Key of;
  };
  std::vector<Share> shares;
  std::vector<Key> needed;
  const std::vector<Piece::Holder> parent_of = parents(coarser, merge);
  for (std::size_t n = 0; n < corner_at.size(); ++n) {
    if (!nodes_->owns(nodes_->numbers()[n])) continue;
    const auto& [c, corner] = corner_at[n];
    const Piece::Holder& parent = parent_of[c];
    int slot = 0;
    for (std::size_t d = 0; d < 3; ++d) slot |= keys().cells[c].index[d] % merge[d] << d;
    const NodeWeights weights = hexmesh::weights_in_parent(slot, corner, merge);
    for (int b = 0; b < hexmesh::num_cell_nodes; ++b) {
      if (weights[b] == 0) continue;
      const Key of{hexmesh::corner_of(parent.cell.index, b), parent.corners[static_cast<std::size_t>(b)]};
      shares.push_back({n, weights[b], of});
      needed.push_back(of);
    }
  }
  make_distinct(needed);
  NodeVector values;
  NodeCopies(from, coarser.nodes().find(needed)).get(from, values);
  NodeVector sum = NodeVector::Zero(static_cast<Eigen::Index>(mesh().num_dofs()));
  for (const Share& s : shares)
    sum.segment<3>(3 * static_cast<Eigen::Index>(s.node)) +=
        s.weight * values.segment<3>(3 * Eigen::Index{place_of(needed, s.of)});
  put_own(sum, to);
}

double SharedLevel::mean_of_all(double mean) const {
  double volume = 0;
  for (std::size_t c = 0; c < mesh().num_cells(); ++c) volume += elastic_->model(c).volume;
  return all_.sum(volume * mean) / all_.sum(volume);
}

ElasticCells::Size SharedLevel::size_in_material(Vec field) const {
  copies_.get(field, x_);
  ElasticCells::Size size;
  if (mesh().num_cells() > 0) size = elastic_->size_in_material(x_);
  return {mean_of_all(size.mean), all_.largest(size.largest)};
}

double SharedLevel::mean_deformation(Vec u) const {
  copies_.get(u, x_);
  RigidFit fit(part_->lattice.corner() - outline_.corner());
  if (mesh().num_cells() > 0) elastic_->add_to(fit, x_);
  all_.add_up(fit.sums());
  fit.solve();
  return mean_of_all(mesh().num_cells() > 0 ? elastic_->deformation_in_material(x_, fit) : 0);
}

double SharedLevel::share_of_turns(double angle, Vec u) const {
  copies_.get(u, x_);
  const SquaresOfTurns own = squares_of_turns(*elastic_, x_, angle);
  return SquaresOfTurns{all_.sum(own.all), all_.sum(own.below)}.share();
}

Vec3 SharedLevel::total(Vec forces) const {
  const NodeVector mine = part_of(forces);
  Vec3 sum = Vec3::Zero();
  for (std::size_t n = 0; n < mesh().num_nodes(); ++n)
    if (nodes_->owns(nodes_->numbers()[n])) sum += mine.segment<3>(3 * static_cast<Eigen::Index>(n));
  all_.add_up({sum.data(), 3});
  return sum;
}

double SharedLevel::size_of_loads() const {
  double largest = 0;
  for (const auto& load : loads_) largest = std::max(largest, std::abs(load_factor_) * total(load).norm());
  return largest;
}

std::vector<BalanceReport::Row> SharedLevel::loads(Vec u, const Arms& arms) const {
  std::vector<bool> own;
  for (const PetscInt number : nodes_->numbers()) own.push_back(nodes_->owns(number));
  const NodeVector displacement = part_of(u);
  std::vector<BalanceReport::Row> out;
  for (std::size_t n = 0; n < loads_.size(); ++n) {
    const std::string name = n < scene_.forces.size() ? load_name(scene_.forces[n]) : name_of(EffectKind::gravity);
    out.push_back(resultant(name, load_factor_ * part_of(loads_[n]), mesh(), displacement, arms, own));
  }
  for (const MatchTerm* match : matches_) {
    NodeVector gradient = NodeVector::Zero(displacement.size()), magnitude = gradient;
    match->add_gradient(displacement, gradient, magnitude);
    out.push_back(resultant(match->name(), -gradient, mesh(), displacement, arms));
  }
  for (BalanceReport::Row& row : out)
    for (Vec3* total : {&row.force_n, &row.moment_n_mm}) all_.add_up({total->data(), 3});
  return out;
}

std::string SharedLevel::limit_reached(Vec u, bool nearly) const {
  copies_.get(u, x_);
  const std::string own = x_.allFinite() ? elastic_->limit_reached(x_, nearly) : "";
  const bool is_first = all_.least(own.empty() ? all_.count() : all_.rank()) == all_.rank();
  const std::vector<char> words =
      all_.gather(is_first ? std::vector<char>(own.begin(), own.end()) : std::vector<char>());
  return {words.begin(), words.end()};
}

ProcessReport SharedLevel::holding() const {
  return {mesh().num_cells(),
          static_cast<std::size_t>(nodes_->num_own()),
          mesh().num_nodes() - static_cast<std::size_t>(nodes_->num_own()),
          piece_->level().cells.size(),
          piece_->lattice().labels.size(),
          constraints_->mesh().num_nodes()};
}

}  // namespace hexsolver::mpi
