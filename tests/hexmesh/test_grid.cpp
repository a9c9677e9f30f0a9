// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "hexmesh/core/grid.h"
#include "support/bodies.h"
#include "support/files.h"

namespace test_grid {

using namespace hexmesh;
using testing_support::message_of;
using testing_support::random_rotation;

TEST(Grid, ContinuousIndexInvertsPosition) {
  const Grid grid({5, 6, 7}, {0.8, 0.9, 2.5}, {12, -34, 56}, random_rotation(3));
  const Vec3 index(1.25, -3.5, 10);
  EXPECT_LT((grid.continuous_index(grid.position(index)) - index).norm(), 1e-12);
}

TEST(Grid, OffsetsRunThroughAllVoxelsWithTheFirstAxisFastest) {
  const Grid grid({3, 4, 5}, {1, 1, 1});
  EXPECT_EQ(grid.offset({1, 0, 0}), 1U);
  EXPECT_EQ(grid.offset({0, 1, 0}), 3U);
  for (std::size_t n = 0; n < grid.num_voxels(); ++n) EXPECT_EQ(grid.offset(grid.index(n)), n);
}

TEST(Grid, CoversItsVoxelsToTheirFaces) {
  const Grid grid({3, 4, 5}, {1, 2, 3});
  EXPECT_EQ(grid.corner(0), Vec3(0, 0, 0));
  EXPECT_EQ(grid.corner(5), Vec3(2, 0, 4));
  for (int n = 0; n < 8; ++n) EXPECT_TRUE(grid.covers(grid.corner(n)));
  EXPECT_TRUE(grid.covers({-0.5, 3.5, 4.5}));
  EXPECT_FALSE(grid.covers({0, 3.6, 0}));
  EXPECT_FALSE(grid.covers({0, 0, NAN}));
}

TEST(Grid, RefusesWhatIsNoGridAndNamesIt) {
  EXPECT_NE(message_of(ErrorKind::input,
                       [] {
                         Grid({0, 1, 1}, {1, 1, 1});
                       })
                .find("extent along axis 0 is 0"),
            std::string::npos);
  EXPECT_NE(message_of(ErrorKind::input,
                       [] {
                         Grid({1, 1, 1}, {1, -2, 1});
                       })
                .find("spacing along axis 1 is -2"),
            std::string::npos);
  for (const double spacing : {1e300, 1e-300, double{NAN}, double{INFINITY}})
    EXPECT_NE(message_of(ErrorKind::input,
                         [&] {
                           Grid({1, 1, 1}, {1, 1, spacing});
                         })
                  .find("spacing along axis 2 is"),
              std::string::npos);
  EXPECT_NE(message_of(ErrorKind::input,
                       [] {
                         Grid({1, 1, 1}, {1, 1, 1}, {0, 1e300, 0});
                       })
                .find("origin is (0, 1e+300, 0)"),
            std::string::npos);
  Mat3 shear = Mat3::Identity();
  shear(0, 1) = 0.3;
  EXPECT_NE(message_of(ErrorKind::input,
                       [&] {
                         Grid({1, 1, 1}, {1, 1, 1}, Vec3::Zero(), shear);
                       })
                .find("orthonormal"),
            std::string::npos);
}

TEST(Grid, SameGridComparesPositionsNotNumbers) {
  const Grid a({4, 4, 4}, {1, 1, 1});
  EXPECT_TRUE(same_grid(a, Grid({4, 4, 4}, {1.00001, 1, 1})));
  EXPECT_FALSE(same_grid(a, Grid({4, 4, 4}, {1, 1, 1}, {0.1, 0, 0})));
  EXPECT_FALSE(same_grid(a, Grid({4, 4, 5}, {1, 1, 1})));
}

}  // namespace test_grid
