// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>

#include "hexmesh/core/error.h"
#include "hexsolver/dynamics/motion.h"
#include "level/make_contacts.h"
#include "solver/level/contacts.h"
#include "solver/terms/derivatives.h"
#include "support/bodies.h"
#include "support/solve.h"
#include "terms/potential.h"

namespace test_self_contact {

using namespace hexsolver;
using namespace testing_support;

/// Two arms of `thick` voxels of 1 mm with a back between them: of four the arms are y from -0.5 to 3.5 and from 27.5
/// to 31.5 mm.
Lattice arch(int thick = 4) {
  return one_material(
      {26, 32, 4}, {2, 1, 2}, [thick](const Index3& v) { return v[1] < thick || v[1] >= 32 - thick || v[0] < 2; }, 10);
}

/// The lower arm turned up, its end by `rise` [mm].
NodeVector closing(const Mesh& mesh, double rise) {
  return sample(mesh, [rise](const Vec3& x) {
    const double of_arm = std::clamp((27 - x[1]) / 24, 0.0, 1.0);
    return Vec3(0.02 * x[1], rise * of_arm * x[0] / 51, 0.01 * x[0]);
  });
}

Contact itself() {
  Contact c;
  c.name = "itself";
  c.where = "test";
  c.self = "";
  return c;
}

TEST(BodyMap, FindsWhereElseAPointIs) {
  const Lattice lattice = arch();
  for (int number = 0; number < 3; ++number) {
    const MeshCells cells = cells_of(lattice, number);
    const Mesh mesh = cells.make_mesh();
    std::vector<bool> body(65536);
    body[1] = true;
    BodyMap map(cells, mesh, body);
    Selector selector(cells, mesh);
    for (const double rise : {0.0, 27.0}) {
      const NodeVector u = closing(mesh, rise);
      map.look_at(u);
      std::size_t elsewhere = 0;
      for (const SurfacePoint& p : selector.whole_surface()) {
        const Vec3 rest = mesh.rest_position(p.cell, p.weights), x = rest + mesh.interpolate(p.cell, p.weights, u);
        const BodyMap::Own own{p.cell, rest, true};
        const BodyMap::Place found = map.find(x, u, {}, &own, beyond_cell);
        if (found.cell < 0) continue;
        EXPECT_LT((found.rest + mesh.interpolate(found.cell, found.weights, u) - x).norm(), 1e-9);
        EXPECT_GT(std::abs(found.rest[1] - rest[1]), 15) << "in the other arm";
        ++elsewhere;
      }
      EXPECT_EQ(elsewhere > 0, rise > 0) << number;
    }
  }
}

/// On levels, with places looked for anew and held.
class SelfContact : public testing::TestWithParam<std::tuple<int, bool>> {
protected:
  const Lattice lattice = arch();
  const MeshCells cells = cells_of(lattice, std::get<0>(GetParam()));
  const Mesh mesh = cells.make_mesh();
  Potential potential{mesh};
  PenaltyContact* contact = nullptr;
  NodeVector u = closing(mesh, 27);

  SelfContact() {
    Contact c = itself();
    c.stiffness = 0.03;
    Selector selector(cells, mesh);
    auto term = make_segment_contact(c, SegmentShapes().of(c, 0, cells.lattice()), cells, mesh, selector, false);
    contact = term.get();
    if (std::get<1>(GetParam())) contact->hold_pairs();
    potential.add(std::move(term));
    contact->set_progress({1});
    contact->attach(u);
    potential.linearize(u, Hessian::exact);
  }
};

TEST_P(SelfContact, ForcesAreTheSlopeOfTheEnergyAndInBalance) {
  ASSERT_GT(contact->state(u).points, 5U);
  EXPECT_TRUE(contact->state(u).force.isZero(0));
  const NodeVector direction = noise(mesh.num_dofs(), 1, 5), g = gradient_of(potential, u);
  const double measured = measured_slope(potential, u, direction);
  EXPECT_NEAR(g.dot(direction), measured, 1e-6 * g.norm() * direction.norm());
  const SumOfForces sum(mesh, u, g);
  EXPECT_LT(sum.force.norm(), 1e-13 * sum.size);
  EXPECT_LT(sum.moment.norm(), 1e-11 * sum.size * 50);
}

TEST_P(SelfContact, TheHessianIsTheSlopeOfTheForces) {
  const NodeVector x = noise(mesh.num_dofs(), 1, 9);
  NodeVector product;
  potential.apply(x, product);
  const NodeVector difference = measured_product(potential, u, x);
  EXPECT_LT((product - difference).norm(), 1e-5 * product.norm());
}

INSTANTIATE_TEST_SUITE_P(OnLevels, SelfContact, testing::Combine(testing::Values(0, 1, 2), testing::Bool()));

/// What is nowhere near is seen on the way of a step: it ends before a part has gone through another.
TEST(SelfContacts, StepsDoNotGoThrough) {
  const Lattice lattice = arch();
  const ContactOnLevel on(itself(), lattice, 0);
  const Mesh& mesh = on.mesh;
  PenaltyContact* contact = on.contact.get();
  const NodeVector at = NodeVector::Zero(static_cast<Eigen::Index>(mesh.num_dofs())), step = closing(mesh, 80);
  const double part = contact->longest_step(at, step);
  EXPECT_LT(part * 80, 27);  // where the end of the arm, 24 mm apart, comes
  EXPECT_GT(part * 80, 23);
  EXPECT_EQ(contact->longest_step(at, 0.2 * step), 1);
}

/// In a slot of few voxels normals turn in the middle, which nothing goes through.
TEST(SelfContacts, WhatGoesThroughASlotGoesThroughNothing) {
  for (const int thick : {12, 13, 14}) {  // slots of 8, 6 and 4 voxels
    const Lattice lattice = arch(thick);
    for (int level = 0; level < 3; ++level) {
      const ContactOnLevel on(itself(), lattice, level);
      const Mesh& mesh = on.mesh;
      PenaltyContact* contact = on.contact.get();
      contact->set_progress({1});
      contact->attach(NodeVector::Zero(static_cast<Eigen::Index>(mesh.num_dofs())));
      EXPECT_FALSE(contact->passes_through(closing(mesh, 0.9 * (32 - 2 * thick)))) << thick << " at " << level;
      EXPECT_TRUE(contact->passes_through(closing(mesh, 60))) << thick << " at " << level;
    }
  }
}

TEST(SelfContacts, ArmsThatAreClosedBearEachOther) {
  const Lattice lattice = arch();
  Scene scene;
  scene.tolerance = 1e-8;
  scene.conditions = {held("upper", {0, 31, 0}, {0, 1, 0}), Condition{}};
  scene.conditions[1].name = "lower";
  scene.conditions[1].selection.box = hexmesh::box_between({25, -1, -2}, {35, 0, 8});
  scene.conditions[1].by = {0, 25.5, 0};
  SolveReport open;
  solve_equilibrium(lattice, scene, 0, open);
  scene.contacts = {itself()};
  for (const auto& [level, grading] : {std::pair(1, Grading::off), {0, Grading::off}, {0, Grading::scene}}) {
    scene.grading = grading;
    SolveReport report;
    solve_equilibrium(lattice, scene, level, report);
    ASSERT_TRUE(report.converged) << report.reason;
    const Vec3 lower = report.conditions[1].reaction_n;
    EXPECT_LT((report.conditions[0].reaction_n + lower).norm(), 1e-4 * lower.norm());
    EXPECT_GT(std::abs(lower[1]), 3 * std::abs(open.conditions[1].reaction_n[1]));
    EXPECT_GT(report.contacts[0].points, 30U);
    EXPECT_LT(report.contacts[0].deepest_mm, 0.02);
  }
}

/// The arms fall on each other in a motion, and stay so.
TEST(SelfContacts, AFoldedSheetDoesNotPassThroughItself) {
  const Lattice lattice = arch();
  Scene scene;
  scene.conditions = {held("upper", {0, 31, 0}, {0, 1, 0})};
  scene.gravity = Vec3(0, 10000, 0);
  scene.contacts = {itself()};
  Dynamics d;
  d.step = 2e-3;
  d.duration = 0.4;
  scene.dynamics = d;
  scene.finds_strain = false;
  const ContactOnLevel on(itself(), lattice, 1);
  const Mesh& mesh = on.mesh;
  PenaltyContact* contact = on.contact.get();
  Motion motion(lattice, scene, 1);
  double deepest = 0, highest = 0;
  for (int n = 0; n < 200; ++n) {
    ASSERT_TRUE(motion.step()) << motion.reason();
    if (n % 10 != 9) continue;
    const NodeVector u = motion.displacement();
    deepest = std::max(deepest, contact->state(u).deepest);
    for (std::size_t k = 0; k < mesh.num_nodes(); ++k) {  // of the lower arm, where it is below the other
      const Vec3 x = mesh.position(k), now = x + u.segment<3>(3 * static_cast<Eigen::Index>(k));
      if (x[1] < 4 && now[0] < 45) highest = std::max(highest, now[1]);
    }
  }
  EXPECT_GT(contact->state(motion.displacement()).points, 5U);
  EXPECT_LT(deepest, 0.5);
  EXPECT_LT(highest, 29);
}

/// Jaws, a lower one of `lower` voxels and an upper one above a slot of `slot`, that are joined at x < 4, the upper one
/// with a tip of another segment. A tongue that slides along both is between them at y < 8; beyond it there is nothing.
Lattice jaws(int lower = 5, int slot = 2) {
  return segments_of({"jaws", "tongue", "tip"}, {16, 16, 2 * lower + slot}, {1, 1, 1}, [=](const Index3& v) {
    const bool is_upper = v[2] >= lower + slot;
    if (v[0] < 4 || v[2] < lower || is_upper) return v[0] > 11 && v[2] > lower + slot ? 3 : 1;
    return v[1] < 8 ? 2 : 0;
  });
}

Contact with_itself(const std::string& segment) {
  Contact c = itself();
  c.self = segment;
  return c;
}

/// On level 2 pieces of both jaws share the place of a cell: neither is where the other's voxels are. The end of the
/// tongue is in the rounded corner of the jaws.
TEST(SelfContacts, WhatSlidesPressesNothingAtRest) {
  const Lattice lattice = jaws();
  Contact tongue = with_itself("");
  tongue.self.reset();
  tongue.between = {"tongue", "jaws"};
  for (const Contact& contact : {with_itself("jaws"), tongue})
    for (const int level : {0, 1, 2}) {
      const ContactOnLevel on(contact, MeshCells(lattice, level));
      const NodeVector u = NodeVector::Zero(static_cast<Eigen::Index>(on.mesh.num_dofs()));
      on.contact->set_progress({1});
      EXPECT_LT(on.contact->energy(u), 1e-20) << level;
      EXPECT_TRUE(contact.between || on.contact->state(u).points == 0) << level;
    }
}

/// The segment named stands for all that its cells hold together with it.
TEST(SelfContacts, OfASegmentThatSlidesTakesWithItWhatItHolds) {
  const Lattice lattice = jaws();
  std::vector<std::size_t> points;
  for (const char* name : {"jaws", "tip"}) {
    const ContactOnLevel on(with_itself(name), lattice, 0);
    const NodeVector u =
        sample(on.mesh, [](const Vec3& x) { return Vec3(0, 0, x[2] > 6 ? -0.24 * std::max(0.0, x[0] - 4) : 0); });
    on.contact->set_progress({1});
    points.push_back(on.contact->state(u).points);
  }
  EXPECT_GT(points[0], 10U);
  EXPECT_EQ(points[0], points[1]);
}

/// The arch, whose back slides along a pad.
TEST(SelfContacts, ArmsOfASegmentThatSlidesBearEachOther) {
  const Lattice lattice = segments_of({"arch", "pad"}, {32, 32, 4}, {2, 1, 2}, [](const Index3& v) {
    return v[0] < 6 ? 2 : v[1] < 4 || v[1] >= 28 || v[0] < 8 ? 1 : 0;
  });
  Scene scene;
  scene.tolerance = 1e-8;
  scene.conditions = {held("upper", {0, 31, 0}, {0, 1, 0}), held("pad", {0, 0, 0}, {-1, 0, 0}), Condition{}};
  scene.conditions[0].selection.box = hexmesh::box_between({12, 31, -2}, {70, 32, 8});
  scene.conditions[0].selection.halfspace.reset();
  scene.conditions[2].name = "lower";
  scene.conditions[2].selection.box = hexmesh::box_between({37, -1, -2}, {47, 0, 8});
  scene.conditions[2].by = {0, 25.5, 0};
  Contact pad;
  pad.name = "pad";
  pad.where = "test";
  pad.between = {"arch", "pad"};
  scene.contacts = {pad, with_itself("arch")};
  for (const int level : {1, 0}) {
    SolveReport report;
    solve_equilibrium(lattice, scene, level, report);
    ASSERT_TRUE(report.converged) << report.reason;
    for (const ContactReport& c : report.contacts) {
      EXPECT_GT(c.points, 10U) << c.name;
      EXPECT_LT(c.deepest_mm, 0.02) << c.name;
    }
    const Vec3 upper = report.conditions[0].reaction_n, pad_bears = report.conditions[1].reaction_n,
               lower = report.conditions[2].reaction_n;
    EXPECT_LT((upper + pad_bears + lower).norm(), 1e-6 * lower.norm());
    EXPECT_LT((pad_bears - report.contacts[0].force_n).norm(), 1e-6 * lower.norm());
  }
}

TEST(SelfContacts, SlidingSegmentsAndThinBodiesAreRefused) {
  Scene scene;
  scene.conditions = {held("upper", {0, 31, 0}, {0, 1, 0})};
  scene.contacts = {itself()};
  SolveReport report;
  EXPECT_THROW(solve_equilibrium(arch(2), scene, 1, report), hexmesh::Error) << "of two voxels";
  EXPECT_THROW(solve_equilibrium(jaws(), scene, 1, report), hexmesh::Error) << "expected one of its segments";
  scene.contacts = {with_itself("teeth")};
  EXPECT_THROW(solve_equilibrium(jaws(), scene, 1, report), hexmesh::Error) << "not there";
}

}  // namespace test_self_contact
