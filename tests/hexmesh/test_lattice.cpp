// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <set>

#include "hexmesh/lattice/lattice.h"
#include "support/bodies.h"
#include "support/files.h"

using namespace hexmesh;
using namespace testing_support;

namespace {

constexpr double whole_body = 1e-9;  // relative

class LatticeLevels : public testing::TestWithParam<Vec3> {
protected:
  const Lattice lattice = bitten_ball(GetParam(), {1, 2, 3}, random_rotation(11));

  double voxel_sum(const std::function<double(const Material&)>& f) const {
    double sum = 0;
    for (const std::uint16_t label : lattice.labels)
      for (const LatticeSegment& s : lattice.segments)
        if (s.segment.label == label) sum += f(*s.material) * lattice.voxels.voxel_volume();
    return sum;
  }
};

}  // namespace

TEST_P(LatticeLevels, MassAndVolumeAreThoseOfTheVoxels) {
  const double mass = voxel_sum([](const Material& m) { return m.density; });
  const double volume = voxel_sum([](const Material&) { return 1; });
  for (const Level& level : lattice.levels) {
    double total_mass = 0, total_volume = 0;
    for (const std::int32_t e : level.element) {
      total_mass += level.elements[static_cast<std::size_t>(e)].mass();
      total_volume += level.elements[static_cast<std::size_t>(e)].volume();
    }
    EXPECT_NEAR(total_mass, mass, whole_body * mass);
    EXPECT_NEAR(total_volume, volume, whole_body * volume);
  }
}

TEST_P(LatticeLevels, ALinearFieldStoresTheSameEnergyAtEveryLevel) {
  Mat3 gradient;
  gradient << 0.1, -0.05, 0.02, 0.3, 0.2, -0.1, 0.07, 0.04, -0.15;
  const Mat3 strain = 0.5 * (gradient + gradient.transpose());
  const double expected = voxel_sum([&](const Material& m) {
    const double lambda = m.bulk_modulus() - 2 * m.shear_modulus() / 3;
    return m.shear_modulus() * strain.squaredNorm() + lambda / 2 * strain.trace() * strain.trace();
  });
  for (int level = 0; level < static_cast<int>(lattice.levels.size()); ++level)
    for (const auto volumetric : {hexsolver::Volumetric::full, hexsolver::Volumetric::mean}) {
      const Body body(lattice, level, hexsolver::Strain::cauchy, volumetric);
      const auto u = sample(body.mesh, [&](const Vec3& x) -> Vec3 { return gradient * x; });
      EXPECT_NEAR(body.elastic.energy(u), expected, whole_body * expected) << "level " << level;
    }
}

TEST_P(LatticeLevels, EveryVoxelIsInTheCellOfItsIndex) {
  for (const Level& level : lattice.levels) {
    std::set<Index3> expected;
    for (Index3 c : lattice.levels.front().cells) {
      for (std::size_t d = 0; d < 3; ++d) c[d] /= level.voxels_per_cell[d];
      expected.insert(c);
    }
    EXPECT_EQ(std::set<Index3>(level.cells.begin(), level.cells.end()), expected);
  }
}

TEST_P(LatticeLevels, OffsetsMoveTheLatticeNotTheBody) {
  const Lattice plain = bitten_ball(GetParam(), {0, 0, 0}, random_rotation(11));
  ASSERT_EQ(plain.levels[0].cells.size(), lattice.levels[0].cells.size());
  const auto position = [](const Lattice& l, std::size_t n) {
    const Index3& v = l.levels[0].cells[n];
    return l.voxels.position(Vec3(v[0], v[1], v[2]));
  };
  for (std::size_t n = 0; n < plain.levels[0].cells.size(); n += 97)
    EXPECT_LT((position(plain, n) - position(lattice, n)).norm(), 1e-9);
  EXPECT_NE(plain.levels[1].cells.size(), lattice.levels[1].cells.size());
}

INSTANTIATE_TEST_SUITE_P(Spacings, LatticeLevels, testing::Values(Vec3(1, 1, 1), Vec3(0.8, 0.8, 2.5)));

TEST(Lattice, MergesTheFinerAxesFirst) {
  EXPECT_EQ(merge_factor({0.8, 0.8, 2.5}), (Index3{2, 2, 1}));
  EXPECT_EQ(merge_factor({1.6, 1.6, 2.5}), (Index3{2, 2, 1}));
  EXPECT_EQ(merge_factor({3.2, 3.2, 2.5}), (Index3{2, 2, 2}));
  EXPECT_EQ(merge_factor({1, 3, 3}), (Index3{2, 1, 1}));
}

TEST(Lattice, CellsAlikeShareOneElement) {
  const Lattice lattice = box({16, 16, 16}, {1, 1, 1});
  for (const Level& level : lattice.levels) EXPECT_EQ(level.elements.size(), 1U);
}

TEST(Lattice, TheLabelOfACellIsThatOfMostOfItsVoxels) {
  const LabelVolume volume =
      make_volume({2, 2, 2}, {1, 1, 1}, [](const Index3& v) { return v[2] == 0 || v[0] + v[1] == 0 ? 2 : 1; });
  const Material m = material_from_units(1, 0.3, 1000);
  const Lattice lattice =
      build_lattice(volume, {{volume.segments[0], m, 0}, {volume.segments[1], m, 0}}, {2, {0, 0, 0}});
  EXPECT_EQ(lattice.levels[1].segment, std::vector<std::uint16_t>{2});
}

TEST(Lattice, SegmentsWithoutMaterialAreNoCellsButStayBehindFaces) {
  const LabelVolume volume = make_volume({3, 1, 1}, {1, 1, 1}, [](const Index3& v) { return v[0] == 1 ? 2 : 1; });
  const Lattice lattice = build_lattice(
      volume, {{volume.segments[0], material_from_units(1, 0.3, 1000), 0}, {volume.segments[1], std::nullopt, 0}});
  EXPECT_EQ(lattice.levels[0].cells.size(), 2U);
  int towards_second = 0;
  for (const ExposedFace& face : exposed_faces(lattice)) towards_second += face.neighbour == 2;
  EXPECT_EQ(towards_second, 2);
}

TEST(Lattice, ExposedFacesCloseTheBody) {
  // The vector areas of a closed surface add up to nothing, and those of a box to its six sides.
  const Lattice ball = bitten_ball({1, 1, 1});
  Vec3 sum = Vec3::Zero();
  for (const ExposedFace& face : exposed_faces(ball)) sum += (face.side % 2 ? 1.0 : -1.0) * Vec3::Unit(face.side / 2);
  EXPECT_EQ(sum, Vec3::Zero());
  EXPECT_EQ(exposed_faces(box({3, 4, 5}, {1, 1, 1})).size(), 2U * (12 + 15 + 20));
}

TEST(Lattice, ASegmentWithoutMaterialOrKnownTissueIsNamed) {
  LabelVolume volume = make_volume({1, 1, 1}, {1, 1, 1}, [](const Index3&) { return 1; });
  volume.segments[0].name = "gallbladder";
  std::vector<std::string> notes;
  EXPECT_NE(message_of(ErrorKind::input, [&] { assign_materials(volume, {}, notes); }).find("'gallbladder'"),
            std::string::npos);
  EXPECT_NE(message_of(ErrorKind::input,
                       [&] {
                         assign_materials(volume, {{"spleen", {}}}, notes);
                       })
                .find("unknown segment 'spleen', expected one of: gallbladder"),
            std::string::npos);
  MaterialChoice all;
  all.young_kpa = 5;
  all.poisson = 0.4;
  EXPECT_DOUBLE_EQ(assign_materials(volume, {{"*", all}}, notes)[0].material->young, 5e-3);
}

TEST(Lattice, RebuildingWithTheSameMaterialsChangesNothing) {
  const Lattice lattice = bitten_ball({1, 1, 1});
  const Lattice again = rebuild_levels(lattice);
  ASSERT_EQ(again.levels.size(), lattice.levels.size());
  for (std::size_t l = 0; l < lattice.levels.size(); ++l) {
    EXPECT_EQ(again.levels[l].element, lattice.levels[l].element);
    for (std::size_t e = 0; e < lattice.levels[l].elements.size(); ++e)
      EXPECT_EQ(again.levels[l].elements[e].shear, lattice.levels[l].elements[e].shear);
  }
}
