// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <cstdio>

#include "hexmesh/lattice/embedded_points.h"
#include "support/bodies.h"
#include "support/solve.h"

namespace test_folded {

using namespace hexsolver;
using namespace testing_support;

constexpr int across = 32;  // voxels
const Vec3 middle = Vec3::Constant((across - 1) / 2.0);

Lattice ball(double poisson) {
  return one_material(
      {across, across, across}, {1, 1, 1},
      [](const Index3& i) { return (Vec3(i[0], i[1], i[2]) - middle).norm() < across / 2.0 + 0.1; }, 10, poisson);
}

/// A ball squeezed between two patches at opposite places.
Scene squeezed(double by, Elasticity law) {
  Scene scene;
  scene.elasticity = law;
  for (const double side : {-1.0, 1.0}) {
    Condition c;
    c.name = c.where = side < 0 ? "below" : "above";
    c.selection.balls = {{middle + Vec3(0, 0, side * across / 2), 6}};
    c.by = {0, 0, -side * by};
    scene.conditions.push_back(c);
  }
  return scene;
}

/// det F of the displacement at the centres of the voxels, by differences.
std::vector<double> jacobians_of_voxels(const Lattice& lattice, const hexmesh::Result& result) {
  constexpr double h = 1e-4;
  const hexmesh::CellLocator locator(result.voxels, result.voxels_per_cell, result.cells);
  std::vector<Vec3> points;
  for (const Index3& v : lattice.levels[0].cells)
    for (int d = 0; d < 3; ++d)
      for (const double side : {-h, h})
        points.push_back(lattice.voxels.position(Vec3(v[0], v[1], v[2])) + side * Vec3::Unit(d));
  std::vector<Vec3> u;
  hexmesh::EmbeddedPoints(locator, result.cell_nodes, points)
      .interpolate({result.displacement.front().data(), 3 * result.displacement.size()}, u);
  std::vector<double> out;
  for (std::size_t v = 0; v < lattice.levels[0].cells.size(); ++v) {
    Mat3 f = Mat3::Identity();
    for (std::size_t d = 0; d < 3; ++d)
      f.col(static_cast<Eigen::Index>(d)) += (u[6 * v + 2 * d + 1] - u[6 * v + 2 * d]) / (2 * h);
    out.push_back(f.determinant());
  }
  return out;
}

bool is_told(const SolveReport& report, const std::string& words) {
  return std::any_of(report.warnings.begin(), report.warnings.end(),
                     [&](const std::string& w) { return w.find(words) != std::string::npos; });
}

TEST(Folded, VoxelsOfASqueezedBallAreTold) {
  const Lattice lattice = ball(0.4999);
  for (const double by : {1.0, 9.0}) {
    SolveReport report;
    const hexmesh::Result result = solve_equilibrium(lattice, squeezed(by, Elasticity::corotational), 2, report);
    ASSERT_TRUE(report.converged) << report.reason;
    const std::vector<double> jacobians = jacobians_of_voxels(lattice, result);
    const auto folded = std::count_if(jacobians.begin(), jacobians.end(), [](double j) { return j <= 0; });
    std::printf("by %g mm: %zd voxels folded, least Jacobian %.3f; told %zu of %zu cells, %.3f\n", by, folded,
                *std::min_element(jacobians.begin(), jacobians.end()), report.inverted_voxels, report.inverted_cells,
                report.min_jacobian);
    EXPECT_NEAR(report.min_jacobian, *std::min_element(jacobians.begin(), jacobians.end()), 1e-5);
    EXPECT_EQ(report.inverted_voxels, static_cast<std::size_t>(folded));
    EXPECT_EQ(folded > 0, by > 2);
    EXPECT_EQ(is_told(report, "inverted"), folded > 0);
  }
}

TEST(Folded, AChangeOfVolumeThatTheLawDoesNotSeeIsTold) {
  for (const double poisson : {0.3, 0.4999})
    for (const Elasticity law : {Elasticity::corotational, Elasticity::neo_hookean})
      for (const double by : {0.2, 4.0}) {
        SCOPED_TRACE(testing::Message() << "nu " << poisson << " law " << static_cast<int>(law) << " by " << by);
        SolveReport report;
        solve_equilibrium(ball(poisson), squeezed(by, law), 2, report);
        ASSERT_TRUE(report.converged) << report.reason;
        std::printf("nu %g, law %d, by %g mm: volume changes by %.4f, of a cell to %.3f to %.3f\n", poisson,
                    static_cast<int>(law), by, report.volume_change, report.least_volume_ratio,
                    report.largest_volume_ratio);
        const bool loses = poisson > 0.45 && law == Elasticity::corotational && by > 1;
        EXPECT_EQ(is_told(report, "law = \"neo-hookean\" does"), loses);
        if (poisson > 0.45 && law == Elasticity::neo_hookean) {
          EXPECT_LT(std::abs(report.volume_change), 2e-3);
        }
      }
}

}  // namespace test_folded
