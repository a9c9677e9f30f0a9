// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <map>
#include <random>
#include <set>

#include "hexmesh/lattice/check.h"
#include "hexmesh/lattice/element_tree.h"
#include "hexmesh/lattice/locator.h"
#include "support/bodies.h"
#include "support/files.h"

namespace test_lattice {

using namespace hexmesh;
using namespace testing_support;

constexpr double whole_body = 1e-9, single_cell = 1e-12;  // relative

/// Each level's cells flooded one by one through voxels that share a node.
void expect_flooded_parts(const Lattice& lattice) {
  for (const Level& level : lattice.levels) {
    std::vector<std::set<Index3>> left(level.cells.size());
    const CellLocator locator(lattice.voxels, level.voxels_per_cell, level.cells, level.split.owners);
    for (const Index3& v : lattice.levels[0].cells) left[as_size(locator.cell_of_voxel(v))].insert(v);
    for (std::size_t c = 0; c < level.cells.size(); ++c) {
      std::set<Index3>& voxels = left[c];
      int parts = 0;
      for (; !voxels.empty(); ++parts) {
        std::vector<Index3> front = {*voxels.begin()};
        voxels.erase(voxels.begin());
        while (!front.empty()) {
          const Index3 v = front.back();
          front.pop_back();
          for (int k = -1; k <= 1; ++k)
            for (int j = -1; j <= 1; ++j)
              for (int i = -1; i <= 1; ++i)
                if (const Index3 next = {v[0] + i, v[1] + j, v[2] + k}; voxels.erase(next) > 0) front.push_back(next);
        }
      }
      EXPECT_EQ(level.parts[c], parts);
    }
  }
}

struct Case {
  Vec3 spacing;
  bool grey;
};

void PrintTo(const Case& c, std::ostream* out) {
  *out << c.spacing.transpose() << (c.grey ? " mm, grey values" : " mm, two materials");
}

class LatticeLevels : public testing::TestWithParam<Case> {
protected:
  const Lattice lattice =
      (GetParam().grey ? grey_ball : bitten_ball)(GetParam().spacing, {1, 2, 3}, random_rotation(11));

  double voxel_sum(const std::function<double(const Material&)>& f) const {
    double sum = 0;
    for (const std::int32_t e : lattice.levels[0].element)
      sum += f(lattice.materials[e].material) * lattice.voxels.voxel_volume();
    return sum;
  }
};

TEST_P(LatticeLevels, KeepEveryInvariant) {
  const std::vector<Finding> findings = check_lattice(lattice);
  EXPECT_EQ(findings.size(), lattice.levels.size() * 16 + 1);
  for (const Finding& f : findings)
    EXPECT_TRUE(f.holds()) << f.property << ", level " << f.level << ": " << f.error << " > " << f.limit;
}

TEST_P(LatticeLevels, EveryCellIsTheSumOfItsVoxels) {
  // K of a cell by 2 x 2 x 2 Gauss points in each of its voxels with the cell's own shape functions: no recursion.
  const double voxel = lattice.voxels.voxel_volume();
  for (int number = 1; number < static_cast<int>(lattice.levels.size()); ++number) {
    const Level& level = lattice.levels[number];
    const Mat3 edges = lattice.cell_edges(number);
    const ElementMatrices matrices(edges);
    const std::vector<Element> elements = form_elements(lattice, number);
    for (std::size_t c = 0; c < level.cells.size(); c += 1 + level.cells.size() / 5) {
      CellMatrix expected = CellMatrix::Zero();
      for (std::size_t v = 0; v < lattice.levels[0].cells.size(); ++v) {
        const Index3& ijk = lattice.levels[0].cells[v];
        const Index3& n = level.voxels_per_cell;
        if (Index3{ijk[0] / n[0], ijk[1] / n[1], ijk[2] / n[2]} != level.cells[c]) continue;
        const Material& m = lattice.materials[lattice.levels[0].element[v]].material;
        const double mu = m.shear_modulus(), lambda = m.bulk_modulus() - 2 * mu / 3;
        for (int q = 0; q < 8; ++q) {
          Vec3 s;
          for (int d = 0; d < 3; ++d) {
            const auto e = static_cast<std::size_t>(d);
            const double gauss = (corner_bit(q, d) ? 0.5 : -0.5) / std::sqrt(3.0);
            s[d] = (ijk[e] % n[e] + 0.5 + gauss) / n[e];
          }
          const NodeGradients g = shape_gradients(s) * edges.inverse();
          for (int a = 0; a < 8; ++a)
            for (int b = 0; b < 8; ++b) {
              const Vec3 ga = g.row(a), gb = g.row(b);
              expected.block<3, 3>(3 * a, 3 * b) +=
                  voxel / 8 *
                  (lambda * ga * gb.transpose() + mu * gb * ga.transpose() + mu * ga.dot(gb) * Mat3::Identity());
            }
        }
      }
      const CellMatrix k = matrices.stiffness(elements[level.element[c]]);
      EXPECT_LT((k - expected).norm(), single_cell * expected.norm()) << "level " << number << " cell " << c;
    }
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
      const Body body(lattice, level, hexsolver::Elasticity::cauchy, volumetric);
      const auto u = sample(body.mesh, [&](const Vec3& x) -> Vec3 { return gradient * x; });
      EXPECT_NEAR(body.potential.energy(u), expected, whole_body * expected) << "level " << level;
    }
}

TEST_P(LatticeLevels, PartsAreThoseOfAFloodFill) { expect_flooded_parts(lattice); }

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
  const Lattice plain = bitten_ball(GetParam().spacing, {0, 0, 0}, random_rotation(11));
  ASSERT_EQ(plain.levels[0].cells.size(), lattice.levels[0].cells.size());
  const auto position = [](const Lattice& l, std::size_t n) {
    const Index3& v = l.levels[0].cells[n];
    return l.voxels.position(Vec3(v[0], v[1], v[2]));
  };
  for (std::size_t n = 0; n < plain.levels[0].cells.size(); n += 97)
    EXPECT_LT((position(plain, n) - position(lattice, n)).norm(), 1e-9);
  EXPECT_NE(plain.levels[1].cells.size(), lattice.levels[1].cells.size());
}

INSTANTIATE_TEST_SUITE_P(Bodies, LatticeLevels,
                         testing::Values(Case{{1, 1, 1}, false}, Case{{0.8, 0.8, 2.5}, false},
                                         Case{{0.8, 0.8, 2.5}, true}, Case{{1, 1, 1}, true}));

TEST(Lattice, MergesTheFinerAxesFirst) {
  EXPECT_EQ(merge_factor({0.8, 0.8, 2.5}), (Index3{2, 2, 1}));
  EXPECT_EQ(merge_factor({1.6, 1.6, 2.5}), (Index3{2, 2, 1}));
  EXPECT_EQ(merge_factor({3.2, 3.2, 2.5}), (Index3{2, 2, 2}));
  EXPECT_EQ(merge_factor({1, 3, 3}), (Index3{2, 1, 1}));
}

TEST(Lattice, CellsAlikeShareOneElement) {
  const Lattice lattice = box({16, 16, 16}, {1, 1, 1});
  for (const Level& level : lattice.levels) EXPECT_EQ(level.filled.size(), 1U);
}

TEST(Lattice, TheLabelOfACellIsThatOfMostOfItsVoxels) {
  const LabelVolume volume =
      make_volume({2, 2, 2}, {1, 1, 1}, [](const Index3& v) { return v[2] == 0 || v[0] + v[1] == 0 ? 2 : 1; });
  const Material m = material_from_units(1, 0.3, 1000);
  const Lattice lattice =
      build_lattice(volume, {{volume.segments[0], m, 0, ""}, {volume.segments[1], m, 0, ""}}, {2, {0, 0, 0}});
  EXPECT_EQ(lattice.levels[1].segment, std::vector<std::uint16_t>{2});
}

TEST(Lattice, SegmentsWithoutMaterialAreNoCellsButStayBehindFaces) {
  const LabelVolume volume = make_volume({3, 1, 1}, {1, 1, 1}, [](const Index3& v) { return v[0] == 1 ? 2 : 1; });
  const Lattice lattice = build_lattice(volume, {{volume.segments[0], material_from_units(1, 0.3, 1000), 0, ""},
                                                 {volume.segments[1], std::nullopt, 0, ""}});
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

TEST(Lattice, PartsOfCheckeredCellsAndOfTheTwoArmsOfAC) {
  // Voxels that touch in an edge or a corner hang together, as their nodes do; the arms of a C do not until its spine
  // lies in the same cell.
  const auto parts_of = [](const LabelVolume& volume) {
    const Lattice lattice =
        build_lattice(volume, {{volume.segments[0], material_from_units(1, 0.3, 1000), 0, ""}}, {4, {0, 0, 0}, {}});
    return lattice.levels;
  };
  const auto corners =
      parts_of(make_volume({2, 2, 2}, {1, 1, 1}, [](const Index3& v) { return v[0] == v[1] && v[1] == v[2]; }));
  EXPECT_EQ(corners.back().parts, std::vector<std::uint16_t>{1});
  const auto apart =
      parts_of(make_volume({4, 1, 1}, {1, 1, 1}, [](const Index3& v) { return v[0] == 0 || v[0] == 3; }));
  EXPECT_EQ(apart[2].parts, std::vector<std::uint16_t>{2});
  const auto c =
      parts_of(make_volume({8, 4, 1}, {1, 1, 1}, [](const Index3& v) { return v[0] < 1 || v[1] == 0 || v[1] == 3; }));
  EXPECT_EQ(c[1].parts, std::vector<std::uint16_t>(8, 1));
  EXPECT_EQ(c[2].parts, (std::vector<std::uint16_t>{1, 2}));
  EXPECT_EQ(c[3].parts, std::vector<std::uint16_t>{1});
}

TEST(Lattice, PartsOfScatteredVoxelsAreThoseOfAFloodFill) {
  std::mt19937 random(3);
  for (const int one_in : {3, 6, 12}) {
    const LabelVolume volume =
        make_volume({21, 18, 15}, {1, 1, 2}, [&](const Index3&) { return random() % one_in == 0; });
    for (const bool gaps : {false, true})
      expect_flooded_parts(build_lattice(volume, {{volume.segments[0], material_from_units(1, 0.3, 1000), 0, ""}},
                                         {5, {0, 0, 0}, {gaps, {}}}));
  }
}

TEST(Lattice, VoxelsAreOutsideInsideOrBoundary) {
  const Lattice lattice = box({4, 4, 4}, {1, 1, 1});
  const std::vector<VoxelClass> classes = classify_voxels(lattice);
  EXPECT_EQ(std::count(classes.begin(), classes.end(), VoxelClass::inside), 8);
  EXPECT_EQ(std::count(classes.begin(), classes.end(), VoxelClass::boundary), 56);
}

TEST(Lattice, CheckFindsWhatIsWrong) {
  const auto broken = [](const std::function<void(Lattice&)>& change) {
    Lattice lattice = grey_ball({1, 1, 2});
    change(lattice);
    std::set<std::string> properties;
    for (const Finding& f : check_lattice(lattice))
      if (!f.holds()) properties.insert(f.property);
    return properties;
  };
  EXPECT_TRUE(broken([](Lattice&) {}).empty());
  EXPECT_TRUE(broken([](Lattice& l) { l.labels[l.labels.size() / 2] = 0; }).contains("cells are those of the voxels"));
  EXPECT_TRUE(broken([](Lattice& l) { ++l.levels[1].segment[3]; }).contains("labels are those of the voxels"));
  EXPECT_TRUE(broken([](Lattice& l) { ++l.levels[2].parts[0]; }).contains("parts are those of the voxels"));
  EXPECT_TRUE(broken([](Lattice& l) {
                std::swap(l.levels[1].element[0], l.levels[1].element[5]);
              }).contains("elements are those of the children"));
  EXPECT_TRUE(broken([](Lattice& l) {
                std::swap(l.levels[1].children[0], l.levels[1].children[9]);
              }).contains("volume of the cells is that of the voxels"));
}

TEST(Lattice, OverridesOfAMaterialNeedNoNewLevels) {
  // Halving E of one segment in the materials is what a lattice built with half of it is.
  const LabelVolume volume = make_volume({5, 4, 3}, {1, 1, 2}, [](const Index3& v) { return v[0] < 2 ? 1 : 2; });
  const auto build = [&](double young) {
    return build_lattice(volume, {{volume.segments[0], material_from_units(young, 0.3, 1000), 0, ""},
                                  {volume.segments[1], material_from_units(50, 0.4, 1000), 0, ""}});
  };
  Lattice changed = build(200);
  for (VoxelMaterial& m : changed.materials)
    if (m.label == 1) m.material.young /= 2;
  const Lattice expected = build(100);
  for (int level = 0; level < static_cast<int>(expected.levels.size()); ++level) {
    const std::vector<Element> a = form_elements(changed, level), b = form_elements(expected, level);
    ASSERT_EQ(a.size(), b.size());
    for (std::size_t e = 0; e < a.size(); ++e) EXPECT_EQ(a[e].shear, b[e].shear);
  }
}

TEST(GreyValues, AreTakenFromTheScanVoxelByVoxel) {
  const LabelVolume volume = make_volume({3, 1, 1}, {2, 1, 1}, [](const Index3&) { return 1; });
  const IntensityVolume scan{volume.grid, {100, 200, 100}};
  GreyLaw young;
  young.offset = 10;
  young.factor = 0.5;
  const GreyMaterials grey{&scan, {{std::uint16_t{1}, MaterialRule{young, 0.3, 1000.0}}}};
  const Lattice lattice = build_lattice(volume, {{volume.segments[0], Material{}, 0, ""}}, {}, &grey);
  ASSERT_EQ(lattice.materials.size(), 2U);
  EXPECT_EQ(lattice.levels[0].element, (std::vector<std::int32_t>{0, 1, 0}));
  EXPECT_DOUBLE_EQ(lattice.materials[0].material.young, 0.060);
  EXPECT_DOUBLE_EQ(lattice.materials[1].material.young, 0.110);
  EXPECT_NEAR(lattice.segments[0].material->young, (0.060 + 0.110 + 0.060) / 3, 1e-15);
}

TEST(GreyValues, OutOfBoundsOrMissingAreNamed) {
  LabelVolume volume = make_volume({2, 1, 1}, {1, 1, 1}, [](const Index3&) { return 1; });
  volume.segments[0].name = "femur";
  GreyLaw young;
  young.factor = 1;
  const auto build = [&](const IntensityVolume& scan) {
    const GreyMaterials grey{&scan, {{std::uint16_t{1}, MaterialRule{young, 0.3, 1000.0}}}};
    return message_of(ErrorKind::input, [&] {
      build_lattice(volume, {{volume.segments[0], Material{}, 0, ""}}, {}, &grey);
    });
  };
  EXPECT_NE(
      build({volume.grid, {50, -20}}).find("'femur' at grey value -20: young_kpa is -20, expected 1e-06 to 1e+10"),
      std::string::npos);
  EXPECT_NE(build({Grid({1, 1, 1}, {1, 1, 1}), {50}}).find("'femur' has a voxel at (1.0, 0.0, 0.0) mm"),
            std::string::npos);
}

TEST(GreyValues, LawsHaveTheirShapesAndClamps) {
  GreyLaw law;
  law.offset = 1;
  law.factor = 2;
  EXPECT_EQ(law(3), 7);
  law.min = 0;
  law.max = 6;
  EXPECT_EQ(law(3), 6);
  EXPECT_EQ(law(-3), 0);
  law.max.reset();
  law.shape = GreyLaw::Shape::power;
  law.exponent = 2;
  EXPECT_EQ(law(3), 19);
  EXPECT_EQ(law(-3), 1);
  law.shape = GreyLaw::Shape::piecewise;
  law.points = {{0, 1}, {2, 5}, {4, 3}};
  EXPECT_EQ(law(-1), 1);
  EXPECT_EQ(law(1), 3);
  EXPECT_EQ(law(3), 4);
  EXPECT_EQ(law(9), 3);
}

TEST(Merge, CellsAtOneIndexThatAThirdLinksHaveParentsThatShareItsNodes) {
  const std::vector<Index3> cells = {{0, 0, 0}, {0, 0, 0}, {1, 0, 0}};
  const std::vector<CellNodes> nodes = {
      {0, 1, 2, 3, 4, 5, 6, 7}, {8, 1, 9, 3, 10, 5, 11, 7}, {1, 12, 3, 13, 5, 14, 7, 15}};
  const Merge merge = merge_linked_cells(cells, nodes, {2, 2, 2});
  ASSERT_EQ(merge.parents, (std::vector<Index3>{{0, 0, 0}, {0, 0, 0}}));
  EXPECT_EQ(merge.children[0], (Children{0, 2, -1, -1, -1, -1, -1, -1}));
  EXPECT_EQ(merge.children[1], (Children{1, -1, -1, -1, -1, -1, -1, -1}));
}

TEST(Lattice, MixtureIsTheBoundsOfStiffnessInCellsOverEachOther) {
  // Layers of one voxel, ten times as stiff in turn, and the same in layers of four.
  for (const int thickness : {1, 4}) {
    const LabelVolume volume =
        make_volume({8, 8, 8}, {1, 1, 1}, [&](const Index3& v) { return 1 + v[2] / thickness % 2; });
    const Lattice lattice = build_lattice(volume, {{volume.segments[0], material_from_units(10, 0.3, 1000), 0, ""},
                                                   {volume.segments[1], material_from_units(100, 0.3, 1000), 0, ""}});
    const double mixed = (1 + 10) / 2.0 * (1 + 0.1) / 2 - 1;
    EXPECT_EQ(lattice.levels[0].mixture, 0);
    EXPECT_NEAR(lattice.levels[1].mixture, thickness == 1 ? mixed : 0, 1e-12);
    EXPECT_NEAR(lattice.levels[2].mixture, thickness == 1 ? mixed : 0, 1e-12);
  }
}

}  // namespace test_lattice
