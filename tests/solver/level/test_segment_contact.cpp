// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "hexmesh/core/error.h"
#include "hexmesh/lattice/segment_distance.h"
#include "level/make_contacts.h"
#include "mesh/hierarchy.h"
#include "solver/level/contacts.h"
#include "solver/terms/derivatives.h"
#include "support/bodies.h"
#include "support/solve.h"
#include "terms/couplings.h"
#include "terms/potential.h"

namespace test_segment_contact {

using namespace hexsolver;
using namespace testing_support;

constexpr double young = 10, poisson = 0.3;  // [kPa]

Lattice make(const Index3& extent, const Vec3& spacing, const std::function<int(const Index3&)>& label,
             bool slides = true, const Index3& offset = {0, 0, 0}) {
  return segments_of({"below", "above"}, extent, spacing, label, slides, offset);
}

/// One block on another.
Lattice blocks(bool slides = true, const Index3& offset = {0, 0, 0}) {
  return make(
      {8, 9, 12}, {1, 1.5, 2}, [](const Index3& v) { return v[2] < 6 ? 1 : 2; }, slides, offset);
}

/// A ball in a block of 2 mm voxels.
Lattice ball_in_cup(bool slides = true) {
  return make(
      {20, 20, 20}, {2, 2, 2},
      [](const Index3& v) {
        const double r = (Vec3(v[0], v[1], v[2]) - Vec3(9.5, 9.5, 12)).norm();
        return r < 7.2 ? 2 : v[2] < 12 ? 1 : 0;
      },
      slides);
}

Contact between() {
  Contact c;
  c.name = "between";
  c.where = "test";
  c.between = {"above", "below"};
  return c;
}

/// The blocks, held below, the upper one's top displaced.
Scene pressed(const Vec3& by, bool with_contact = true) {
  Scene scene;
  scene.tolerance = 1e-9;
  scene.conditions = {held("bottom", {0, 0, -0.9}, {0, 0, -1}), held("top", {0, 0, 22.9}, {0, 0, 1}, by)};
  if (with_contact) scene.contacts = {between()};
  return scene;
}

TEST(SegmentDistance, OfAFlatFaceGoesOnToItsRim) {
  const Lattice lattice = blocks();
  const hexmesh::SegmentDistance distance(lattice.voxels, lattice.labels, 1, 2);
  for (const double x : {-0.4, 0.0, 3.3, 7.4})
    for (const double y : {-0.6, 5.0, 12.6})
      for (const double beside : {-0.2, 0.0, 0.4, 1.7}) {
        const Vec3 place(x, y, 11 + beside);
        const hexmesh::Gap gap = distance.gap(place);
        EXPECT_NEAR(gap.depth, beside, 1e-3) << place.transpose();
        EXPECT_LT((gap.normal - Vec3::UnitZ()).norm(), 3e-3) << place.transpose();
      }
  EXPECT_NEAR(distance.thickness(), 3.5, 1e-5);  // of the middle of a voxel, 8 mm wide
}

TEST(SegmentDistance, SlopesAndCurvaturesAreItsDerivatives) {
  const Lattice lattice = ball_in_cup();
  const hexmesh::SegmentDistance distance(lattice.voxels, lattice.labels, 2, 1);
  std::mt19937 dice(7);
  std::uniform_real_distribution<double> any(0, 38);
  constexpr double h = 1e-5;
  double farthest = 0;
  for (int n = 0; n < 200; ++n) {
    const Vec3 place(any(dice), any(dice), any(dice));
    const hexmesh::Gap gap = distance.gap(place);
    const double away = (place - Vec3(19, 19, 24)).norm() - 14.4;
    if (std::abs(away) > 6) continue;
    if (place[2] < 20) farthest = std::max(farthest, std::abs(gap.depth - away));
    for (int d = 0; d < 3; ++d) {
      const hexmesh::Gap up = distance.gap(place + h * Vec3::Unit(d)), down = distance.gap(place - h * Vec3::Unit(d));
      EXPECT_NEAR(gap.normal[d], (up.depth - down.depth) / (2 * h), 1e-6);
      EXPECT_LT((gap.bending.col(d) - (up.normal - down.normal) / (2 * h)).norm(), 1e-4);
    }
  }
  EXPECT_LT(farthest, 2);  // a voxel from the ball that was cut into voxels
}

/// Of the distance from a ball of voxels of 1 mm, on the smooth ball.
struct Roundness {
  double mean, root_mean_square, turned;
};

/// @param spread  of directions about the axes, where terraces are wide
Roundness roundness(double radius, double spread) {
  const auto edge = static_cast<std::int32_t>(2 * radius + 5);
  const Vec3 center = Vec3(0.1, 0.4, -0.3) + Vec3::Constant(0.5 * (edge - 1));
  const Lattice lattice = make({edge, edge, edge}, {1, 1, 1}, [&](const Index3& v) {
    return (Vec3(v[0], v[1], v[2]) - center).norm() < radius ? 1 : 0;
  });
  const hexmesh::SegmentDistance distance(lattice.voxels, lattice.labels, 1, 2);
  std::mt19937 dice(3);
  std::normal_distribution<double> any;
  constexpr int count = 2000;
  Roundness sums{};
  for (int n = 0; n < count; ++n) {
    const Vec3 axis = (n % 2 == 0 ? 1 : -1) * Vec3::Unit(n % 3);
    const Vec3 way = (axis + spread * Vec3(any(dice), any(dice), any(dice))).normalized();
    const hexmesh::Gap gap = distance.gap(center + radius * way);
    sums.mean += gap.depth;
    sums.root_mean_square += gap.depth * gap.depth;
    sums.turned += (gap.normal.normalized() - way).squaredNorm();
  }
  return {sums.mean / count, std::sqrt(sums.root_mean_square / count), std::sqrt(sums.turned / count)};
}

/// Where its voxels make terraces a dozen voxels wide, steps included.
TEST(SegmentDistance, OfABallIsRound) {
  const Roundness ball = roundness(20.3, 10);
  EXPECT_LT(std::abs(ball.mean), 0.01);    // means over next neighbours alone: 0.05
  EXPECT_LT(ball.root_mean_square, 0.05);  // 0.08
  EXPECT_LT(ball.turned, 0.02);            // 0.05
}

/// The first terraces of a ball of 90 voxels are 19 wide.
TEST(SegmentDistance, OfALargeBallIsRoundAtItsPoles) {
  const Roundness poles = roundness(45.2, 0.08);
  EXPECT_LT(poles.turned, 0.01);  // means over ten voxels alone: 0.02
}

/// A floor that is larger than what stands on it goes on flat beside that, and under it.
TEST(SegmentDistance, OfAFloorIsTheHeightAboveIt) {
  const Lattice lattice = make({24, 24, 22}, {1, 1, 1}, [](const Index3& v) {
    return v[2] < 12 ? 1 : v[2] < 20 && v[0] >= 8 && v[0] < 16 && v[1] >= 8 && v[1] < 16 ? 2 : 0;
  });
  const hexmesh::SegmentDistance distance(lattice.voxels, lattice.labels, 1, 2);
  for (double x = 6; x <= 17; x += 0.5)
    for (const double y : {6.5, 11.0, 16.0})
      for (const double height : {-0.4, 0.0, 0.4, 1.5})
        EXPECT_NEAR(distance.gap({x, y, 11.5 + height}).depth, height, 1e-6) << x << ' ' << y;
}

TEST(BodyMap, FindsWhereMaterialCameFrom) {
  const Lattice lattice = blocks(true, {1, 2, 1});
  for (int number = 0; number < 3; ++number) {
    const MeshCells cells = cells_of(lattice, number);
    const Mesh mesh = cells.make_mesh();
    const NodeVector u = sample(mesh, [](const Vec3& x) {
      return Vec3(0.3 * x[1] + 0.01 * x[2] * x[2], 5 - 0.2 * x[0], 0.02 * x[0] * x[1] - 3);
    });
    std::vector<bool> first(65536);
    first[1] = true;
    BodyMap map(cells, mesh, first);
    map.look_at(u);
    hexmesh::Embedding near;
    for (const Index3& voxel : lattice.levels[0].cells) {
      if (lattice.labels[lattice.voxels.offset(voxel)] != 1) continue;
      const Vec3 index = Vec3(voxel[0], voxel[1], voxel[2]) + Vec3(0.2, -0.3, 0.1);
      hexmesh::Embedding e{cells.cell_of_voxel(voxel), {}};
      const auto home = static_cast<std::size_t>(e.cell);
      const Vec3 rest = lattice.voxels.position(index);
      e.local = mesh.edges(home).inverse() * (rest - mesh.position(mesh.node(home, 0)));
      const Vec3 x = rest + mesh.interpolate(e.cell, hexmesh::shape_functions(e.local), u);
      for (const hexmesh::Embedding& from : {hexmesh::Embedding{}, near}) {
        const BodyMap::Place found = map.find(x, u, from, nullptr, beyond_cell);
        ASSERT_GE(found.cell, 0);
        EXPECT_LT((found.rest - rest).norm(), 1e-9);
        const Mat3 f = mesh.edges(static_cast<std::size_t>(found.cell)) * found.to_rest.inverse();
        EXPECT_GT(std::abs(f.determinant()), 0);
      }
      near = e;
    }
    EXPECT_LT(map.find(Vec3(500, 0, 0), u, {}, nullptr, beyond_cell).cell, 0);
  }
}

bool is_above(const MeshCells& cells, std::size_t cell) {
  return cells.lattice_level(cell).segment[static_cast<std::size_t>(cells.place(cell).cell)] == 2;
}

/// u(node), of which segment its cells are, and where it is at rest.
NodeVector displaced_by(const MeshCells& cells, const Mesh& mesh,
                        const std::function<Vec3(bool is_above, const Vec3& x)>& field) {
  NodeVector u = NodeVector::Zero(static_cast<Eigen::Index>(mesh.num_dofs()));
  for (std::size_t c = 0; c < mesh.num_cells(); ++c)
    for (std::size_t a = 0; a < 8; ++a)
      mesh.for_each_free(c, a, [&](std::int32_t n, double) {
        u.segment<3>(3 * Eigen::Index{n}) = field(is_above(cells, c), mesh.position(static_cast<std::size_t>(n)));
      });
  return u;
}

/// A voxel of the one within the other moves with that one's cells: what it would press is in these.
TEST(SegmentsThatTouch, PiecesThatMoveWithTheOtherDoNotPress) {
  const auto lattice_with = [](bool has_piece) {
    return make({8, 9, 12}, {1, 1.5, 2}, [&](const Index3& v) {
      return v[2] >= 6 || (has_piece && v == Index3{4, 4, 2}) ? 2 : 1;
    });
  };
  const auto points_at_rest = [](const Lattice& lattice, int level) {
    const ContactOnLevel on(between(), lattice, level);
    const auto size = static_cast<Eigen::Index>(on.mesh.num_dofs());
    return on.contact->touch_points(NodeVector::Zero(size)).size();
  };
  for (const int level : {0, 1})
    EXPECT_EQ(points_at_rest(lattice_with(true), level), points_at_rest(lattice_with(false), level)) << level;
}

/// The term of a contact, with both blocks deformed so that they press, and all of its forms of forces; on levels, with
/// places looked for anew and held.
class SegmentContact : public testing::TestWithParam<std::tuple<int, bool>> {
protected:
  const Lattice lattice = blocks(true, {1, 0, 1});
  const MeshCells cells = cells_of(lattice, std::get<0>(GetParam()));
  const Mesh mesh = cells.make_mesh();
  Potential potential{mesh};
  PenaltyContact* contact = nullptr;
  NodeVector u;

  SegmentContact() {
    Contact c = between();
    c.stiffness = 0.03;
    c.friction = 0.3;
    Selector selector(cells, mesh);
    auto term = make_segment_contact(c, SegmentShapes().of(c, 0, cells.lattice()), cells, mesh, selector, false);
    contact = term.get();
    if (std::get<1>(GetParam())) contact->hold_pairs();
    potential.add(std::move(term));
    contact->set_progress({1});
    u = field(0.6);
    contact->attach(u);
    contact->keep(u);
    u = field(0.8);
    contact->attach(u);
    potential.linearize(u, Hessian::exact);
  }
  /// The upper block comes down, turns a little and slides along the other, both strained.
  NodeVector field(double part) const {
    return displaced_by(cells, mesh, [part](bool is_above, const Vec3& x) -> Vec3 {
      if (is_above) return {part * (0.7 + 0.03 * x[1]), 0.05 * x[0] * part, -part * (0.5 + 0.02 * x[0])};
      return {0.05 * x[0], 0.02 * x[2], 0.03 * x[1] + 0.02 * x[2]};
    });
  }
};

TEST_P(SegmentContact, ForcesAreTheSlopeOfTheEnergy) {
  ASSERT_GT(contact->state(u).points, 20U);
  const NodeVector direction = noise(mesh.num_dofs(), 1, 5);
  const double measured = measured_slope(potential, u, direction);
  EXPECT_NEAR(gradient_of(potential, u).dot(direction), measured,
              1e-6 * gradient_of(potential, u).norm() * direction.norm());
}

TEST_P(SegmentContact, ForcesAndMomentsAreInBalance) {
  const NodeVector g = gradient_of(potential, u);
  const SumOfForces sum(mesh, u, g);
  EXPECT_LT(sum.force.norm(), 1e-13 * sum.size);
  EXPECT_LT(sum.moment.norm(), 1e-11 * sum.size * 20);
  const NodeVector above = displaced_by(cells, mesh, [](bool is, const Vec3&) { return Vec3::Constant(is ? 1 : 0); });
  Vec3 on_first = Vec3::Zero();
  for (Eigen::Index n = 0; n < g.size(); n += 3) on_first -= above[n] * g.segment<3>(n);
  EXPECT_LT((on_first - contact->state(u).force).norm(), 1e-12 * sum.size);
}

TEST_P(SegmentContact, TheHessianIsTheSlopeOfTheForces) {
  const NodeVector x = noise(mesh.num_dofs(), 1, 9), y = noise(mesh.num_dofs(), 1, 10);
  NodeVector product, of_y;
  potential.apply(x, product);
  const NodeVector difference = measured_product(potential, u, x);
  EXPECT_LT((product - difference).norm(), 1e-5 * product.norm());
  potential.apply(y, of_y);
  EXPECT_NEAR(product.dot(y), of_y.dot(x), 1e-12 * product.norm() * y.norm());
  EXPECT_LT(error_of_single_precision(potential, x), 1e-6);
}

TEST_P(SegmentContact, TheProjectedHessianIsOfCellsAndCouplings) {
  potential.linearize(u, Hessian::projected);
  const NodeVector x = noise(mesh.num_dofs(), 1, 9);
  NodeVector product, of_cells, added, of_shift;
  potential.apply(x, product);
  EXPECT_GT(product.dot(x), 0);
  const auto by_cells = [&](const NodeVector& from, NodeVector& to) {
    to = NodeVector::Zero(from.size());
    for (std::size_t c = 0; c < mesh.num_cells(); ++c)
      mesh.scatter_add(c, potential.cell_hessian(c) * mesh.gather(c, from), to);
  };
  OfAllNodes<NodeVector>().apply(mesh, x, of_cells, by_cells);
  EXPECT_GT((product - of_cells).norm(), 0.1 * product.norm());
  OfAllNodes<NodeVector>().apply(mesh, x, added, [&](const NodeVector& from, NodeVector& to) {
    by_cells(from, to);
    potential.couplings().add_product(mesh, from, to);
  });
  EXPECT_LT((product - added).norm(), 1e-12 * product.norm());
  // Both moved as one: no spring is drawn.
  potential.apply(sample(mesh, [](const Vec3&) { return Vec3(1, -2, 3); }), of_shift);
  EXPECT_LT(of_shift.norm(), 1e-12 * product.norm());
}

TEST_P(SegmentContact, CouplingsOfParentsAreGalerkinProducts) {
  const Hierarchy hierarchy(cells, 60);
  ASSERT_GT(hierarchy.meshes.size(), 1U);
  const NodeVector coarse = noise(hierarchy.meshes[1].num_dofs(), 1, 3);
  const auto multiply = [](const Mesh& on, const Couplings& couplings, const NodeVector& x, NodeVector& y) {
    OfAllNodes<NodeVector>().apply(on, x, y, [&](const NodeVector& from, NodeVector& to) {
      to = NodeVector::Zero(from.size());
      couplings.add_product(on, from, to);
    });
  };
  NodeVector fine, product(mesh.num_dofs()), expected, found(coarse.size());
  hierarchy.prolongations[0].prolongate(coarse, fine);
  multiply(mesh, potential.couplings(), fine, product);
  hierarchy.prolongations[0].restrict_to(product, expected);
  multiply(hierarchy.meshes[1], potential.couplings().of_parents(hierarchy.merges[0], mesh.num_cells()), coarse, found);
  EXPECT_GT(expected.norm(), 0);
  EXPECT_LT((found - expected).norm(), 1e-6 * expected.norm());  // weights of a Prolongation are of single precision
}

TEST_P(SegmentContact, StepsGoNoDeeperThanItKnows) {
  const NodeVector at = NodeVector::Zero(u.size());
  contact->attach(at);
  contact->forget(at);
  const NodeVector down = field(1e3) - field(0);
  const double part = contact->longest_step(at, down);
  EXPECT_LT(part, 0.02);
  EXPECT_GT(part, 1e-4);
  EXPECT_EQ(contact->longest_step(at, -down), 1);
}

INSTANTIATE_TEST_SUITE_P(OnLevels, SegmentContact, testing::Combine(testing::Values(0, 1, 2), testing::Bool()));

/// Of steps by which the upper block is in the lower one, and beyond it, straight or thrown aside first.
TEST_P(SegmentContact, TellsThatAPartWentThroughAnother) {
  const NodeVector at = NodeVector::Zero(u.size());
  const NodeVector way = displaced_by(cells, mesh, [](bool is_above, const Vec3& /*x*/) -> Vec3 {
    return {0, 0, is_above ? -1.0 : 0.0};
  });
  contact->set_progress({1});
  contact->attach(at);
  EXPECT_FALSE(contact->passes_through(at));
  EXPECT_FALSE(contact->passes_through(-50 * way)) << "apart";
  EXPECT_FALSE(contact->passes_through(way)) << "inside, on the side it came from";
  EXPECT_TRUE(contact->passes_through(7 * way)) << "beyond the middle of the lower block";
  EXPECT_TRUE(contact->passes_through(100 * way)) << "beyond it";
}

/// By symmetry nothing slides between two blocks alike that are pressed: they do what one block does.
TEST(SegmentContacts, TwoBlocksAreAsOne) {
  for (const Index3& offset : {Index3{0, 0, 0}, Index3{1, 2, 1}})
    for (int level = 0; level < 2; ++level) {
      SolveReport two, one;
      const hexmesh::Result parted = solve_equilibrium(blocks(true, offset), pressed({0, 0, -1}), level, two);
      solve_equilibrium(blocks(false, offset), pressed({0, 0, -1}, false), level, one);
      ASSERT_TRUE(two.converged) << two.reason;
      const Vec3 force = two.conditions[1].reaction_n, expected = one.conditions[1].reaction_n;
      const bool at_a_node = offset[2] == 0;  // else the face between them is inside the cells of the one block
      EXPECT_LT((force - expected).norm(), (level == 0 || at_a_node ? 1e-3 : 1e-2) * expected.norm()) << level;
      EXPECT_LT((two.contacts[0].force_n + force).norm(), 1e-6 * force.norm());
      EXPECT_EQ(two.contacts[0].points, 72U);
      EXPECT_LT(two.contacts[0].deepest_mm, 1e-3);
      EXPECT_FALSE(parted.cell_fields.at("contact_pressure").empty());
    }
}

/// A small block through larger bodies, whose normals turn little by little or are nowhere told: wherever it is carried
/// in, at whatever part of a voxel, it is seen, be the end of the way inside or beyond; beside them it is not.
TEST(SegmentContacts, WaysThroughBodiesOfAnyShapeAreSeen) {
  const std::vector<std::pair<const char*, std::function<bool(const Vec3&)>>> bodies = {
      {"ball", [](const Vec3& x) { return x.norm() < 9; }},
      {"block", [](const Vec3& x) { return x.cwiseAbs().maxCoeff() < 15; }},
      {"wedge", [](const Vec3& x) { return std::abs(x[2]) < 1.5 + 0.5 * (x[0] + 12) && x[0] < 12 && x[0] > -12; }},
      {"fin", [](const Vec3& x) { return x[2] < 1.5 && x[2] > (x[0] > 4 ? -15 : -1.5); }},
      {"plate", [](const Vec3& x) { return std::abs(x[2]) < 3; }}};
  for (const auto& [name, holds] : bodies) {
    const Vec3 middle(15.5, 15.5, 15.5);
    const auto inside = [&, &in = holds](const Index3& v) { return in(Vec3(v[0], v[1], v[2]) - middle); };
    int top = 31;
    while (!inside({15, 15, top})) --top;
    const Lattice lattice = make({32, 32, 40}, {1, 1, 1}, [&](const Index3& v) {
      if (v[2] >= top + 3 && v[2] < top + 7 && v[0] >= 14 && v[0] < 18 && v[1] >= 14 && v[1] < 18) return 2;
      return v[2] < 32 && inside(v) ? 1 : 0;
    });
    const ContactOnLevel on(between(), lattice, 1);
    const Mesh& mesh = on.mesh;
    PenaltyContact* contact = on.contact.get();
    const auto moved = [&](const Vec3& by) {
      return displaced_by(on.cells, mesh,
                          [&by](bool is_above, const Vec3& /*x*/) -> Vec3 { return is_above ? by : Vec3::Zero(); });
    };
    for (const double aside : {-8.0, -6.5, 0.0, 1.5, 5.0})
      for (const double phase : {0.0, 0.3, 0.5}) {
        contact->set_progress({1});
        contact->attach(moved({aside, 0, phase}));
        for (const double down : {2.0 * (top - 15), 60.0})
          EXPECT_TRUE(contact->passes_through(moved({aside, 0, phase - 3 - down})))
              << name << ' ' << aside << ' ' << down;
        EXPECT_FALSE(contact->passes_through(moved({aside, 0, phase - 2.5}))) << name;
      }
    if (inside({15, 15, 5})) {
      EXPECT_TRUE(contact->passes_through(moved({0, 0, -10}))) << "deep in what is thick";
    }
    contact->set_progress({1});
    contact->attach(moved({40, 0, 0}));
    EXPECT_FALSE(contact->passes_through(moved({40, 0, -60}))) << name;
  }
}

/// Both are held as wholes; turned the other way nothing is in the way.
TEST(SegmentContacts, OneBlockIsNotCarriedThroughAnother) {
  Scene scene = pressed({0, 0, -30});
  scene.conditions[0].selection.halfspace = HalfSpace{{0, 0, 10}, {0, 0, -1}};
  scene.conditions[1].selection.halfspace = HalfSpace{{0, 0, 12}, {0, 0, 1}};
  Scene into = scene, away = scene;
  into.conditions[1].by = away.conditions[1].by = Vec3::Zero();
  into.conditions[1].turn = Turn{Vec3::UnitY(), -3.1, {30, 0, 11}};
  away.conditions[1].turn = Turn{Vec3::UnitY(), 3.1, {30, 0, 11}};
  for (int level = 0; level < 2; ++level) {
    SolveReport report;
    for (const Scene& each : {scene, into}) {
      solve_equilibrium(blocks(), each, level, report);
      EXPECT_FALSE(report.converged) << level;
    }
    solve_equilibrium(blocks(), away, level, report);
    EXPECT_TRUE(report.converged) << report.reason;
  }
}

/// Graded cells are small where segments touch at rest: between coarser cells the same presses.
TEST(SegmentContacts, OfGradedCellsDoAsThoseOfOneSize) {
  const Lattice lattice = make({16, 16, 32}, {1, 1, 1}, [](const Index3& v) { return v[2] < 14 ? 1 : 2; });
  Scene scene = pressed({0.3, 0, -1.5});
  scene.conditions[0].selection.halfspace->point[2] = -0.4;
  scene.conditions[1].selection.halfspace->point[2] = 31.4;
  scene.contacts[0].friction = 0.2;
  SolveReport alike, graded;
  solve_equilibrium(lattice, scene, 0, alike);
  scene.grading = Grading::scene;
  const hexmesh::Result result = solve_equilibrium(lattice, scene, 0, graded);
  ASSERT_TRUE(alike.converged && graded.converged) << graded.reason;
  EXPECT_LT(static_cast<double>(graded.levels.back().cells), 0.7 * static_cast<double>(alike.levels.back().cells));
  const Vec3 force = alike.contacts[0].force_n;
  EXPECT_LT((graded.contacts[0].force_n - force).norm(), 0.01 * force.norm());
  EXPECT_LT((graded.conditions[1].reaction_n + graded.contacts[0].force_n).norm(), 1e-5 * force.norm());
  EXPECT_EQ(result.cell_fields.at("contact_pressure").size(), lattice.level(0).cells.size());
}

TEST(SegmentContacts, SegmentsPartWhereNothingHoldsThem) {
  SolveReport report;
  solve_equilibrium(blocks(), pressed({0, 0, 2}), 1, report);
  ASSERT_TRUE(report.converged);
  EXPECT_LT(report.conditions[1].reaction_n.norm(), 1e-9);
  EXPECT_EQ(report.contacts[0].points, 0U);
  EXPECT_NEAR(report.contacts[0].nearest_mm, 2, 0.05);
}

TEST(SegmentContacts, ThoseThatAdherePullAndSlide) {
  Scene scene = pressed({0, 0, 0.5});
  scene.contacts[0].adhesion = true;
  SolveReport report, one;
  solve_equilibrium(blocks(), scene, 1, report);
  solve_equilibrium(blocks(false), pressed({0, 0, 0.5}, false), 1, one);
  ASSERT_TRUE(report.converged) << report.reason;
  const double pull = one.conditions[1].reaction_n[2];
  EXPECT_NEAR(report.conditions[1].reaction_n[2], pull, 1e-3 * pull);
  scene.conditions[1].by = {0.5, 0.3, 0};
  solve_equilibrium(blocks(), scene, 1, report);
  solve_equilibrium(blocks(false), pressed({0.5, 0.3, 0}, false), 1, one);
  ASSERT_TRUE(report.converged) << report.reason;
  EXPECT_LT(report.conditions[1].reaction_n.norm(), 1e-3 * one.conditions[1].reaction_n.norm());
}

/// Drawn along the other a block pulls with mu N at most, and with no less than what its rising edge takes from that;
/// held by much friction it shears as one block does.
TEST(SegmentContacts, FrictionHoldsAndSlips) {
  Scene scene = pressed({0.6, 0, -0.4});
  scene.contacts[0].friction = 0.1;
  SolveReport report, one;
  solve_equilibrium(blocks(), scene, 1, report);
  ASSERT_TRUE(report.converged) << report.reason;
  const Vec3 force = report.contacts[0].force_n;
  EXPECT_LE(-force[0], 0.1 * force[2]);
  EXPECT_GE(-force[0], 0.07 * force[2]);
  EXPECT_GT(report.contacts[0].slipping, 50U);
  EXPECT_LT((report.conditions[1].reaction_n + force).norm(), 1e-5 * force.norm());
  scene.conditions[1].by = {0.1, 0, -0.4};
  scene.contacts[0].friction = 2;
  solve_equilibrium(blocks(), scene, 1, report);
  solve_equilibrium(blocks(false), pressed({0.1, 0, -0.4}, false), 1, one);
  ASSERT_TRUE(report.converged) << report.reason;
  EXPECT_EQ(report.contacts[0].slipping, 0U);
  const double shear = one.conditions[1].reaction_n[0];
  EXPECT_LT(report.conditions[1].reaction_n[0], shear);  // its springs give way
  EXPECT_GT(report.conditions[1].reaction_n[0], 0.9 * shear);
}

TEST(SegmentContacts, ABodyRestsInAnother) {
  const Lattice lattice = ball_in_cup();
  Scene scene;
  scene.tolerance = 1e-9;
  scene.conditions = {held("bottom", {0, 0, -0.9}, {0, 0, -1})};
  scene.gravity = Vec3(0, 0, -9810);
  scene.contacts = {between()};
  double weight = 0;
  for (const hexmesh::LatticeSegment& s : lattice.segments)
    if (s.segment.label == 2)
      weight = static_cast<double>(s.num_voxels) * lattice.voxels.voxel_volume() * s.material->density * 9810;
  for (const auto& [level, grading] : {std::pair(1, Grading::off), {2, Grading::off}, {0, Grading::scene}}) {
    scene.grading = grading;
    SolveReport report;
    solve_equilibrium(lattice, scene, level, report);
    ASSERT_TRUE(report.converged) << report.reason;
    EXPECT_LT((report.contacts[0].force_n - Vec3(0, 0, weight)).norm(), 1e-5 * weight) << level;
    EXPECT_LT(report.balance.sum().force_n.norm(), 1e-8 * weight) << level;
    EXPECT_LT(report.contacts[0].deepest_mm, 1e-3);
  }
}

/// Points on borders of cells of what they press on, whose slopes differ: the energy has a kink there until they
/// settle.
TEST(SegmentContacts, ForcesHaveNoJumpOncePlacesSettle) {
  const Lattice lattice = blocks();
  const ContactOnLevel on(between(), lattice, 0);
  const Mesh& mesh = on.mesh;
  PenaltyContact* contact = on.contact.get();
  const auto moved = [&](double along) {
    return displaced_by(on.cells, mesh, [along](bool is_above, const Vec3& x) -> Vec3 {
      return is_above ? Vec3(along, 0, -0.3) : Vec3(0, 0, 0.02 * x[0] * x[0]);
    });
  };
  constexpr double half_a_cell = 0.5, step = 1e-4;
  contact->set_progress({1});
  contact->attach(moved(half_a_cell));
  const auto kink = [&] {
    return std::abs(contact->energy(moved(half_a_cell + step)) + contact->energy(moved(half_a_cell - step)) -
                    2 * contact->energy(moved(half_a_cell))) /
           step;
  };
  const double loose = kink();
  EXPECT_GT(contact->gradient_jump(moved(half_a_cell)), 0);
  EXPECT_TRUE(contact->settle(moved(half_a_cell)));
  EXPECT_EQ(contact->gradient_jump(moved(half_a_cell)), 0);
  EXPECT_LT(kink(), 1e-2 * loose);
  contact->unsettle();
  EXPECT_EQ(kink(), loose);
  EXPECT_FALSE(contact->settle(moved(0.3)));
}

TEST(SegmentContacts, CellsThatHoldSegmentsTogetherAreRefused) {
  SolveReport report;
  EXPECT_THROW(solve_equilibrium(blocks(false), pressed({0, 0, -1}), 1, report), hexmesh::Error);
  Scene scene = pressed({0, 0, -1});
  scene.contacts[0].between->second = "nobody";
  EXPECT_THROW(solve_equilibrium(blocks(), scene, 1, report), hexmesh::Error);
}

}  // namespace test_segment_contact
