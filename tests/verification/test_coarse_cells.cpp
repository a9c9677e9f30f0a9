// SPDX-License-Identifier: Apache-2.0
// The paper's arguments for the recursion, with figures: what a partly filled cell does, and what is lost by averaging.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <numbers>

#include "hexmesh/lattice/element_tree.h"
#include "hexmesh/scan/phantom.h"
#include "support/bodies.h"

namespace test_coarse_cells {

using namespace hexmesh;
using namespace testing_support;

Material rubber() { return material_from_units(100, 0.3, 1000); }

Lattice lattice_of(const LabelVolume& volume, int num_levels) {
  return build_lattice(volume, {{volume.segments[0], rubber(), 0, "given"}}, {num_levels, {0, 0, 0}});
}

/// Displacement of a cell's nodes under gravity along -y with those of its face y = 0 held.
CellVector under_gravity(const CellMatrix& k, const NodeWeights& masses) {
  constexpr double gravity = 9810;  // mm/s^2
  CellMatrix held = k;
  CellVector load = CellVector::Zero();
  for (int a = 0; a < num_cell_nodes; ++a) {
    if (corner_bit(a, 1)) {
      load[3 * a + 1] = -masses[a] * gravity;
      continue;
    }
    held.middleRows<3>(3 * a).setZero();
    held.middleCols<3>(3 * a).setZero();
    held.block<3, 3>(3 * a, 3 * a).setIdentity();
  }
  return held.llt().solve(load);
}

TEST(CoarseCell, OneFullChildOfFourMakesItAnisotropic) {
  // Figure 4. Stiffness at the corner of the full child and at the corner across it, everything else held.
  Element quarter;
  add_child(quarter, full_voxel(rubber(), 1), 0, {2, 2, 1});
  const Mat3 edges = Vec3(2, 2, 1).asDiagonal();
  const CellMatrix k = ElementMatrices(edges).stiffness(quarter);
  const CellMatrix averaged = ElementMatrices(edges).stiffness(spread_evenly(quarter));

  const double near = k(0, 0), across = k(9, 9);
  EXPECT_NEAR(averaged(0, 0), averaged(9, 9), 1e-12 * averaged(0, 0));
  EXPECT_GT(near, 2 * averaged(0, 0));
  EXPECT_LT(across, 0.3 * averaged(0, 0));
  EXPECT_GT(across, 0);
  // Along and across the line from the full child to the empty corner the cell is not the same.
  const Eigen::Vector2d along(std::numbers::sqrt2 / 2, std::numbers::sqrt2 / 2), aside(along[0], -along[1]);
  const Eigen::Matrix2d corner = k.block<2, 2>(0, 0);
  const double ratio = along.dot(corner * along) / aside.dot(corner * aside);
  EXPECT_GT(std::abs(ratio - 1), 0.1);
  printf(
      "one full child of four: stiffness at its corner %.4g, at the corner across %.4g, averaged law %.4g N/mm; "
      "at its corner along / across the diagonal %.3g\n",
      near, across, averaged(0, 0), ratio);
  RecordProperty("near_over_averaged", std::to_string(near / averaged(0, 0)));
  RecordProperty("across_over_averaged", std::to_string(across / averaged(0, 0)));
}

TEST(CoarseCell, ACBendsMoreThanItsAverage) {
  // Figure 5: a C that stands on its lower arm under gravity, simulated by one cell. Nothing but the spine (at -x)
  // carries the upper arm, so its tip (at +x) sinks and tilts; an averaged cell is as stiff where it is empty.
  SolidPhantom c;
  c.name = "c-shape";
  c.spacing = 4;
  c.size = {{"height", 64}};
  const Lattice lattice = lattice_of(solid_phantom(c), 5);
  ASSERT_EQ(lattice.levels.back().cells.size(), 1U);
  const ElementMatrices matrices(lattice.cell_edges(4));
  const Element cell = form_elements(lattice, 4)[0];
  const NodeWeights masses = matrices.lumped_mass(cell);
  const CellVector nonuniform = under_gravity(matrices.stiffness(cell), masses);
  const CellVector averaged = under_gravity(matrices.stiffness(spread_evenly(cell)), masses);
  const auto tip = [](const CellVector& u) { return -u[3 * 3 + 1]; };            // node (1, 1, 0)
  const auto tilt = [&](const CellVector& u) { return tip(u) + u[3 * 2 + 1]; };  // against node (0, 1, 0)
  EXPECT_GT(tip(nonuniform), 1.2 * tip(averaged));
  EXPECT_GT(tilt(nonuniform), tilt(averaged));
  printf(
      "C of one cell, fill %.3g: tip sinks by %.4g mm and %.4g mm against the spine with the non-uniform law, by "
      "%.4g mm and %.4g mm with the averaged one\n",
      lattice.levels.back().fill(0), tip(nonuniform), tilt(nonuniform), tip(averaged), tilt(averaged));
  RecordProperty("tip_nonuniform_mm", std::to_string(tip(nonuniform)));
  RecordProperty("tip_averaged_mm", std::to_string(tip(averaged)));
}

}  // namespace test_coarse_cells
