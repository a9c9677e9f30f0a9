// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "constraints/patch_springs.h"
#include "constraints/select_points.h"
#include "distributed/shared_level.h"

namespace hexsolver::mpi {
SharedConstraints::SharedConstraints(const std::vector<Point>& points, const Scene& scene, const Mat3& edges,
                                     const Vec3& corner, const SharedNodes& nodes, Vec field) {
  for (const Point& p : points) keys_.cells.push_back(p.cell);
  make_distinct(keys_.cells);
  keys_.corners.resize(keys_.cells.size());
  for (const Point& p : points) keys_.corners[static_cast<std::size_t>(place_of(keys_.cells, p.cell))] = p.corners;
  mesh_ = std::make_unique<Mesh>(keys_.make_mesh({0, 0, 0}, edges, corner));
  std::vector<ConstraintPoint> local;
  for (const Point& p : points) {
    ConstraintPoint to{p.condition,
                       place_of(keys_.cells, p.cell),
                       NodeWeights::Map(p.weights.data()),
                       {},
                       p.axes,
                       p.area,
                       p.is_quarter,
                       p.is_soft,
                       p.num_alike};
    to.value = prescribed_displacement(scene, *mesh_, to, {});
    local.push_back(to);
  }
  constraints_ = std::make_unique<Constraints>(*mesh_, std::move(local));

  const std::vector<PetscInt> numbers = nodes.find(keys_.nodes);
  copies_ = NodeCopies(field, numbers);
  for (std::size_t n = 0; n < numbers.size(); ++n)
    if (nodes.owns(numbers[n])) own_.emplace_back(static_cast<Eigen::Index>(n), numbers[n] - nodes.first_own());
  owners_copies_ = NodeCopies(field, own_.empty() ? std::vector<PetscInt>() : numbers);
}

void SharedConstraints::prescribe(const Scene& scene, const Progress& progress) {
  std::vector<Vec3> values;
  for (const ConstraintPoint& p : constraints_->points())
    values.push_back(prescribed_displacement(scene, *mesh_, p, progress));
  constraints_->prescribe(values);
}

void SharedConstraints::set_springs(const std::vector<double>& stiffness) {
  constraints_->set_springs([&, first = constraints_->held().data()](const ConstraintPoint& p) {
    return stiffness[static_cast<std::size_t>(&p - first)];
  });
}

NodeVector SharedConstraints::values_of(Vec field) const {
  NodeVector values;
  copies_.get(field, values);
  return values;
}

void SharedConstraints::put(const NodeVector& values, Vec field) const {
  PetscScalar* to = nullptr;
  check(VecGetArray(field, &to));
  for (const auto& [from, own] : own_)
    for (Eigen::Index d = 0; d < 3; ++d) to[3 * own + d] = values[3 * from + d];
  check(VecRestoreArray(field, &to));
}

void SharedConstraints::project(Vec v) const {
  NodeVector values;
  owners_copies_.get(v, values);
  if (!own_.empty()) constraints_->project(values);
  put(values, v);  // by all: PETSc keeps norms of vectors that a process says it has not touched, and others then wait
}

/// Each process has the springs in its cells; what all hold has all of them, for reactions.
void SharedLevel::find_springs() {
  if (!constraints_->local().are_soft()) return;
  const std::vector<ConstraintPoint>& held = constraints_->local().held();
  std::vector<double> stiffness(held.size());
  for (std::size_t n = 0; n < held.size(); ++n) {
    const std::int32_t cell = own_cell(constraints_->keys().cells[static_cast<std::size_t>(held[n].cell)]);
    if (cell < 0 || !held[n].is_soft || held[n].area == 0) continue;
    const auto c = static_cast<std::size_t>(cell);
    stiffness[n] =
        PatchSprings::stiffness(held[n], elastic_->model(c), mesh().edges(c), outline_.voxels.voxel_volume());
    sprung_.push_back(held[n]);
    sprung_.back().cell = cell;
    sprung_.back().spring = stiffness[n];
    number_of_sprung_.push_back(n);
  }
  all_.add_up(stiffness);
  constraints_->set_springs(stiffness);
  potential_->add(std::make_unique<PatchSprings>(mesh(), sprung_));
}

void SharedLevel::hold_in_part() {
  const Constraints& constraints = constraints_->local();
  const KeyedCells& held = constraints_->keys();
  std::vector<ConstraintPoint> own;
  for (const ConstraintPoint& p : constraints.held())
    if (const std::int32_t cell = own_cell(held.cells[static_cast<std::size_t>(p.cell)]); cell >= 0) {
      own.push_back(p);
      own.back().cell = cell;
    }
  std::vector<PartConstraints::Node> nodes;
  for (std::size_t n = 0; n < held.nodes.size(); ++n)
    if (const std::int32_t node = place_of(keys().nodes, held.nodes[n]); node >= 0)
      nodes.push_back({static_cast<std::int32_t>(n), node, nodes_->owns(nodes_->numbers()[node])});
  std::vector<std::int32_t> in_whole;
  if (hierarchy_->is_solved_at_once()) {
    const std::vector<Index3>& whole = hierarchy_->meshes.back().nodes();
    const bool has_whole = all_.count() == 1;  // as its part
    for (const Key& key : held.nodes)
      in_whole.push_back(
          has_whole ? place_of(keys().nodes, key)
                    : static_cast<std::int32_t>(
                          std::lower_bound(whole.begin(), whole.end(), key.index, hexmesh::i_fastest) - whole.begin()) +
                          key.number);
  }
  held_in_part_ =
      std::make_unique<PartConstraints>(all_, constraints, constraints_->mesh().cell_nodes(), held.nodes.size(),
                                        std::move(own), std::move(nodes), std::move(in_whole));
}

}  // namespace hexsolver::mpi
