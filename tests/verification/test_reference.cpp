// SPDX-License-Identifier: Apache-2.0
// The same voxel liver solved by an independent finite-element program (CalculiX C3D8 and a hex8 code of its own):
// same mesh, same law, so only the solvers can differ. Of a scan beside the project; test_calculix needs none.
#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "support/experiments.h"
#include "support/files.h"
#include "support/solve.h"

namespace test_reference {

using namespace hexsolver;
using namespace testing_support;

struct Case {
  double poisson;
  double radius;
  Elasticity elasticity;
  const char* file;
  Vec3 reaction;  ///< on the displaced patch [N], four digits
};

Scene liver_scene(const Case& c) {
  Scene scene = with(liver_patches(c.radius, SurfacePoints::nodes), c.elasticity);
  scene.volumetric = Volumetric::full;
  scene.tolerance = 1e-10;
  return scene;
}

/// Positions of voxel corners, 1.5 mm apart at the least, to a whole number of 0.5 mm.
std::array<long, 3> key(const Vec3& p) { return {std::lround(2 * p[0]), std::lround(2 * p[1]), std::lround(2 * p[2])}; }

void expect_equal(const Case& c, const std::filesystem::path& reference) {
  const Lattice lattice = liver_of_scan(c.poisson);
  SolveReport report;
  const hexmesh::Result result = solve_equilibrium(lattice, liver_scene(c), 0, report);
  ASSERT_TRUE(report.converged) << report.reason;
  EXPECT_LT((report.conditions[3].reaction_n - c.reaction).norm(), 1e-3 * c.reaction.norm());

  std::map<std::array<long, 3>, Vec3> ours;
  for (std::size_t n = 0; n < result.nodes.size(); ++n) ours[key(result.nodes[n])] = result.displacement[n];
  std::size_t compared = 0;
  double worst = 0, sum = 0;
  for (const NodeRow& row : read_reference(reference)) {
    const auto found = ours.find(key(row.position));
    ASSERT_NE(found, ours.end()) << row.position.transpose();
    const double distance = (found->second - row.displacement).norm();
    worst = std::max(worst, distance);
    sum += distance;
    ++compared;
  }
  std::printf("%-34s %6zu nodes: mean %.1e, largest %.1e mm\n", c.file, compared, sum / compared, worst);
  EXPECT_GT(compared, 15000U);
  EXPECT_LT(worst, c.elasticity == Elasticity::cauchy ? 1e-5 : 3e-4);
}

TEST(VoxelLiver, EqualsAnIndependentSolution) {
  if (!has_references()) GTEST_SKIP() << "no shared data beside the project";
  constexpr Elasticity linear = Elasticity::cauchy, stvk = Elasticity::green_lagrange;
  for (const Case& c : {Case{0.3, 10, linear, "liver_0.3_linear_voxel.csv.gz", {1.817, -3.398, -1.222}},
                        Case{0.3, 20, linear, "liver_0.3_linear_voxel_r20.csv.gz", {3.440, -6.125, -2.030}},
                        Case{0.4, 10, linear, "liver_0.4_linear_voxel.csv.gz", {1.859, -3.390, -1.209}},
                        Case{0.4, 20, linear, "liver_0.4_linear_voxel_r20.csv.gz", {3.506, -6.096, -2.017}},
                        Case{0.3, 10, stvk, "liver_0.3_stvk_voxel.csv.gz", {5.080, -5.840, -1.733}},
                        Case{0.3, 20, stvk, "liver_0.3_stvk_voxel_r20.csv.gz", {9.148, -10.628, -3.316}},
                        Case{0.4, 10, stvk, "liver_0.4_stvk_voxel.csv.gz", {5.202, -5.890, -1.735}},
                        Case{0.4, 20, stvk, "liver_0.4_stvk_voxel_r20.csv.gz", {9.299, -10.655, -3.318}}}) {
    SCOPED_TRACE(c.file);
    expect_equal(c, shared_data() / "reference" / c.file);
  }
}

}  // namespace test_reference
