// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>

#include "hexmesh/lattice/embedded_points.h"
#include "hexsolver/dynamics/motion.h"
#include "solver/terms/large_deformation.h"
#include "support/bodies.h"
#include "terms/grabs.h"

namespace test_grabs {

using namespace hexsolver;
using namespace testing_support;

/// A bar of 24 x 6 x 6 mm, E 10 kPa, held at x = 0; its surface has the corners of its end face and a point far away.
Lattice bar() {
  Lattice lattice = box({24, 6, 6}, {1, 1, 1}, 10, 0.3);
  lattice.surface.points = {{23.5, 2.5, 2.5},  {23.5, -0.5, -0.5}, {23.5, 5.5, -0.5},
                            {23.5, -0.5, 5.5}, {23.5, 5.5, 5.5},   {200, 0, 0}};
  return lattice;
}

Scene moving(double damping = 0) {
  Scene scene;
  scene.dynamics.emplace();
  scene.dynamics->step = 0.01;
  scene.dynamics->duration = 10;
  scene.damping.mass_per_s = damping;
  Condition c;
  c.name = "end";
  c.where = "test";
  c.selection.halfspace = HalfSpace{{-0.5, 0, 0}, {-1, 0, 0}};
  scene.conditions = {c};
  return scene;
}

Vec3 place(const Motion& motion, const Lattice& lattice, std::size_t point) {
  const hexmesh::EmbeddedPoints points(motion.locator(), motion.cell_nodes(), lattice.surface.points);
  std::vector<Vec3> moved;
  points.interpolate({motion.displacement().data(), static_cast<std::size_t>(motion.displacement().size())}, moved);
  return lattice.surface.points[point] + moved[point];
}

TEST(Grabs, TheirForcesAreTheSlopeOfTheirEnergyAndTheirWorkIsForceTimesWay) {
  const Lattice lattice = bar();
  const Body body(lattice, 1, Elasticity::corotational);
  const NodeVector u = large_deformation(body.mesh, 0.05), direction = noise(body.mesh.num_dofs(), 1, 33);
  Grabs grabs(body.mesh, 0.5);
  NodeWeights weights = NodeWeights::Constant(0.125);
  grabs.grasp(3, {{4, weights, Vec3::Zero()}, {2, weights, Vec3::Zero()}}, 7, NodeVector(0.5 * u));
  grabs.grasp(5, {{2, weights, Vec3::Zero()}}, 2, u);
  grabs.pull(3, {3, 0, 4});
  grabs.begin_step(1, 2);
  grabs.set_time(1.5);
  const auto gradient_at = [&](const NodeVector& at) {
    NodeVector g = NodeVector::Zero(u.size()), magnitude = g;
    grabs.add_gradient(at, g, magnitude);
    return g;
  };
  // Energies are quadratic: central differences are exact.
  EXPECT_NEAR(gradient_at(u).dot(direction), (grabs.energy(u + direction) - grabs.energy(u - direction)) / 2, 1e-10);
  NodeVector product = NodeVector::Zero(u.size());
  grabs.add_product(direction, product);
  EXPECT_LT((gradient_at(u + direction) - gradient_at(u) - product).norm(), 1e-12 * product.norm());
  NodeVector by_cells = NodeVector::Zero(u.size());
  for (std::size_t c = 0; c < body.mesh.num_cells(); ++c) {
    CellMatrix h = CellMatrix::Zero();
    grabs.add_cell_hessian(c, h);
    body.mesh.scatter_add(c, h * body.mesh.gather(c, direction), by_cells);
    EXPECT_EQ(grabs.shared_hessian(c) == Term::own_hessian, h.norm() > 0);
  }
  EXPECT_LT((by_cells - product).norm(), 1e-12 * product.norm());

  // The hand goes 0.5 mm of the 5 mm asked along (3, 0, 4); its work is what its way adds to the energy.
  const double stored = grabs.energy(u), work = grabs.work_of_motion(u, 1.5 - 1e-4, 1.5 + 1e-4);
  grabs.set_time(1.5 + 1e-4);
  const double later = grabs.energy(u);
  grabs.set_time(1.5 - 1e-4);
  EXPECT_NEAR(work, later - grabs.energy(u), 1e-9 * stored);
  NodeVector shifted = u;
  grabs.set_time(2);
  const double at_end = grabs.energy(u);
  for (Eigen::Index n = 0; n < shifted.size(); n += 3) shifted.segment<3>(n) -= Vec3(0.3, 0, 0.4);
  grabs.let_go(5);
  const double alone = grabs.energy(u);
  Grabs still(body.mesh, 0.5);
  still.grasp(3, {{4, weights, Vec3::Zero()}, {2, weights, Vec3::Zero()}}, 7, NodeVector(0.5 * u));
  EXPECT_NEAR(alone, still.energy(shifted), 1e-12 * alone);
  EXPECT_NEAR(at_end, alone, 1e-12 * at_end);  // the other's points are where they were grasped
  grabs.let_go();
  EXPECT_EQ(grabs.energy(u), 0);
}

/// The end face pulled along the bar: no more than a rod's springs lets it lag, and back where it was once let go.
TEST(Grabs, APointFollowsTheHandAndTheBodyComesBack) {
  for (const bool is_graded : {false, true}) {
    SCOPED_TRACE(is_graded);
    const Lattice lattice = bar();
    Scene scene = moving(20);
    scene.grading = is_graded ? Grading::scene : Grading::off;
    Motion motion(lattice, scene, is_graded ? 0 : 1);
    ASSERT_TRUE(motion.step());
    EXPECT_FALSE(motion.grab(5, {0, 0, 0})) << "no cell moves this point";
    const Vec3 there = lattice.surface.points[0] + Vec3(4, 3, 0);
    ASSERT_TRUE(motion.grab(0, there, 5));
    for (int n = 0; n < 100; ++n) {
      ASSERT_TRUE(motion.step()) << motion.reason();
      if (n == 0) {  // a fiftieth of the diameter of some 26 mm
        EXPECT_LT((place(motion, lattice, 0) - lattice.surface.points[0]).norm(), 0.55);
      }
    }
    EXPECT_LT((place(motion, lattice, 0) - there).norm(), 0.02 * 5);
    // The corners hold on with it.
    EXPECT_LT((place(motion, lattice, 4) - lattice.surface.points[4] - Vec3(4, 3, 0)).norm(), 0.05 * 5);
    const Energies held = motion.energies();
    EXPECT_GT(held.strain, 0);
    EXPECT_LT(held.contact, 0.1 * held.strain);
    // What the body holds came from the hand.
    EXPECT_GT(motion.work() + motion.work_uncertainty(), held.total());
    motion.let_go();
    EXPECT_NEAR(motion.energies().contact, 0, 1e-15);
    for (int n = 0; n < 200; ++n) {
      const double before = motion.energies().total();
      ASSERT_TRUE(motion.step()) << motion.reason();
      EXPECT_LE(motion.energies().total(), before * (1 + 1e-9) + 1e-12) << "nothing gives it energy";
    }
    EXPECT_LT((place(motion, lattice, 0) - lattice.surface.points[0]).norm(), 1e-2);
    EXPECT_EQ(motion.counts().let_go, 0);
  }
}

/// A tip pulled away by several lengths of the body and let go. Cells that turn inside out meanwhile keep their
/// rotations over steps; without that no hand that lets go would help.
TEST(Grabs, APullThatTurnsCellsInsideOutIsFollowedAndNoEnergyComesOfIt) {
  // A half ellipsoid, thin where it is pulled: cells there are nearly empty.
  const Index3 extent = {40, 20, 20};
  Lattice lattice = one_material(
      extent, {1, 1, 1},
      [](const Index3& v) {
        return std::pow(v[0] / 38.0, 2) + std::pow((v[1] - 9.5) / 9, 2) + std::pow((v[2] - 9.5) / 9, 2) < 1;
      },
      5, 0.45);
  lattice.surface.points = {{37, 9.5, 9.5}};
  Scene scene = moving();
  scene.tolerance = 1e-3;
  for (const Vec3& way : {Vec3(300, 0, 0), Vec3(0, 80, -300)}) {
    Motion motion(lattice, scene, 2);
    ASSERT_TRUE(motion.grab(0, lattice.surface.points[0] + way));
    for (int n = 0; n < 120; ++n) {
      ASSERT_TRUE(motion.step()) << motion.reason();
      if (n == 60) motion.let_go();
      const double allowed = motion.work() + motion.work_uncertainty() + 1e-9;
      EXPECT_LE(motion.energies().total(), allowed) << n;
    }
    EXPECT_EQ(motion.counts().let_go, 0);
  }
}

/// Whatever is asked, the motion goes on: the hand moves at its own pace and in the end lets go.
TEST(Grabs, AskedForTheImpossibleTheyDoNotEndTheMotion) {
  const Lattice lattice = bar();
  for (const auto law : {Elasticity::corotational, Elasticity::neo_hookean, Elasticity::cauchy}) {
    Scene scene = moving();
    scene.elasticity = law;
    Motion motion(lattice, scene, 1);
    ASSERT_TRUE(motion.grab(0, {-1000, 500, 0}));
    ASSERT_TRUE(motion.grab(1, {1000, -500, 0}));
    for (int n = 0; n < 60; ++n) {
      ASSERT_TRUE(motion.step()) << motion.reason();
      EXPECT_TRUE(motion.displacement().allFinite());
    }
  }
}

}  // namespace test_grabs
