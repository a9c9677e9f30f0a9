// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <numbers>

#include "support/bodies.h"
#include "support/solve.h"

namespace test_load_steps {

using namespace hexsolver;
using namespace testing_support;

// Turned as it is a body has no energy but that of rounding, which no line search can follow.
TEST(LoadSteps, TurnABodyOfAnyLawByItsSupports) {
  const Lattice lattice = box({8, 6, 6}, {2, 2, 2}, 10, 0.45);
  const Vec3 axis = Vec3(1, 2, 2).normalized(), about(50, 0, 0);
  for (const Elasticity law :
       {Elasticity::corotational, Elasticity::neo_hookean, Elasticity::stable_neo_hookean, Elasticity::green_lagrange})
    for (const double degrees : {90.0, 675.0, 720.0})
      for (int level = 0; level < 3; ++level) {
        SCOPED_TRACE(testing::Message() << "law " << static_cast<int>(law) << " by " << degrees << " level " << level);
        Scene scene;
        scene.elasticity = law;
        if (law == Elasticity::green_lagrange) scene.volumetric = Volumetric::full;
        Condition end;
        end.name = end.where = "end";
        end.selection.halfspace = HalfSpace{{-0.9, 0, 0}, {-1, 0, 0}};
        end.turn = Turn{axis, degrees * std::numbers::pi / 180, about};
        scene.conditions = {end};
        SolveReport report;
        const hexmesh::Result result = solve_equilibrium(lattice, scene, level, report);
        ASSERT_TRUE(report.converged) << report.reason;
        const Mat3 turn = Eigen::AngleAxisd(end.turn->radians, axis).toRotationMatrix();
        double off = 0;
        for (std::size_t n = 0; n < result.nodes.size(); ++n)
          off = std::max(off,
                         (turn * (result.nodes[n] - about) + about - result.nodes[n] - result.displacement[n]).norm());
        EXPECT_LT(off, 1e-5);
        EXPECT_LT(report.strain_energy_n_mm, 1e-12);
      }
}

}  // namespace test_load_steps
