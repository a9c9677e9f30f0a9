// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <map>
#include <numbers>
#include <optional>
#include <set>

#include "constraints/supports.h"
#include "level/on_level.h"
#include "mesh/face_neighbours.h"
#include "mesh/hierarchy.h"
#include "support/bodies.h"

namespace test_graded {

using namespace hexsolver;
using namespace testing_support;

/// Divides cells at random, the same for the same seed: all neighbourhoods that balanced leaves have come up.
MeshCells::IsTooLarge at_random(unsigned seed) {
  return [seed](int level, const Index3& cell) {
    const std::size_t n = 73856093U * static_cast<unsigned>(cell[0]) ^ 19349663U * static_cast<unsigned>(cell[1]) ^
                          83492791U * static_cast<unsigned>(cell[2]) ^
                          2654435761U * (seed + static_cast<unsigned>(level));
    return std::mt19937(static_cast<unsigned>(n))() % 3 == 0;
  };
}

std::vector<bool> some(std::size_t size, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<bool> out(size);
  for (std::size_t n = 0; n < size; ++n) out[n] = random() % 4 == 0;
  return out;
}

struct Case {
  Lattice lattice;
  MeshCells cells;
  explicit Case(Lattice l, unsigned seed, int finest = 0, int coarsest = 3)
      : lattice(std::move(l)), cells(lattice, finest, coarsest, at_random(seed)) {}
  /// Those of a level divided again and again.
  Case(Lattice l, unsigned seed, int level, const std::vector<bool>& which)
      : lattice(std::move(l)), cells(MeshCells(lattice, level).divided(which)) {
    for (int again = 0; again < 2; ++again) cells = cells.divided(some(cells.size(), seed++));
  }
  Case(const Case&) = delete;
};

/// Two segments, the first with a fissure one voxel wide, that touch and slide along each other, on a third that holds
/// both; here and there a voxel is missing.
Lattice split_body(const Index3& offset) {
  const auto label = [](const Index3& v) {
    if ((7 * v[0] + 13 * v[1] + 31 * v[2]) % 23 == 0) return 0;
    if (v[2] < 3) return 3;
    if (v[0] < 11) return v[1] == 6 && v[0] > 2 ? 0 : 1;
    return (Vec3(v[0], v[1], v[2]) - Vec3(11, 9, 8)).norm() < 9 ? 2 : 0;
  };
  const hexmesh::LabelVolume volume = make_volume({21, 17, 15}, {1, 1.25, 1.5}, label);
  std::vector<hexmesh::LatticeSegment> segments;
  for (std::uint16_t n = 1; n <= 3; ++n)
    segments.push_back({{n, "s" + std::to_string(n)}, hexmesh::material_from_units(10.0 * n, 0.3, 1000), 0, ""});
  return build_lattice(volume, segments, {4, offset, {true, {{1, 2}}}});
}

/// Cut bodies on lattices of cubes and of longer cells, turned and shifted; such whose cells are split.
std::vector<std::unique_ptr<Case>> cases() {
  std::vector<std::unique_ptr<Case>> out;
  for (unsigned seed = 1; seed <= 4; ++seed) {
    out.push_back(std::make_unique<Case>(bitten_ball({1, 1, 1}), seed));
    out.push_back(std::make_unique<Case>(bitten_ball({0.8, 0.8, 2.5}, {1, 0, 1}, random_rotation(seed)), seed));
    out.push_back(std::make_unique<Case>(grey_ball({1.2, 1, 1.1}, {3, 2, 1}), seed, 1, 3));
    const auto ball = [](const Index3& i) { return (Vec3(i[0], i[1], i[2]) - Vec3(7, 6, 6)).norm() < 6.3; };
    out.push_back(std::make_unique<Case>(one_material({15, 13, 13}, {1, 1, 1}, ball), seed, 0, 2));
    out.push_back(std::make_unique<Case>(split_body({static_cast<std::int32_t>(seed) - 1, 1, 0}), seed));
    out.push_back(std::make_unique<Case>(split_body({0, static_cast<std::int32_t>(seed), 2}), seed, 1, 3));
    for (Lattice lattice : {split_body({1, 0, 0}), bitten_ball({0.8, 0.8, 2.5})}) {
      const std::size_t cells = lattice.level(3).cells.size();
      out.push_back(std::make_unique<Case>(std::move(lattice), seed, 3, some(cells, seed)));
    }
  }
  return out;
}

Index3 in_units(const Mesh& mesh, std::size_t cell, int a) {
  const Index3& size = mesh.sizes()[mesh.size_of(cell)].size;
  const Index3 corner = hexmesh::corner_of(mesh.cells()[cell], a);
  return {corner[0] * size[0], corner[1] * size[1], corner[2] * size[2]};
}

/// A place in a cell, [0, 1]^3 inside.
Vec3 local(const Mesh& mesh, std::size_t cell, const Index3& place) {
  return local_in(place, mesh.cells()[cell], mesh.sizes()[mesh.size_of(cell)].size);
}

Vec3 linear(const Vec3& x) {
  return {0.3 * x[0] - 0.2 * x[1] + 1, 0.1 * x[2] - 0.4 * x[0], 0.5 * x[1] + 0.2 * x[2] - 3};
}

TEST(Graded, LeavesCoverEachCellOfTheFinestLevelOnce) {
  for (const auto& c : cases()) {
    const Mesh mesh = c->cells.make_mesh();
    ASSERT_GT(mesh.sizes().size(), 1U);
    std::int64_t voxels = 0;
    for (std::size_t n = 0; n < mesh.num_cells(); ++n) {
      const MeshCells::Place place = c->cells.place(n);
      const hexmesh::Level& level = c->lattice.level(place.level);
      voxels += level.filled[static_cast<std::size_t>(level.element[static_cast<std::size_t>(place.cell)])];
      EXPECT_EQ(level.cells[static_cast<std::size_t>(place.cell)], mesh.cells()[n]);
      EXPECT_LT((mesh.edges(n) - c->lattice.cell_edges(place.level)).norm(), 1e-12);
    }
    const hexmesh::Level& finest = c->lattice.level(0);
    EXPECT_EQ(voxels, static_cast<std::int64_t>(finest.cells.size()));
    for (const Index3& cell : c->lattice.level(c->cells.level()).cells)
      EXPECT_NE(cells_at(cell, mesh.cells(), mesh.sizes()), std::pair(0, 0));
  }
}

TEST(Graded, CellsThatTouchDifferByOneLevelAtMost) {
  for (const auto& c : cases()) {
    const Mesh mesh = c->cells.make_mesh();
    for (std::size_t a = 0; a < mesh.num_cells(); ++a)
      for (std::size_t b = 0; b < a; ++b) {
        bool touch = true;
        for (std::size_t d = 0; d < 3; ++d)
          touch = touch && in_units(mesh, a, 0)[d] <= in_units(mesh, b, 7)[d] &&
                  in_units(mesh, b, 0)[d] <= in_units(mesh, a, 7)[d];
        const int apart = std::abs(c->cells.place(a).level - c->cells.place(b).level);
        EXPECT_TRUE(!touch || apart <= 1);
      }
  }
}

TEST(Graded, AllDividedOrNoneIsTheMeshOfALevel) {
  const Lattice lattice = bitten_ball({0.8, 0.8, 2.5});
  for (const int level : {1, 3}) {
    const MeshCells graded(lattice, 1, 3, [&](int, const Index3&) { return level == 1; });
    const Mesh mesh = graded.make_mesh(), uniform = MeshCells(lattice, level).make_mesh();
    EXPECT_EQ(mesh.cells(), uniform.cells());
    EXPECT_EQ(mesh.cell_nodes(), uniform.cell_nodes());
    EXPECT_EQ(mesh.nodes(), uniform.nodes());
    EXPECT_EQ(mesh.position(5), uniform.position(5));
    EXPECT_EQ(graded.elements(), lattice.level(level).element);
    EXPECT_EQ(mesh.num_hanging(), 0U);
  }
}

TEST(Graded, WhatIsDividedIsHalvedAndTheRestIsAsItWas) {
  for (const auto& c : cases()) {
    const MeshCells& before = c->cells;
    const std::vector<bool> which = some(before.size(), 7), all(before.size(), true), none(before.size());
    EXPECT_EQ(before.divided(none).make_mesh().cells(), before.make_mesh().cells());
    const MeshCells halved = before.divided(all);
    const std::vector<std::int32_t> parents = holders(halved, before);
    for (std::size_t n = 0; n < halved.size(); ++n) {
      ASSERT_GE(parents[n], 0);
      const int level = before.place(static_cast<std::size_t>(parents[n])).level;
      EXPECT_EQ(halved.place(n).level, std::max(0, level - 1));
    }
    const MeshCells after = before.divided(which);
    std::vector<int> level_in(before.size(), -1);
    const std::vector<std::int32_t> of = holders(after, before);
    for (std::size_t n = 0; n < after.size(); ++n) level_in[static_cast<std::size_t>(of[n])] = after.place(n).level;
    for (std::size_t n = 0; n < before.size(); ++n) {
      const int level = before.place(n).level;
      EXPECT_LE(level_in[n], which[n] ? std::max(0, level - 1) : level);
      EXPECT_GE(level_in[n], std::max(0, level - 1));
    }
  }
  const Lattice lattice = bitten_ball({0.8, 0.8, 2.5});
  const MeshCells coarse(lattice, 2);
  const Mesh mesh = coarse.divided(std::vector<bool>(coarse.size(), true)).make_mesh();
  EXPECT_EQ(mesh.cell_nodes(), MeshCells(lattice, 1).make_mesh().cell_nodes());
}

/// All cells say the same of each node of the finest cells, which is how those hold together.
TEST(Graded, FieldsHaveNoGapWhereTheFinestCellsHaveNone) {
  for (const auto& c : cases()) {
    const Mesh mesh = c->cells.make_mesh();
    const NodeVector free = noise(mesh.num_dofs(), 1);
    const MeshCells finest(c->lattice, c->cells.level());
    const Mesh fine = finest.make_mesh();
    const std::vector<std::int32_t> holder = holders(finest, c->cells);
    std::vector<std::optional<Vec3>> told(fine.num_nodes());
    const Index3 of_fine = c->lattice.level(c->cells.level()).voxels_per_cell;
    for (std::size_t cell = 0; cell < fine.num_cells(); ++cell)
      for (std::size_t a = 0; a < 8; ++a) {
        const Index3 place =
            hexmesh::coarser_index(hexmesh::first_in(fine.nodes()[fine.node(cell, a)], of_fine), c->cells.unit());
        const Vec3 at = local(mesh, static_cast<std::size_t>(holder[cell]), place);
        const Vec3 u = mesh.interpolate(holder[cell], hexmesh::shape_functions(at), free);
        std::optional<Vec3>& here = told[fine.node(cell, a)];
        if (here) {
          ASSERT_LT((u - *here).norm(), 1e-14);
        }
        here = u;
      }
  }
}

TEST(Graded, FieldsHaveNoGapWhereSmallCellsMeetLargerOnes) {
  for (const auto& c : cases()) {
    if (c->lattice.parting.any()) continue;
    const Mesh mesh = c->cells.make_mesh();
    ASSERT_GT(mesh.num_hanging(), 0U);
    const NodeVector free = noise(mesh.num_dofs(), 1);
    NodeVector all;
    mesh.spread(free, all);
    for (std::size_t fine = 0; fine < mesh.num_cells(); ++fine)
      for (int a = 0; a < 8; ++a) {
        const Index3 place = in_units(mesh, fine, a);
        const Vec3 u = all.segment<3>(3 * static_cast<Eigen::Index>(mesh.node(fine, static_cast<std::size_t>(a))));
        for (std::size_t other = 0; other < mesh.num_cells(); ++other) {
          const Vec3 at = local(mesh, other, place);
          if (at.minCoeff() < 0 || at.maxCoeff() > 1) continue;
          const Vec3 v = mesh.interpolate(static_cast<std::int32_t>(other), hexmesh::shape_functions(at), free);
          ASSERT_LT((u - v).norm(), 1e-14);
        }
      }
  }
}

TEST(Graded, LinearFieldsAreLinearAtHangingNodes) {
  for (const auto& c : cases()) {
    const Mesh mesh = c->cells.make_mesh();
    NodeVector all;
    mesh.spread(sample(mesh, linear), all);
    for (std::size_t n = 0; n < mesh.num_all_nodes(); ++n)
      EXPECT_LT((all.segment<3>(3 * static_cast<Eigen::Index>(n)) - linear(mesh.position(n))).norm(), 1e-12);
  }
}

TEST(Graded, CollectIsTheTransposeOfSpread) {
  for (const auto& c : cases()) {
    const Mesh mesh = c->cells.make_mesh();
    const NodeVector free = noise(mesh.num_dofs(), 1, 1);
    NodeVector all, forces = noise(3 * mesh.num_all_nodes(), 1, 2);
    mesh.spread(free, all);
    const double work = all.dot(forces);
    mesh.collect(forces);
    EXPECT_NEAR(free.dot(forces), work, 1e-12 * free.norm() * forces.norm());
  }
}

/// Graded cells beside those of their finest level, which have the same fields in more numbers: u_fine = P u.
struct Beside {
  Beside(const Case& c, Elasticity law, Volumetric volumetric)
      : graded(c.cells, law, volumetric),
        fine(c.lattice, c.cells.level(), law, volumetric),
        p(fine.mesh, graded.mesh, holders(MeshCells(c.lattice, c.cells.level()), c.cells), {1, 1, 1}) {}
  Body graded, fine;
  Prolongation p;
};

TEST(Graded, FieldsToldOnTheFinestLevelAreFoundAgain) {
  for (const auto& c : cases()) {
    const Mesh mesh = c->cells.make_mesh();
    const OnLevel on_level(c->cells, mesh);
    const NodeVector u = noise(mesh.num_dofs(), 1);
    NodeVector told;
    on_level.tell(u, told);
    ASSERT_EQ(told.size(), 3 * std::ssize(on_level.numbering().nodes));
    EXPECT_LT((on_level.sampled(told) - u).lpNorm<Eigen::Infinity>(), 1e-11);  // by way of cells beside the node

    const NodeVector forces = noise(mesh.num_dofs(), 2), of_level = on_level.forces(forces);
    EXPECT_NEAR(of_level.dot(told), forces.dot(u), 1e-10 * forces.norm() * u.norm());
    const auto resultant = [](const NodeVector& f, const std::vector<Index3>& nodes) {
      Eigen::Matrix<double, 6, 1> sum = Eigen::Matrix<double, 6, 1>::Zero();  // with its moment
      for (std::size_t n = 0; n < nodes.size(); ++n) {
        const Vec3 force = f.segment<3>(3 * static_cast<Eigen::Index>(n));
        sum.head<3>() += force;
        sum.tail<3>() += Vec3(nodes[n][0], nodes[n][1], nodes[n][2]).cross(force);
      }
      return sum;
    };
    const Index3 &unit = c->cells.unit(), &voxels = c->lattice.level(c->cells.level()).voxels_per_cell;
    std::vector<Index3> places, places_of_level = on_level.numbering().nodes;
    for (std::size_t n = 0; n < mesh.num_nodes(); ++n) places.push_back(mesh.nodes()[n]);
    for (std::size_t d = 0; d < 3; ++d) {
      for (Index3& place : places) place[d] *= unit[d];
      for (Index3& place : places_of_level) place[d] *= voxels[d];
    }
    const auto expected = resultant(forces, places);
    EXPECT_LT((resultant(of_level, places_of_level) - expected).norm(), 1e-10 * forces.lpNorm<1>() * 100);
  }
}

TEST(Graded, StiffnessIsThatOfTheFinestCellsOnTheSameFields) {
  for (const auto& c : cases()) {
    Beside b(*c, Elasticity::cauchy, Volumetric::full);
    const NodeVector x = noise(b.graded.mesh.num_dofs(), 1);
    NodeVector fine_x, fine_y, y, expected;
    b.p.prolongate(x, fine_x);
    b.fine.potential.apply(fine_x, fine_y);
    b.p.restrict_to(fine_y, expected);
    b.graded.potential.apply(x, y);
    EXPECT_LT((y - expected).norm(), 1e-12 * expected.norm());
    EXPECT_NEAR(b.graded.potential.energy(x), b.fine.potential.energy(fine_x), 1e-12 * b.fine.potential.energy(fine_x));
  }
}

/// The patch test: linear fields, large strains and turns among them, exert the forces that finest cells do.
TEST(Graded, LinearFieldsExertTheForcesOfTheFinestCells) {
  const Mat3 turn = Eigen::AngleAxisd(1.1, Vec3(1, 2, -1).normalized()).toRotationMatrix();
  const Mat3 stretch = (Mat3() << 1.2, 0.1, 0, 0, 0.9, -0.1, 0.05, 0, 1.1).finished();
  const Mat3 f = turn * stretch;
  for (const auto& c : cases())
    for (const auto& [law, volumetric] :
         std::vector<std::pair<Elasticity, Volumetric>>{{Elasticity::cauchy, Volumetric::mean},
                                                        {Elasticity::corotational, Volumetric::mean},
                                                        {Elasticity::corotational, Volumetric::full},
                                                        {Elasticity::green_lagrange, Volumetric::full},
                                                        {Elasticity::neo_hookean, Volumetric::mean},
                                                        {Elasticity::stable_neo_hookean, Volumetric::mean}}) {
      // Mean dilatation and laws of moduli that differ within a cell are no linear function of the voxels': one
      // stiffness.
      const bool is_even = c->lattice.materials.size() == 1;
      if (!is_even && !(law == Elasticity::cauchy || law == Elasticity::corotational)) continue;
      if (!is_even && volumetric == Volumetric::mean) continue;
      Beside b(*c, law, volumetric);
      const auto field = [&](const Vec3& x) -> Vec3 { return f * x - x; };
      NodeVector forces, fine_forces, magnitude, fine_magnitude, expected, expected_magnitude;
      b.graded.potential.gradient(sample(b.graded.mesh, field), forces, magnitude);
      b.fine.potential.gradient(sample(b.fine.mesh, field), fine_forces, fine_magnitude);
      b.p.restrict_to(fine_forces, expected);
      EXPECT_LT((forces - expected).norm(), 1e-12 * fine_magnitude.norm());
    }
}

TEST(Graded, RigidTurnsStoreNoEnergy) {
  for (const auto& c : cases())
    for (const Elasticity law : {Elasticity::corotational, Elasticity::neo_hookean, Elasticity::stable_neo_hookean})
      for (const double degrees : {90., 200., 720.}) {
        Body body(c->cells, law);
        const Mat3 turn =
            Eigen::AngleAxisd(degrees * std::numbers::pi / 180, Vec3(1, -1, 2).normalized()).toRotationMatrix();
        const NodeVector u = sample(body.mesh, [&](const Vec3& x) -> Vec3 { return turn * x - x + Vec3(3, 2, 1); });
        double scale = 0;  // stiffness times size squared
        for (std::size_t cell = 0; cell < body.mesh.num_cells(); ++cell)
          scale += body.elastic->model(cell).stiffness.trace() * body.mesh.edges(cell).squaredNorm();
        EXPECT_LT(std::abs(body.potential.energy(u)), 1e-12 * scale);
      }
}

TEST(Graded, ForcesAndHessianAreDerivativesOfTheEnergy) {
  for (const auto& c : cases())
    for (const Elasticity law : {Elasticity::corotational, Elasticity::stable_neo_hookean}) {
      Body body(c->cells, law);
      const NodeVector u = noise(body.mesh.num_dofs(), 0.05, 3), d = noise(body.mesh.num_dofs(), 1, 4);
      NodeVector gradient, ahead, behind, magnitude, product;
      body.potential.gradient(u, gradient, magnitude);
      const double h = 1e-5;
      const double slope = (body.potential.energy(u + h * d) - body.potential.energy(u - h * d)) / (2 * h);
      EXPECT_NEAR(slope, gradient.dot(d), 1e-6 * magnitude.norm() * d.norm());
      body.potential.gradient(u + h * d, ahead, magnitude);
      body.potential.gradient(u - h * d, behind, magnitude);
      body.potential.move_to(u);
      body.potential.linearize(u, Hessian::exact);
      body.potential.apply(d, product);
      EXPECT_LT(((ahead - behind) / (2 * h) - product).norm(), 1e-5 * product.norm());
    }
}

TEST(Graded, CoarserMeshesOfMultigridHoldTheSameLinearFields) {
  for (const auto& c : cases()) {
    const Hierarchy hierarchy(c->cells, 30);
    ASSERT_GT(hierarchy.meshes.size(), 2U);
    for (std::size_t l = 0; l + 1 < hierarchy.meshes.size(); ++l) {
      const Mesh &fine = hierarchy.meshes[l], &coarse = hierarchy.meshes[l + 1];
      EXPECT_LE(coarse.num_nodes(), fine.num_nodes());
      std::set<std::int32_t> children;
      std::size_t count = 0;
      for (const hexmesh::Children& of : hierarchy.merges[l].children)
        for (const std::int32_t child : of) {
          if (child < 0) continue;
          children.insert(child);
          ++count;
        }
      EXPECT_EQ(children.size(), fine.num_cells());
      EXPECT_EQ(count, fine.num_cells());
      NodeVector u;
      hierarchy.prolongations[l].prolongate(sample(coarse, linear), u);
      EXPECT_LT((u - sample(fine, linear)).norm(), 1e-6 * u.norm());
    }
  }
}

/// Two blocks that slide along each other are two bodies on any graded cells, which share no node.
TEST(Graded, SegmentsThatSlideShareNothing) {
  for (const Index3& offset : {Index3{0, 0, 0}, Index3{1, 2, 1}, Index3{2, 1, 3}}) {
    const hexmesh::LabelVolume volume =
        make_volume({19, 9, 10}, {1, 1, 1}, [](const Index3& v) { return v[0] < 9 ? 1 : 2; });
    std::vector<hexmesh::LatticeSegment> segments;
    for (std::uint16_t n = 1; n <= 2; ++n)
      segments.push_back({{n, "s" + std::to_string(n)}, hexmesh::material_from_units(10, 0.3, 1000), 0, ""});
    const Lattice lattice = build_lattice(volume, segments, {4, offset, {false, {{1, 2}}}});
    for (unsigned seed = 1; seed < 6; ++seed)
      for (MeshCells cells(lattice, 0, 3, at_random(seed));; cells = cells.coarser()) {
        const Mesh mesh = cells.make_mesh();
        std::size_t count = 0;
        const std::vector<std::int32_t> part = parts_of(mesh, count);
        EXPECT_EQ(count, 2U);
        std::vector<std::set<std::uint16_t>> segments_of(mesh.num_nodes());
        for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
          const auto [level, number] = cells.place(c);
          const std::uint16_t segment = lattice.level(level).segment[static_cast<std::size_t>(number)];
          for (std::size_t a = 0; a < 8; ++a)
            mesh.for_each_free(
                c, a, [&](std::int32_t n, double) { segments_of[static_cast<std::size_t>(n)].insert(segment); });
        }
        for (const auto& of_node : segments_of) EXPECT_EQ(of_node.size(), 1U);
        if (!mesh.is_graded()) break;
      }
  }
}

TEST(Graded, PartsAreThoseOfTheFinestCells) {
  // Two blocks side by side with a gap of two voxels between.
  const Lattice lattice = one_material({18, 8, 8}, {1, 1, 1}, [](const Index3& i) { return i[0] < 8 || i[0] > 9; });
  for (unsigned seed = 1; seed < 6; ++seed) {
    const MeshCells cells(lattice, 0, 1, at_random(seed));
    const Mesh mesh = cells.make_mesh();
    std::size_t count = 0;
    const std::vector<std::int32_t> part = parts_of(mesh, count);
    EXPECT_EQ(count, 2U);
    for (std::size_t c = 0; c < mesh.num_cells(); ++c)
      EXPECT_EQ(part[c] == part[0], (in_units(mesh, c, 0)[0] < 9) == (in_units(mesh, 0, 0)[0] < 9));
  }
}

/// Sides are opposite where cells stand side by side, the same where pieces are at one index.
TEST(SharedFaces, AreThoseOfTheSameFourNodes) {
  using Pair = std::array<std::int32_t, 4>;  // cell, side, other, its side; the larger cell first
  std::size_t at_one_index = 0;
  for (std::int32_t shift = 0; shift < 4; ++shift)
    for (int level = 1; level <= 3; ++level) {
      const Lattice lattice = split_body({shift, 1, 0});
      const Mesh mesh = MeshCells(lattice, level).make_mesh();
      std::map<std::set<std::int32_t>, std::vector<std::pair<std::int32_t, int>>> faces;
      for (std::size_t c = 0; c < mesh.num_cells(); ++c)
        for (int side = 0; side < 6; ++side) {
          std::set<std::int32_t> nodes;
          for (int a = 0; a < 8; ++a)
            if (hexmesh::corner_bit(a, side / 2) == side % 2) nodes.insert(mesh.cell_nodes()[c][hexmesh::as_size(a)]);
          faces[nodes].emplace_back(static_cast<std::int32_t>(c), side);
        }
      std::set<Pair> expected, found;
      for (const auto& [nodes, of] : faces)
        for (std::size_t n = 0; n < of.size(); ++n)
          for (std::size_t m = 0; m < n; ++m) expected.insert({of[n].first, of[n].second, of[m].first, of[m].second});
      for_each_shared_face(mesh, [&](const SharedFace& face) {
        const bool is_new = found.insert({face.cell, face.side, face.other, face.its_side}).second;
        EXPECT_TRUE(is_new);
        const bool is_one_index =
            mesh.cells()[hexmesh::as_size(face.cell)] == mesh.cells()[hexmesh::as_size(face.other)];
        EXPECT_EQ(face.its_side, is_one_index ? face.side : face.side ^ 1);
        at_one_index += is_one_index;
      });
      EXPECT_EQ(found, expected);
    }
  EXPECT_GT(at_one_index, 0U);
}

}  // namespace test_graded
