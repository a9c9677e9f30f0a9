// SPDX-License-Identifier: Apache-2.0
#include "distributed/shared_level.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>

#include "constraints/select_points.h"
#include "constraints/supports.h"
#include "core/rotation.h"
#include "hexmesh/lattice/locator.h"
#include "level/cell_changes.h"
#include "level/level_problem.h"
#include "level/make_result.h"
#include "terms/loads.h"
#include "terms/make_elastic_cells.h"

namespace hexsolver::mpi {
namespace {

using hexmesh::ErrorKind;
using hexmesh::Lattice;

Index3 sum_of(const Index3& a, const Index3& b) { return {a[0] + b[0], a[1] + b[1], a[2] + b[2]}; }

std::vector<Index3> shifted(std::vector<Index3> indices, const Index3& by) {
  for (Index3& i : indices) i = sum_of(i, by);
  return indices;
}

/// A cell on its way to the process that gets it.
struct TravellingCell {
  Index3 index;
  std::int32_t element;
};

std::vector<std::uint64_t> first_rows_of(const Processes& all, const hexmesh::LatticeReader& file, int level,
                                         std::size_t num_cells) {
  const auto rank = static_cast<std::size_t>(all.rank()), count = static_cast<std::size_t>(all.count());
  const std::size_t begin = num_cells * rank / count, end = num_cells * (rank + 1) / count;
  std::vector<std::uint64_t> in_layer;
  all.all_or_none([&] { in_layer = file.cells_in_layers(level, begin, end - begin); });
  in_layer = all.sum(std::move(in_layer));
  std::vector<std::uint64_t> rows = {0};
  for (const std::uint64_t n : in_layer) rows.push_back(rows.back() + n);
  return rows;
}

/// Layers around those that a piece stands for: what cells and nodes of these touch.
constexpr std::int32_t margin = 1;

}  // namespace

/// The layers that a piece stands for.
class SharedLevel::Share final : public SurfaceShare {
public:
  Share(const Processes& all, const hexmesh::LatticePiece& piece, int layer_voxels)
      : all_(all), piece_(piece), layer_voxels_(layer_voxels) {}
  bool has_voxel(const Index3& voxel) const override { return has(voxel[2] / layer_voxels_, piece_.end); }
  bool has_node(const Index3& node) const override {
    return has(node[2], piece_.end + (all_.rank() + 1 == all_.count()));
  }
  double least(double value) const override { return all_.least(value); }
  double sum(double value) const override { return all_.sum(value); }
  bool is_first(bool mine) const override {
    const int rank = all_.rank();
    return all_.least(mine ? rank : all_.count()) == rank;
  }

private:
  bool has(std::int32_t layer, std::int32_t end) const { return layer >= piece_.begin && layer < end; }
  const Processes& all_;
  const hexmesh::LatticePiece& piece_;
  int layer_voxels_;
};

SharedLevel::~SharedLevel() = default;

SharedLevel::SharedLevel(const Processes& all, const hexmesh::LatticeReader& file, const Lattice& outline,
                         const Scene& scene, int level)
    : all_(all), file_(file), outline_(outline), scene_(scene), level_(level), elasticity_(scene.elasticity) {
  const auto n = static_cast<std::size_t>(level);
  all.all_or_none([&] { num_cells_ = file.num_cells(level); });
  const std::vector<std::uint64_t> first_rows = first_rows_of(all, file, level, num_cells_);
  layers_.emplace(all, first_rows);
  all.all_or_none([&] {
    piece_ = file.read_layers(outline, level, first_rows, layers_->begin(all.rank()), layers_->end(all.rank()), margin);
  });
  take_part();  // as the file numbers elements
  all.all_or_none([&] { file.read_elements(piece_->lattice, level, piece_->lattice.levels[n].element); });
  const Lattice& piece = piece_->lattice;
  piece_mesh_ = std::make_unique<Mesh>(piece.levels[n].cells, piece.cell_edges(level), piece.corner());

  check(VecCreateMPI(all.comm(), 3 * nodes_->num_own(), 3 * nodes_->num_all(), pattern_.address()));
  check(VecSetBlockSize(pattern_, 3));
  copies_ = NodeCopies(pattern_, nodes_->numbers());
  build_potential(scene.elasticity, {});

  const Share share(all, *piece_, outline.levels[n].voxels_per_cell[2]);
  all.all_or_none([&] { select(share); });  // what is not found, nobody finds
  check_supports();
  constraints_ = std::make_unique<SharedConstraints>(points_, scene, outline.cell_edges(level), outline.corner(),
                                                     *nodes_, pattern_);
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
  if (potential_ && elasticity == elasticity_ && rotating.empty()) return;
  elasticity_ = elasticity;
  auto elastic = make_elastic_cells(
      mesh(), *part_, level_,
      {elasticity, scene_.rotation, scene_.volumetric, scene_.stiffness, std::move(rotating), false});
  elastic_ = elastic.get();
  rounding_ = std::sqrt(all_.sum(elastic->rounding() * elastic->rounding()));
  potential_ = std::make_unique<Potential>(mesh());
  potential_->add(std::move(elastic));
}

/// A cell of the coarser level is known by its first node.
std::vector<bool> SharedLevel::cells_rotated_by(double angle, const SharedLevel& coarser, const Index3& merge,
                                                Vec u) const {
  coarser.copies_.get(u, coarser.x_);
  NodeVector flags = NodeVector::Zero(static_cast<Eigen::Index>(coarser.mesh().num_dofs()));
  for (std::size_t c = 0; c < coarser.mesh().num_cells(); ++c) {
    const Mat3 f = coarser.elastic_->mean_gradient(c, coarser.x_);
    if (rotation_angle(polar_decomposition(f).rotation) > angle)
      flags[3 * Eigen::Index{coarser.mesh().cell_nodes()[c][0]}] = 1;
  }
  const OwnedVec shared = coarser.make_vector();
  coarser.copies_.raise_to(flags, shared);

  std::vector<Index3> parents;
  for (const Index3& cell : shifted(mesh().cells(), low_))
    parents.push_back({cell[0] / merge[0], cell[1] / merge[1], cell[2] / merge[2]});
  std::vector<Index3> keys = parents;
  std::sort(keys.begin(), keys.end(), before);
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
  NodeVector values;
  NodeCopies(shared, coarser.nodes().find(keys)).get(shared, values);
  std::vector<bool> rotated;
  for (const Index3& parent : parents)
    rotated.push_back(values[3 * (std::lower_bound(keys.begin(), keys.end(), parent, before) - keys.begin())] > 0);
  return rotated;
}

double SharedLevel::diameter() const {
  Vec3 extent = Vec3::Zero();
  for (const Index3& cell : shifted(mesh().cells(), low_))
    extent = extent.cwiseMax(Vec3(cell[0] + 1, cell[1] + 1, cell[2] + 1));
  for (double& e : extent) e = all_.largest(e);
  return (mesh().edges().cwiseAbs() * extent).norm();
}

void SharedLevel::take_part() {
  const auto n = static_cast<std::size_t>(level_);
  const hexmesh::Level& from = piece_->lattice.levels[n];
  std::vector<TravellingCell> own;
  std::vector<Index3> indices;
  for (std::size_t c = piece_->first_cell; c < piece_->first_cell + piece_->num_own_cells; ++c) {
    indices.push_back(sum_of(from.cells[c], {0, 0, piece_->low}));
    own.push_back({indices.back(), from.element[c]});
  }
  const SharedMerges merges = merges_of_parts(outline_.cell_size(level_), num_cells_, all_.count());
  for (Index3& index : indices) index = hexmesh::coarser_index(index, merges.block);
  const std::vector<int> goes_to = partition_along_curve(all_, indices);
  std::vector<std::vector<TravellingCell>> to(static_cast<std::size_t>(all_.count()));
  for (std::size_t c = 0; c < own.size(); ++c) to[static_cast<std::size_t>(goes_to[c])].push_back(own[c]);
  std::vector<TravellingCell> cells;
  for (const std::vector<TravellingCell>& part : all_.exchange(to)) cells.insert(cells.end(), part.begin(), part.end());
  std::sort(cells.begin(), cells.end(),
            [](const TravellingCell& a, const TravellingCell& b) { return before(a.index, b.index); });

  if (!cells.empty()) low_ = cells.front().index;
  for (const TravellingCell& c : cells)
    for (std::size_t d = 0; d < 3; ++d) low_[d] = std::min(low_[d], c.index[d]);
  for (std::size_t d = 0; d < 3; ++d) low_[d] -= low_[d] % merges.block[d];
  part_.emplace(outline_);
  hexmesh::Level& level = part_->levels[n];
  const Index3& size = level.voxels_per_cell;
  const hexmesh::Grid& whole = outline_.voxels;
  part_->voxels =
      hexmesh::Grid(whole.extent(), whole.spacing(),
                    whole.position(Vec3(low_[0] * size[0], low_[1] * size[1], low_[2] * size[2])), whole.direction());
  for (const TravellingCell& c : cells) {
    level.cells.push_back({c.index[0] - low_[0], c.index[1] - low_[1], c.index[2] - low_[2]});
    level.element.push_back(c.element);
  }
  all_.all_or_none([&] { file_.read_elements(*part_, level_, level.element); });
  make_hierarchy(merges);
}

void SharedLevel::select(const Share& share) {
  Selector selector(piece_->lattice, level_, *piece_mesh_, share);
  std::vector<SharedConstraints::Point> own;
  for (const ConstraintPoint& p : select_points(scene_, selector)) {
    SharedConstraints::Point point;
    point.condition = p.condition;
    point.cell = sum_of(piece_mesh_->cells()[static_cast<std::size_t>(p.cell)], {0, 0, piece_->low});
    NodeWeights::Map(point.weights.data()) = p.weights;
    point.axes = p.axes;
    own.push_back(point);
  }
  points_ = all_.gather(own);
  // In the order in which one process finds them.
  std::stable_sort(points_.begin(), points_.end(),
                   [](const auto& a, const auto& b) { return a.condition < b.condition; });

  const auto add = [&](const std::vector<std::unique_ptr<DeadLoad>>& loads, const Mesh& mesh,
                       const NodeCopies& copies) {
    const NodeVector rest = NodeVector::Zero(static_cast<Eigen::Index>(mesh.num_dofs()));
    for (const auto& load : loads) {
      NodeVector gradient = rest, magnitude = rest;
      load->add_gradient(rest, gradient, magnitude);
      loads_.push_back(make_vector());
      copies.add_to(-gradient, loads_.back());
    }
  };
  Scene part = scene_;
  part.gravity = Vec3::Zero();
  const NodeCopies of_piece(pattern_, nodes_->find(shifted(piece_mesh_->nodes(), {0, 0, piece_->low})));
  add(make_loads(part, piece_->lattice, level_, *piece_mesh_, selector), *piece_mesh_, of_piece);
  part = scene_;
  part.forces.clear();
  add(make_loads(part, *part_, level_, mesh(), selector), mesh(), copies_);
}

std::int32_t SharedLevel::own_cell(const Index3& cell) const {
  const Index3 local = {cell[0] - low_[0], cell[1] - low_[1], cell[2] - low_[2]};
  const auto found = std::lower_bound(mesh().cells().begin(), mesh().cells().end(), local, before);
  return found != mesh().cells().end() && *found == local ? static_cast<std::int32_t>(found - mesh().cells().begin())
                                                          : -1;
}

/// The name, above zero, of the part of the whole body that each of this process's parts belongs to: the highest of
/// those that its own have, told from face to face.
std::vector<double> SharedLevel::part_names(const std::vector<std::int32_t>& part_of_cell,
                                            std::size_t num_parts) const {
  std::vector<double> names(num_parts);
  std::iota(names.begin(), names.end(), 1.0 + static_cast<double>(all_.sum_before(num_parts)));
  // A face is kept with its lowest corner, as the component of its axis.
  const auto for_each_face = [&](auto&& f) {
    for (std::size_t c = 0; c < mesh().num_cells(); ++c)
      for (std::size_t axis = 0; axis < 3; ++axis)
        for (const std::size_t corner : {std::size_t{0}, std::size_t{1} << axis})
          f(3 * Eigen::Index{mesh().cell_nodes()[c][corner]} + static_cast<Eigen::Index>(axis),
            names[static_cast<std::size_t>(part_of_cell[c])]);
  };
  const OwnedVec shared = make_vector();
  for (bool changes = true; changes;) {
    NodeVector faces = NodeVector::Zero(static_cast<Eigen::Index>(mesh().num_dofs()));
    for_each_face([&](Eigen::Index face, double& name) { faces[face] = std::max(faces[face], name); });
    copies_.raise_to(faces, shared);
    copies_.get(shared, faces);
    std::size_t count = 0;
    for_each_face([&](Eigen::Index face, double& name) {
      count += faces[face] > name;
      name = std::max(faces[face], name);
    });
    changes = all_.sum(count) > 0;
  }
  return names;
}

void SharedLevel::check_supports() const {
  std::size_t num_parts = 0;
  const std::vector<std::int32_t> part_of_cell = parts_of(mesh(), num_parts);
  const std::vector<double> names = part_names(part_of_cell, num_parts);
  const auto name_of = [&](std::size_t cell) { return names[static_cast<std::size_t>(part_of_cell[cell])]; };
  const Vec3 half = mesh().edges() * Vec3::Constant(0.5);
  const auto center_of = [&](std::size_t c) -> Vec3 {
    return mesh().position(static_cast<std::size_t>(mesh().cell_nodes()[c][0])) + half;
  };

  struct Sum {
    double name = 0, value = 0;
    std::array<double, 3> sum{};
  };
  const auto gather = [&](auto&& add) {
    std::map<double, Sum> own;
    for (std::size_t c = 0; c < mesh().num_cells(); ++c) {
      Sum& share = own[name_of(c)];
      share.name = name_of(c);
      add(share, c);
    }
    std::vector<Sum> shares;
    for (const auto& [name, share] : own) shares.push_back(share);
    return all_.gather(shares);
  };
  std::map<double, std::size_t> number_of;
  std::vector<BodyPart> parts;
  for (const Sum& s : gather([&](Sum&share, std::size_t c) {
         share.value += 1;
         Vec3::Map(share.sum.data()) += center_of(c);
       })) {
    const auto [entry, is_new] = number_of.try_emplace(s.name, parts.size());
    if (is_new) parts.emplace_back();
    parts[entry->second].num_cells += static_cast<std::size_t>(s.value);
    parts[entry->second].center += Vec3::Map(s.sum.data());
  }
  for (BodyPart& part : parts) part.center /= static_cast<double>(part.num_cells);
  for (const Sum& s : gather([&](Sum&share, std::size_t c) {
         share.value =
             std::max(share.value, (center_of(c) - parts[number_of.at(share.name)].center).norm() + half.norm());
       }))
    parts[number_of.at(s.name)].size = std::max(parts[number_of.at(s.name)].size, s.value);

  // Nodes where the least and the highest name around differ.
  const double beyond = 1 + static_cast<double>(all_.sum(num_parts));
  NodeVector extremes = NodeVector::Zero(static_cast<Eigen::Index>(mesh().num_dofs()));
  for (std::size_t c = 0; c < mesh().num_cells(); ++c)
    for (const std::int32_t n : mesh().cell_nodes()[c]) {
      const Eigen::Index at = 3 * Eigen::Index{n};
      extremes[at] = std::max(extremes[at], name_of(c));
      extremes[at + 1] = std::max(extremes[at + 1], beyond - name_of(c));
    }
  const OwnedVec shared = make_vector();
  copies_.raise_to(extremes, shared);
  copies_.get(shared, extremes);
  const auto is_joint = [&](std::int32_t n) {
    return extremes[3 * Eigen::Index{n}] != beyond - extremes[3 * Eigen::Index{n} + 1];
  };
  struct Meeting {
    PetscInt node;
    double part;
    std::array<double, 3> position;
  };
  std::vector<Meeting> meetings;
  for (std::size_t c = 0; c < mesh().num_cells(); ++c)
    for (const std::int32_t n : mesh().cell_nodes()[c])
      if (is_joint(n)) {
        const Vec3 p = mesh().position(static_cast<std::size_t>(n));
        meetings.push_back({nodes_->numbers()[static_cast<std::size_t>(n)], name_of(c), {p[0], p[1], p[2]}});
      }
  std::map<PetscInt, Joint> joints;
  for (const Meeting& m : all_.gather(meetings)) {
    Joint& joint = joints[m.node];
    joint.position = Vec3::Map(m.position.data());
    const std::size_t part = number_of.at(m.part);
    if (std::find(joint.parts.begin(), joint.parts.end(), part) == joint.parts.end()) joint.parts.push_back(part);
  }

  struct Found {
    std::size_t point;
    double part;
    bool at_joint;
    std::array<double, 3> position;
  };
  std::vector<Found> found;
  for (std::size_t p = 0; p < points_.size(); ++p) {
    const std::int32_t cell = own_cell(points_[p].cell);
    if (cell < 0) continue;
    const NodeWeights weights = NodeWeights::Map(points_[p].weights.data());
    Eigen::Index corner = 0;
    const bool at_node = weights.maxCoeff(&corner) >= 1;
    const Vec3 at = mesh().rest_position(cell, weights);
    found.push_back(
        {p,
         name_of(static_cast<std::size_t>(cell)),
         at_node && is_joint(mesh().cell_nodes()[static_cast<std::size_t>(cell)][static_cast<std::size_t>(corner)]),
         {at[0], at[1], at[2]}});
  }
  std::vector<HeldPoint> held;
  for (const Found& f : all_.gather(found))
    held.push_back({number_of.at(f.part), Vec3::Map(f.position.data()), points_[f.point].axes, f.at_joint});
  std::vector<Joint> all_joints;
  for (auto& [node, joint] : joints) all_joints.push_back(std::move(joint));
  std::vector<std::string> motions;
  for (const FreeMotions& free : free_motions(parts, all_joints, held))
    motions.insert(motions.end(), free.words.begin(), free.words.end());
  if (!motions.empty()) throw SharedError(ErrorKind::geometry, missing_supports(motions, level_));
}

void SharedLevel::hold_in_part() {
  const Constraints& constraints = constraints_->local();
  const std::vector<Index3>& cells = constraints_->mesh().cells();
  std::vector<ConstraintPoint> own;
  for (const ConstraintPoint& p : constraints.held())
    if (const std::int32_t cell = own_cell(cells[static_cast<std::size_t>(p.cell)]); cell >= 0) {
      own.push_back(p);
      own.back().cell = cell;
    }
  std::vector<PartConstraints::Node> nodes;
  const std::vector<Index3> keys = shifted(constraints_->mesh().nodes(), {-low_[0], -low_[1], -low_[2]});
  for (std::size_t n = 0; n < keys.size(); ++n) {
    const auto found = std::lower_bound(mesh().nodes().begin(), mesh().nodes().end(), keys[n], before);
    if (found == mesh().nodes().end() || *found != keys[n]) continue;
    const auto of_part = static_cast<std::int32_t>(found - mesh().nodes().begin());
    nodes.push_back({static_cast<std::int32_t>(n), of_part,
                     nodes_->owns(nodes_->numbers()[static_cast<std::size_t>(of_part)])});
  }
  held_in_part_ = std::make_unique<PartConstraints>(all_, constraints, constraints_->mesh().cell_nodes(), keys.size(),
                                                    std::move(own), std::move(nodes));
}

void SharedLevel::make_hierarchy(SharedMerges merges) {
  const hexmesh::Level& level = part_->levels[static_cast<std::size_t>(level_)];
  Mesh part(level.cells, part_->cell_edges(level_), part_->corner());
  nodes_ = std::make_unique<SharedNodes>(all_, *layers_, shifted(part.nodes(), low_));
  const std::size_t dofs = coarsest_dofs(outline_, scene_);
  if (3 * static_cast<std::size_t>(nodes_->num_all()) <= dofs) merges.factors = {{1, 1, 1}};
  if (all_.count() == 1)
    hierarchy_ = std::make_unique<Hierarchy>(std::move(part), part_->corner(), dofs);
  else
    hierarchy_ = std::make_unique<Hierarchy>(
        make_part_hierarchy(all_, std::move(part), low_, part_->corner(), outline_.corner(), merges, dofs));
  hierarchy_->in_double = is_of_high_contrast(outline_);
}

void SharedLevel::set_progress(const Progress& progress) {
  constraints_->prescribe(scene_, progress);
  load_factor_ = progress.fraction;
}

double SharedLevel::strain_energy(Vec u) const {
  copies_.get(u, x_);
  return all_.sum(elastic_->energy(x_));
}

double SharedLevel::energy(Vec u) const {
  double sum = strain_energy(u);
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
  std::vector<std::pair<PetscInt, std::vector<CoarseNode>>> own;
  std::vector<Index3> needed;
  const std::vector<Index3> keys = shifted(mesh().nodes(), low_);
  for (std::size_t n = 0; n < keys.size(); ++n)
    if (const PetscInt number = nodes_->numbers()[n]; nodes_->owns(number)) {
      own.emplace_back(number - nodes_->first_own(), coarse_nodes_of(keys[n], merge));
      for (const CoarseNode& c : own.back().second) needed.push_back(c.key);
    }
  std::sort(needed.begin(), needed.end(), before);
  needed.erase(std::unique(needed.begin(), needed.end()), needed.end());
  NodeVector values;
  NodeCopies(from, coarser.nodes().find(needed)).get(from, values);
  PetscScalar* out = nullptr;
  check(VecGetArray(to, &out));
  for (const auto& [number, parents] : own) {
    Vec3 sum = Vec3::Zero();
    for (const CoarseNode& c : parents)
      sum += c.weight *
             values.segment<3>(3 * (std::lower_bound(needed.begin(), needed.end(), c.key, before) - needed.begin()));
    Vec3::Map(out + 3 * number) = sum;
  }
  check(VecRestoreArray(to, &out));
}

ElasticCells::Size SharedLevel::size_in_material(Vec field) const {
  copies_.get(field, x_);
  ElasticCells::Size size;
  double volume = 0;
  for (std::size_t c = 0; c < mesh().num_cells(); ++c) volume += elastic_->model(c).volume;
  if (mesh().num_cells() > 0) size = elastic_->size_in_material(x_);
  return {all_.sum(volume * size.mean) / all_.sum(volume), all_.largest(size.largest)};
}

std::vector<ForceReport> SharedLevel::forces() const {
  std::vector<ForceReport> out;
  for (std::size_t n = 0; n < loads_.size(); ++n) {
    ForceReport force{n < scene_.forces.size() ? scene_.forces[n].name : "gravity", {}};
    for (PetscInt d = 0; d < 3; ++d) check(VecStrideSum(loads_[n], d, &force.total_n[d]));
    force.total_n *= load_factor_;
    out.push_back(std::move(force));
  }
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
  const hexmesh::Level& cells = piece_->lattice.levels[static_cast<std::size_t>(level_)];
  return {mesh().num_cells(),
          static_cast<std::size_t>(nodes_->num_own()),
          mesh().num_nodes() - static_cast<std::size_t>(nodes_->num_own()),
          cells.cells.size(),
          piece_->lattice.labels.size(),
          constraints_->mesh().num_nodes()};
}

/// How the surface points of one share of the file move: with the cell that holds them, or else the nearest.
std::vector<Vec3> SharedLevel::surface_displacement(const NodeVector& u, std::size_t& first) const {
  const auto rank = static_cast<std::size_t>(all_.rank()), count = static_cast<std::size_t>(all_.count());
  std::vector<Vec3> points;
  all_.all_or_none([&] {
    const std::size_t num_points = file_.num_surface_points();
    first = num_points * rank / count;
    points = file_.surface_points(first, num_points * (rank + 1) / count - first);
  });
  struct Point {
    std::size_t number;  ///< among those of the process that read it
    std::array<double, 3> position;
  };
  struct Moved {
    std::size_t number;
    double distance;  ///< of the cell from the point [mm]
    std::array<double, 3> by;
  };
  const Lattice& piece = piece_->lattice;
  const hexmesh::Level& cells = piece.levels[static_cast<std::size_t>(level_)];
  const Vec3 size = piece.cell_size(level_);
  const hexmesh::CellLocator locator(piece.voxels, cells.voxels_per_cell, cells.cells);
  const auto move = [&](const Point& p) -> Moved {
    const hexmesh::Embedding e = locator.locate_position(Vec3::Map(p.position.data()));
    if (e.cell < 0) return {p.number, std::numeric_limits<double>::infinity(), {}};
    const Vec3 by = piece_mesh_->interpolate(e.cell, hexmesh::shape_functions(e.local), u);
    const Vec3 outside = (-e.local).cwiseMax(e.local - Vec3::Ones()).cwiseMax(0).cwiseProduct(size);
    return {p.number, outside.norm(), {by[0], by[1], by[2]}};
  };

  // To the process whose layers they lie in.
  std::vector<std::vector<Point>> to(count);
  for (std::size_t p = 0; p < points.size(); ++p) {
    const double layer = (outline_.voxels.continuous_index(points[p])[2] + 0.5) / cells.voxels_per_cell[2];
    const auto process = static_cast<std::size_t>(
        layers_->process_of(static_cast<std::int32_t>(std::clamp(layer, 0.0, 1.0 * layers_->end(all_.count() - 1)))));
    to[process].push_back({p, {points[p][0], points[p][1], points[p][2]}});
  }
  std::vector<std::vector<Moved>> answers;
  for (const std::vector<Point>& asked : all_.exchange(to)) {
    answers.emplace_back();
    for (const Point& p : asked) answers.back().push_back(move(p));
  }
  std::vector<Vec3> out(points.size(), Vec3::Zero());
  std::vector<Point> strays;  // other processes may have a nearer cell
  for (const std::vector<Moved>& from : all_.exchange(answers))
    for (const Moved& m : from) {
      out[m.number] = Vec3::Map(m.by.data());
      if (m.distance > margin * size[2])
        strays.push_back({m.number, {points[m.number][0], points[m.number][1], points[m.number][2]}});
    }
  const std::size_t own_strays = all_.sum_before(strays.size());
  std::vector<Moved> candidates;
  const std::vector<Point> everybodys = all_.gather(strays);
  for (std::size_t n = 0; n < everybodys.size(); ++n) {
    candidates.push_back(move(everybodys[n]));
    candidates.back().number = n;
  }
  std::erase_if(candidates, [](const Moved& m) { return !std::isfinite(m.distance); });
  std::vector<double> nearest(strays.size(), std::numeric_limits<double>::infinity());
  for (const Moved& m : all_.gather(candidates)) {
    if (m.number < own_strays || m.number >= own_strays + strays.size()) continue;
    const std::size_t n = m.number - own_strays;
    if (m.distance >= nearest[n]) continue;
    nearest[n] = m.distance;
    out[strays[n].number] = Vec3::Map(m.by.data());
  }
  return out;
}

namespace {

template <class T>
void keep(std::vector<T>& values, std::size_t first, std::size_t count) {
  const auto begin = values.begin() + static_cast<std::ptrdiff_t>(first);
  values = std::vector<T>(begin, begin + static_cast<std::ptrdiff_t>(count));
}

}  // namespace

hexmesh::ResultRows SharedLevel::result_rows(Vec u, SolveReport& report) const {
  // Measures of the cells that this process writes, with those around them.
  const Lattice& piece = piece_->lattice;
  const std::vector<Index3>& nodes = piece_mesh_->nodes();
  NodeVector v;
  NodeCopies(u, nodes_->find(shifted(nodes, {0, 0, piece_->low}))).get(u, v);
  const auto cells = make_elastic_cells(*piece_mesh_, piece, level_,
                                        {elasticity_, scene_.rotation, scene_.volumetric, scene_.stiffness, {}, false});
  const Share share(all_, *piece_, outline_.levels[static_cast<std::size_t>(level_)].voxels_per_cell[2]);
  CellMeasures measures = measure_cells(*cells, v, [&](const Index3& node) { return share.has_node(node); });
  const double checkers = static_cast<double>(measures.checkerboard_nodes);
  report.pressure_checkerboard =
      std::sqrt(all_.sum(checkers * measures.pressure_checkerboard * measures.pressure_checkerboard) /
                std::max(1.0, all_.sum(checkers)));
  hexmesh::ResultRows rows{state_of_cells(piece, level_, *cells, v, std::move(measures))};
  hexmesh::Result& r = rows.part;
  const std::size_t first = piece_->first_cell, count = piece_->num_own_cells;
  CellChanges changes = count_changes(r, first, count);
  changes = {all_.sum(changes.cells), all_.sum(changes.strained), all_.sum(changes.turned), all_.sum(changes.inverted),
             all_.least(changes.least_jacobian)};
  report_changes(changes, report);

  std::size_t first_node = 0, num_nodes = 0;
  for (const Index3& node : nodes) {
    first_node += !share.has_node(node) && num_nodes == 0;
    num_nodes += share.has_node(node);
  }
  rows.first_cell = piece_->first_row;
  rows.first_node = all_.sum_before(num_nodes);
  // The nodes of the whole come in the same order as those here.
  for (hexmesh::CellNodes& of_cell : r.cell_nodes)
    for (std::int32_t& n : of_cell)
      n += static_cast<std::int32_t>(rows.first_node) - static_cast<std::int32_t>(first_node);
  r.cells = shifted(std::move(r.cells), {0, 0, piece_->low});
  keep(r.cells, first, count);
  keep(r.cell_nodes, first, count);
  keep(r.segment, first, count);
  for (auto& [name, values] : r.cell_fields) keep(values, first, count);
  keep(r.nodes, first_node, num_nodes);
  keep(r.displacement, first_node, num_nodes);
  r.surface_displacement = surface_displacement(v, rows.first_point);
  return rows;
}

}  // namespace hexsolver::mpi
