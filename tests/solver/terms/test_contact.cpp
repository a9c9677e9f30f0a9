// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "hexsolver/equilibrium/equilibrium.h"
#include "solver/terms/derivatives.h"
#include "support/bodies.h"
#include "support/solve.h"
#include "terms/contact.h"

namespace test_contact {

using namespace hexsolver;
using namespace testing_support;

Contact plane(const Vec3& point, const Vec3& normal, double stiffness) {
  return {"plane", "test", HalfSpace{point, normal}, Vec3::Zero(), stiffness};
}

Contact ball(const Vec3& center, double radius, double stiffness) {
  return {"ball", "test", Ball{center, radius}, Vec3::Zero(), stiffness};
}

/// Obstacles that cut into the bitten ball, one that moves.
std::vector<Contact> obstacles(const Mesh& mesh) {
  Vec3 middle = Vec3::Zero();
  for (std::size_t n = 0; n < mesh.num_nodes(); ++n) middle += mesh.position(n) / static_cast<double>(mesh.num_nodes());
  std::vector<Contact> out = {plane(middle, Vec3(0.2, -0.1, 1).normalized(), 0.3),
                              ball(middle + Vec3(6, -3, 5), 8, 0.7)};
  out[1].by = {-3, 1, 2};
  const auto with = [&](const hexmesh::Solid& solid) { out.push_back({"solid", "test", solid, Vec3::Zero(), 0.4}); };
  with(hexmesh::Capsule{middle - Vec3(8, 2, 1), middle + Vec3(5, 1, 8), 3});
  with(hexmesh::Cylinder{middle - Vec3(8, 2, 1), middle + Vec3(9, 1, 8), 4});
  with(hexmesh::Block{middle + Vec3(5, 2, 4), random_rotation(3), Vec3(7, 5, 6)});
  out[4].turn = Turn{Vec3(1, 2, 3).normalized(), 0.8, middle};
  for (const std::size_t n : {1, 4}) {  // again with friction
    Contact rough = out[n];
    rough.friction = 0.4;
    out.push_back(rough);
  }
  return out;
}

class Obstacles : public testing::TestWithParam<std::size_t> {
protected:
  const Lattice lattice = bitten_ball({1, 1, 2.5}, {0, 1, 0});
  Mesh mesh{lattice.levels[1].cells, lattice.cell_edges(1), lattice.corner()};
  Potential potential{mesh};
  PenaltyContact* contact = nullptr;
  const NodeVector u = noise(mesh.num_dofs(), 0.3, 4), direction = noise(mesh.num_dofs(), 1, 5);

  Obstacles() {
    Selector selector({lattice, 1}, mesh);
    auto term = std::make_unique<PenaltyContact>(obstacles(mesh)[GetParam()], MeshCells(lattice, 1), mesh,
                                                 selector.whole_surface());
    contact = term.get();
    potential.add(std::move(term));
    contact->set_progress({0.4});
    if (contact->has_friction()) {
      contact->attach(noise(mesh.num_dofs(), 0.3, 4));
      contact->keep(noise(mesh.num_dofs(), 0.3, 4));
    }
    contact->set_progress({0.5});
    contact->attach(noise(mesh.num_dofs(), 0.3, 7));
  }
};

TEST_P(Obstacles, ForcesAndHessianAreDerivativesOfTheEnergy) {
  ASSERT_GT(contact->state(u).points, 20U);
  const double measured = measured_slope(potential, u, direction);
  EXPECT_NEAR(gradient_of(potential, u).dot(direction), measured,
              1e-7 * gradient_of(potential, u).norm() * direction.norm());
  potential.linearize(u, Hessian::exact);
  NodeVector claimed, added = NodeVector::Zero(direction.size());
  potential.apply(direction, claimed);
  const NodeVector difference = measured_product(potential, u, direction);
  EXPECT_LT((claimed - difference).norm(), 1e-5 * claimed.norm());
  for (std::size_t c = 0; c < mesh.num_cells(); ++c)
    mesh.scatter_add(c, potential.cell_hessian(c) * mesh.gather(c, direction), added);
  EXPECT_LT((claimed - added).norm(), 1e-12 * claimed.norm());
  EXPECT_LT(error_of_single_precision(potential, direction), 1e-6);
  potential.linearize(u, Hessian::projected);
  potential.apply(direction, claimed);
  EXPECT_GT(claimed.dot(direction), 0);
}

TEST_P(Obstacles, TheForceOnTheBodyIsThatOfItsReport) {
  const NodeVector g = gradient_of(potential, u);
  Vec3 sum = Vec3::Zero();
  for (std::size_t n = 0; n < mesh.num_nodes(); ++n) sum -= g.segment<3>(3 * static_cast<Eigen::Index>(n));
  EXPECT_LT((sum - contact->state(u).force).norm(), 1e-12 * sum.norm());
}

/// Springs are drawn in the step before, and slip no more than friction lets them: what is stored is less by that.
TEST_P(Obstacles, SlipsTakeWhatIsNotStored) {
  if (!contact->has_friction()) return;
  contact->attach(u);
  const double before = contact->energy(u), stored = contact->stored_energy(u);
  EXPECT_LT(stored, before);
  const double slipped = contact->keep(u);
  EXPECT_NEAR(before - stored, slipped, 1e-12 * before);
  EXPECT_NEAR(contact->energy(u), stored, 1e-12 * stored);
  EXPECT_GT(contact->state(u).slipping, 10U);
}

INSTANTIATE_TEST_SUITE_P(OfEveryShape, Obstacles, testing::Range(std::size_t{0}, std::size_t{7}));

constexpr double young = 0.1, stiffness = 0.02, press = 1.5;
const Vec3 size(5, 6, 22);

/// A bar along z from z = -1 on, without lateral contraction, held below; an obstacle comes down on its top.
Scene pressed_bar(Contact obstacle, Elasticity elasticity) {
  Scene scene;
  scene.elasticity = elasticity;
  scene.tolerance = 1e-11;
  Condition bottom;
  bottom.name = "bottom";
  bottom.selection.halfspace = HalfSpace{{0, 0, -1}, {0, 0, -1}};
  bottom.selection.on = SurfacePoints::nodes;
  scene.conditions = {bottom};
  obstacle.by = {0, 0, -press};
  obstacle.stiffness = stiffness;
  scene.contacts = {obstacle};
  return scene;
}

TEST(Contact, ABarPressedByAPlaneIsTwoSpringsInARow) {
  const Lattice lattice = box({5, 6, 11}, {1, 1, 2}, young * 1e3, 0);
  const double bar = young * size[0] * size[1] / size[2], penalty = 30 * stiffness;  // 30 faces on top
  const double force = press / (1 / bar + 1 / penalty);
  for (int level = 0; level < 3; ++level) {
    SolveReport report;
    const hexmesh::Result result =
        solve_equilibrium(lattice, pressed_bar(plane({0, 0, 21}, {0, 0, -1}, 0), Elasticity::cauchy), level, report);
    ASSERT_TRUE(report.converged) << report.reason;
    double largest = 0;  // of cells that have no other side exposed
    for (const double pressure : result.cell_fields.at("contact_pressure")) largest = std::max(largest, pressure);
    if (level == 0) {
      EXPECT_NEAR(largest, force / 30, 1e-7 * force);
    }
    const std::vector<double>& gaps = result.cell_fields.at("contact_gap");
    EXPECT_NEAR(*std::min_element(gaps.begin(), gaps.end()), -force / penalty, 1e-7);
    EXPECT_LE(*std::max_element(gaps.begin(), gaps.end()), 12 * 2.0);  // as far as it is told
    EXPECT_EQ(report.contacts[0].points, 30U);
    EXPECT_NEAR(report.contacts[0].deepest_mm, force / penalty, 1e-7);
    EXPECT_LT((report.contacts[0].force_n - Vec3(0, 0, -force)).norm(), 1e-7 * force);
    EXPECT_LT((report.conditions[0].reaction_n - Vec3(0, 0, force)).norm(), 1e-7 * force);
  }
}

/// Twelve steps of voxels down a slope of 45 degrees, four voxels wide, wherever the body is turned.
TEST(Contact, TheAreaThatTouchesIsOfTheSlopeAndNotOfItsSteps) {
  const Lattice lattice = one_material({12, 4, 12}, Vec3::Ones(), [](const Index3& v) { return v[0] + v[2] < 12; });
  for (std::size_t level = 0; level < 3; ++level)
    for (const double radians : {0.0, 1.2}) {
      const Mesh mesh{lattice.levels[level].cells, lattice.cell_edges(static_cast<int>(level)), lattice.corner()};
      const Mat3 turn = Eigen::AngleAxisd(radians, Vec3(1, 2, 2).normalized()).toRotationMatrix();
      const MeshCells cells(lattice, static_cast<int>(level));
      Selector selector(cells, mesh);
      const PenaltyContact contact(plane(turn * Vec3(11.4, 0, 0), turn * Vec3(-1, 0, -1).normalized(), 1), cells, mesh,
                                   selector.whole_surface());
      NodeVector u(mesh.num_dofs());
      for (std::size_t n = 0; n < mesh.num_nodes(); ++n)
        u.segment<3>(3 * static_cast<Eigen::Index>(n)) = turn * mesh.position(n) - mesh.position(n);
      double area = 0;
      for (const TouchPoint& p : contact.touch_points(u)) area += p.area;
      EXPECT_NEAR(area, 12 * 4 * std::sqrt(2.0), 1e-9) << "level " << level << ", turned by " << radians;
    }
}

/// What points press with at a depth where they learnt from it, k d, with springs four times stiffer: 5 k d.
TEST(Contact, StifferSpringsOfHardPointsHaveAnEnergyToo) {
  const Lattice lattice = bitten_ball({1, 1, 2.5}, {0, 1, 0});
  const Mesh mesh{lattice.levels[1].cells, lattice.cell_edges(1), lattice.corner()};
  Potential potential{mesh};
  Selector selector({lattice, 1}, mesh);
  Contact plane = obstacles(mesh).front();
  plane.stiffness = plane.friction = 0;
  auto term =
      std::make_unique<PenaltyContact>(plane, MeshCells(lattice, 1), mesh, selector.whole_surface(), /*is_hard=*/true);
  PenaltyContact& contact = *term;
  potential.add(std::move(term));
  const NodeVector u = noise(mesh.num_dofs(), 0.3, 4), direction = noise(mesh.num_dofs(), 1, 5);
  contact.set_progress({0.5});
  contact.attach(u);
  ASSERT_GT(contact.state(u).points, 20U);
  const Vec3 soft = contact.state(u).force;
  contact.attach(u, 1, 4);
  EXPECT_LT((contact.state(u).force - 5 * soft).norm(), 1e-12 * soft.norm());
  const NodeVector gradient = gradient_of(potential, u);
  EXPECT_NEAR(gradient.dot(direction), measured_slope(potential, u, direction),
              1e-7 * gradient.norm() * direction.norm());
  potential.linearize(u, Hessian::exact);
  NodeVector product;
  potential.apply(direction, product);
  EXPECT_LT((product - measured_product(potential, u, direction)).norm(), 1e-5 * product.norm());
  contact.set_progress({0.5});
  EXPECT_LT((contact.state(u).force - soft).norm(), 1e-12 * soft.norm());
}

/// Where no stiffness is named, the bar is pressed by all of the way.
TEST(Contact, AHardPlaneIsNotEntered) {
  const Lattice lattice = box({5, 6, 11}, {1, 1, 2}, young * 1e3, 0);
  const double force = press * young * size[0] * size[1] / size[2];
  for (int level = 0; level < 3; ++level) {
    Scene scene = pressed_bar(plane({0, 0, 21}, {0, 0, -1}, 0), Elasticity::cauchy);
    scene.contacts[0].stiffness = 0;
    SolveReport report;
    solve_equilibrium(lattice, scene, level, report);
    ASSERT_TRUE(report.converged) << report.reason;
    EXPECT_EQ(report.contacts[0].points, 30U);
    EXPECT_LT(report.contacts[0].deepest_mm, 1e-4 * press);
    EXPECT_LT((report.contacts[0].force_n - Vec3(0, 0, -force)).norm(), 1e-4 * force);
    EXPECT_LT((report.conditions[0].reaction_n + report.contacts[0].force_n).norm(), 1e-7 * force);
  }
}

TEST(Contact, AHugeBallIsAPlaneAndASmallOneDentsLess) {
  const Lattice lattice = box({5, 6, 11}, {1, 1, 2}, young * 1e3, 0.3);
  const auto force = [&](const Contact& c) {
    SolveReport report;
    solve_equilibrium(lattice, pressed_bar(c, Elasticity::cauchy), 0, report);
    EXPECT_TRUE(report.converged) << report.reason;
    return report.contacts[0].force_n[2];
  };
  const double by_plane = force(plane({0, 0, 21}, {0, 0, -1}, 0));
  EXPECT_NEAR(force(ball({2, 2.5, 21 + 1e4}, 1e4, 0)), by_plane, 1e-3 * std::abs(by_plane));
  const double by_ball = force(ball({2, 2.5, 23}, 2, 0));
  EXPECT_LT(by_ball, -0.01 * std::abs(by_plane));
  EXPECT_GT(by_ball, 0.7 * by_plane);
}

TEST(Contact, ABallPressesTheWayItMovesHoweverFar) {
  const Lattice lattice = box({9, 9, 9}, {1, 1, 1}, young * 1e3, 0.3);
  double before = 0;
  for (const double by : {1.0, 2.0, 3.0}) {
    Scene scene = pressed_bar(ball({4, 4, 10.5}, 2, 0), Elasticity::corotational);
    scene.conditions[0].selection.halfspace = HalfSpace{{0, 0, -0.5}, {0, 0, -1}};
    scene.contacts[0].by = {0, 0, -by};
    scene.contacts[0].stiffness = 1;
    SolveReport report;
    solve_equilibrium(lattice, scene, 0, report);
    ASSERT_TRUE(report.converged) << report.reason;
    EXPECT_LT(report.contacts[0].force_n[2], before) << by;
    before = report.contacts[0].force_n[2];
  }
}

TEST(Contact, ABallThatWentThroughTheSurfaceIsNoSolution) {
  const Lattice lattice = box({9, 9, 9}, {1, 1, 1}, young * 1e3, 0.3);
  Scene scene = pressed_bar(ball({4, 4, 11.5}, 2, 0), Elasticity::corotational);
  scene.conditions[0].selection.halfspace = HalfSpace{{0, 0, -0.5}, {0, 0, -1}};
  scene.contacts[0].by = {0, 0, -6};
  scene.contacts[0].stiffness = 1e-6;  // hardly any
  SolveReport report;
  solve_equilibrium(lattice, scene, 0, report);
  EXPECT_FALSE(report.converged);
  EXPECT_NE(report.reason.find("went through the surface"), std::string::npos) << report.reason;
}

TEST(Contact, AnObstacleThatIsNotReachedChangesNothing) {
  const Lattice lattice = box({5, 6, 11}, {1, 1, 2}, young * 1e3, 0.3);
  Scene scene = pressed_bar(ball({2, 2.5, 200}, 2, 0), Elasticity::cauchy);
  scene.gravity = {100, 0, -9810};
  SolveReport with, without;
  const hexmesh::Result a = solve_equilibrium(lattice, scene, 0, with);
  scene.contacts.clear();
  const hexmesh::Result b = solve_equilibrium(lattice, scene, 0, without);
  EXPECT_EQ(with.contacts[0].points, 0U);
  for (std::size_t n = 0; n < a.displacement.size(); ++n)
    EXPECT_LT((a.displacement[n] - b.displacement[n]).norm(), 1e-8);
}

}  // namespace test_contact
