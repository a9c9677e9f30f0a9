// SPDX-License-Identifier: Apache-2.0
#include "terms/dead_load.h"

namespace hexsolver {

using Eigen::Index;

double DeadLoad::energy(const NodeVector& u) const {
  double work = 0;
  for (const NodeForce& f : forces_) work += factor_.cwiseProduct(f.force).dot(u.segment<3>(3 * Index{f.node}));
  return -work;
}

void DeadLoad::add_gradient(const NodeVector& /*u*/, NodeVector& gradient, NodeVector& magnitude) const {
  for (const NodeForce& f : forces_) {
    const Vec3 force = factor_.cwiseProduct(f.force);
    gradient.segment<3>(3 * Index{f.node}) -= force;
    magnitude.segment<3>(3 * Index{f.node}) += force.cwiseAbs();
  }
}

Vec3 DeadLoad::total(const NodeVector& /*u*/) const {
  Vec3 sum = Vec3::Zero();
  for (const NodeForce& f : forces_) sum += f.force;
  return factor_.cwiseProduct(sum);
}

}  // namespace hexsolver
