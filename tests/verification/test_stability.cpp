// SPDX-License-Identifier: Apache-2.0
// Hard cases in motion with the paper's starved solver: 10 conjugate gradient iterations per step of 0.02 s.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <random>

#include "hexsolver/dynamics.h"
#include "support/bodies.h"
#include "support/experiments.h"

using namespace hexsolver;
using namespace testing_support;

namespace {

const Vec3 earth(0, 0, -9810);  // mm/s^2

Scene starved(Rotation rotation, StepSolver solver = StepSolver::cg) {
  Scene scene;
  scene.rotation = rotation;
  Dynamics d;
  d.step = 0.02;
  d.duration = 20;
  d.solver = solver;
  d.solver_iterations = 10;
  d.newton_iterations = 1;
  scene.dynamics = d;
  return scene;
}

/// Runs and holds the energy against what was given. Averaged edges have no energy of their own: what stands for it is
/// held by the steps alone, to 1e-6 in each of their parts.
void expect_bounded(Motion& motion, int steps, Rotation rotation) {
  const double slack = rotation == Rotation::polar ? 1e-7 : 1e-4;
  double before = motion.energies().total(), work = motion.work() + motion.work_uncertainty(),
         largest = std::abs(before);
  for (int n = 0; n < steps; ++n) {
    ASSERT_TRUE(motion.step()) << motion.reason() << " at step " << n;
    ASSERT_TRUE(motion.displacement().allFinite() && motion.velocity().allFinite()) << "step " << n;
    const double now = motion.energies().total(), given = motion.work() + motion.work_uncertainty() - work;
    largest = std::max({largest, std::abs(now), motion.energies().kinetic + motion.energies().strain});
    ASSERT_LE(now, before + std::max(given, 0.0) + slack * largest) << "step " << n;
    before = now;
    work = motion.work() + motion.work_uncertainty();
  }
}

class Starved : public testing::TestWithParam<Rotation> {};

NodeVector zero(const Motion& motion) { return NodeVector::Zero(motion.displacement().size()); }

}  // namespace

TEST_P(Starved, CellsThatAreCollapsedMirroredOrScrambledStayBounded) {
  const Lattice lattice = box({6, 6, 6}, {4, 4, 4}, 10, 0.3);
  Motion motion(lattice, starved(GetParam()), 0);
  const auto flattened = [&](const Vec3& keep) {
    return sample(motion.mesh(), [&](const Vec3& p) { return Vec3(keep.cwiseProduct(p) - p); });
  };
  std::vector<std::pair<const char*, NodeVector>> starts = {{"plane", flattened({1, 1, 0})},
                                                            {"line", flattened({1, 0, 0})},
                                                            {"point", flattened({0, 0, 0})},
                                                            {"mirrored", flattened({1, 1, -1})}};
  for (unsigned seed = 1; seed <= 3; ++seed)
    starts.emplace_back("scrambled", noise(motion.mesh().num_dofs(), 3 * 4, seed));
  for (const auto& [name, start] : starts) {
    SCOPED_TRACE(name);
    motion.set_state(start, zero(motion));
    const double before = motion.energies().total();
    expect_bounded(motion, 200, GetParam());
    if (testing::Test::HasFatalFailure()) return;
    // A mirrored body may rest where all its cells are flat.
    if (std::string(name) != "mirrored") {
      EXPECT_LT(motion.energies().total(), 0.05 * before);
    }
  }
}

TEST_P(Starved, ALiverOfSliversUnderItsWeightSagsAsFarAsItShould) {
  // About 11600, 1730, 280 and 50 cells, with stiffness from none to three finer levels.
  const Lattice lattice = liver_of_phantom(4, 0.3);
  Scene scene = starved(GetParam());
  scene.gravity = earth;
  double low = 1e9, high = -1e9;
  const std::vector<Vec3> points = material_points(lattice);
  for (const Vec3& p : points) {
    low = std::min(low, p[0]);
    high = std::max(high, p[0]);
  }
  scene.conditions = {beyond("held", {low + 0.18 * (high - low), 0, 0}, {-1, 0, 0}, Vec3::Zero())};
  SolveReport report;
  Scene still = scene;
  still.dynamics.reset();
  still.rotation = Rotation::polar;
  const auto sag_at = [&](const hexmesh::Result& r) {
    double most = 0;
    for (const Vec3& u : displacement_at(r, points)) most = std::max(most, -u[2]);
    return most;
  };
  const double fine = sag_at(solve_equilibrium(lattice, still, 0, report));
  for (int level = 1; level <= 3; ++level) {
    Motion motion(lattice, scene, level);
    expect_bounded(motion, 1000, GetParam());
    if (testing::Test::HasFatalFailure()) return;
    SolveReport moved;
    const hexmesh::Result result = motion.conclude(moved);
    const double coarse = sag_at(result);
    printf("level %d: sag %.3g mm, %.3g in the fine equilibrium, %zu inverted cells\n", level, coarse, fine,
           moved.inverted_cells);
    EXPECT_GT(coarse, fine / 2);
    EXPECT_LT(coarse, 2 * fine);
    EXPECT_EQ(moved.inverted_cells, 0U);
  }
}

TEST_P(Starved, NearlyIncompressibleAndContrastStayBounded) {
  for (const double poisson : {0.49, 0.4999}) {
    SCOPED_TRACE(poisson);
    const Lattice lattice = box({12, 6, 6}, {4, 4, 4}, 30, poisson);
    Scene scene = starved(GetParam());
    scene.gravity = earth;
    scene.conditions = {beyond("held", {-1, 0, 0}, {-1, 0, 0}, Vec3::Zero())};
    Motion motion(lattice, scene, 1);
    expect_bounded(motion, 300, GetParam());
  }
  // A bar soft in the middle, between ends a million times stiffer, in cells that hold both.
  const hexmesh::LabelVolume volume =
      make_volume({15, 6, 6}, {4, 4, 4}, [](const Index3& i) { return i[0] < 5 || i[0] > 9 ? 2 : 1; });
  const Lattice lattice =
      hexmesh::build_lattice(volume, {{volume.segments[0], hexmesh::material_from_units(1, 0.3, 1000), 0, ""},
                                      {volume.segments[1], hexmesh::material_from_units(1e6, 0.3, 1000), 0, ""}});
  Scene scene = starved(GetParam());
  scene.gravity = earth;
  scene.conditions = {beyond("held", {-1, 0, 0}, {-1, 0, 0}, Vec3::Zero())};
  Motion motion(lattice, scene, 1);
  expect_bounded(motion, 300, GetParam());
}

TEST_P(Starved, ASpunAndAThrownBodyStayBounded) {
  const Lattice lattice = box({12, 4, 4}, {4, 4, 4}, 30, 0.3);
  Scene scene = starved(GetParam());
  Contact floor;
  floor.name = "floor";
  floor.obstacle = HalfSpace{{0, 0, -100}, {0, 0, 1}};
  floor.stiffness = 0.5;
  scene.contacts = {floor};
  scene.gravity = earth;
  Motion motion(lattice, scene, 1);
  motion.set_state(zero(motion), sample(motion.mesh(), [](const Vec3& p) {
                     return Vec3(Vec3(3, 40, -7).cross(p - Vec3(22, 6, 6)) + Vec3(500, 0, 1000));
                   }));
  expect_bounded(motion, 400, GetParam());
}

TEST_P(Starved, ThinAndStringyBodiesStayBounded) {
  // A sheet and a thread of single voxels that hang on a block by an edge.
  const hexmesh::LabelVolume volume = make_volume({20, 10, 10}, {2, 2, 2}, [](const Index3& i) {
    const bool block = i[0] < 5, sheet = i[2] == 5 && i[0] >= 5 && i[0] < 12,
               thread = i[1] == 4 && i[2] == 6 && i[0] >= 12;
    return block || sheet || thread ? 1 : 0;
  });
  const Lattice lattice =
      hexmesh::build_lattice(volume, {{volume.segments[0], hexmesh::material_from_units(100, 0.3, 1000), 0, ""}});
  for (int level = 0; level < 3; ++level) {
    Scene scene = starved(GetParam());
    scene.gravity = earth;
    scene.conditions = {beyond("held", {0, 0, 0}, {-1, 0, 0}, Vec3::Zero())};
    Motion motion(lattice, scene, level);
    expect_bounded(motion, 300, GetParam());
  }
}

INSTANTIATE_TEST_SUITE_P(Rotations, Starved, testing::Values(Rotation::polar, Rotation::edges),
                         [](const auto& p) { return p.param == Rotation::polar ? "polar" : "edges"; });
