// SPDX-License-Identifier: Apache-2.0
#include "measurements.h"

#include "hexbench/experiments.h"

namespace hextools::paper {

Outcome solve(const hexmesh::Lattice& lattice, const hexsolver::Scene& scene, int level) {
  Method method{scene.stiffness == hexsolver::Stiffness::uniform ? Method::Kind::uniform_cells : Method::Kind::cells,
                scene.elasticity};
  method.level = level;
  return run(method, {lattice, scene});
}

Experiment liver_experiment(double poisson) {
  constexpr double radius = 12;  // with 10 Green-Lagrange tetrahedra of some sizes have no solution
  Experiment e{liver_of_phantom(2, poisson), {}};
  e.scene.conditions = phantom_patches(radius);
  return e;
}

hexmesh::LabelVolume cylinder_phantom() {
  return solid("cylinder", 2.5, {{"radius", cylinder_radius}, {"height", 2 * cylinder_radius}});
}

std::vector<hexsolver::Condition> pressed(double compression) {
  return pressed_ends(cylinder_radius, compression * 2 * cylinder_radius, hexsolver::SurfacePoints::faces);
}

}  // namespace hextools::paper
