// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "solver/terms/large_deformation.h"
#include "terms/contact.h"
#include "terms/dead_load.h"
#include "terms/ground_springs.h"
#include "terms/inertia.h"
#include "terms/stiffness_damping.h"

namespace test_potential {

using namespace hexsolver;
using namespace testing_support;

TEST(Potential, InSinglePrecisionEachTermIsOffByItsRounding) {
  const Lattice lattice = bitten_ball({1, 1, 1});
  const Body body(lattice, 1, Elasticity::corotational);
  const std::vector<std::int32_t>& element = lattice.levels[1].element;
  const NodeVector u = large_deformation(body.mesh, 0.05), direction = noise(body.mesh.num_dofs(), 1, 33);
  const auto expect_of = [&](std::unique_ptr<Term> term) {
    Potential potential(body.mesh);
    potential.add(std::move(term));
    potential.linearize(u, Hessian::exact);
    EXPECT_LT(error_of_single_precision(potential, direction), 1e-6);
    NodeVector product, before, after, magnitude;  // of energies that are quadratic
    potential.apply(direction, product);
    potential.gradient(u, before, magnitude);
    potential.gradient(u + direction, after, magnitude);
    EXPECT_LT((after - before - product).norm(), 1e-11 * magnitude.norm());
  };
  auto inertia = std::make_unique<Inertia>(body.mesh, element, lumped_masses({lattice, 1}), 0.5);
  inertia->set_step(u, direction, 0.01);
  expect_of(std::move(inertia));
  auto viscosity = std::make_unique<StiffnessDamping>(*body.elastic, 0.1);
  viscosity->set_step(u, 0.01, u);
  expect_of(std::move(viscosity));
  expect_of(std::make_unique<GroundSprings>(EffectKind::islands, body.mesh,
                                            std::vector<std::pair<std::int32_t, double>>{{2, 3.0}, {5, 1.0}}));
}

TEST(Potential, IsTheSumOfItsTermsAndOfTheFractionOfTheLoads) {
  const Lattice lattice = bitten_ball({1, 1, 1});
  Body body(lattice, 1, Elasticity::corotational), alone(lattice, 1, Elasticity::corotational);
  const NodeVector u = large_deformation(body.mesh, 0.05), direction = noise(body.mesh.num_dofs(), 1, 33);
  auto load = std::make_unique<DeadLoad>(EffectKind::force, "load",
                                         std::vector<DeadLoad::NodeForce>{{3, {0.1, -0.2, 0.3}}, {7, {1, 2, -3}}});
  load->set_factor({0.25, 0.25, 0.25});
  body.potential.add(std::move(load));
  NodeVector g, without, magnitude;
  body.potential.gradient(u, g, magnitude);
  alone.potential.gradient(u, without, magnitude);
  NodeVector expected = without;
  expected.segment<3>(9) -= 0.25 * Vec3(0.1, -0.2, 0.3);
  expected.segment<3>(21) -= 0.25 * Vec3(1, 2, -3);
  EXPECT_LT((g - expected).norm(), 1e-12 * magnitude.norm());
  constexpr double h = 1e-5;
  const double measured =
      (body.potential.energy(u + h * direction) - body.potential.energy(u - h * direction)) / (2 * h);
  EXPECT_NEAR(g.dot(direction), measured, 1e-6 * g.norm() * direction.norm());
}

}  // namespace test_potential
