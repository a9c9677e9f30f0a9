// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

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
    ConstraintPoint to{
        p.condition, place_of(keys_.cells, p.cell), NodeWeights::Map(p.weights.data()), {}, p.axes, p.area,
        p.is_quarter};
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

}  // namespace hexsolver::mpi
