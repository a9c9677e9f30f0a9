// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cmath>

#include "hexmesh/file/material_file.h"
#include "hexmesh/lattice/assign.h"
#include "support/bodies.h"
#include "support/files.h"

namespace test_assign {

using namespace hexmesh;
using namespace testing_support;

LabelVolume one_voxel(const std::string& name) {
  LabelVolume volume = make_volume({1, 1, 1}, {1, 1, 1}, [](const Index3&) { return 1; });
  volume.segments[0].name = name;
  return volume;
}

std::map<std::string, MaterialChoice> parse(const std::string& toml) {
  const TemporaryFolder folder;
  write_text(folder / "m.toml", toml);
  return read_materials(folder / "m.toml", "m.toml");
}

std::string error_of(const std::string& toml) {
  return message_of(ErrorKind::input, [&] { parse(toml); });
}

TEST(Assign, ASegmentWithoutMaterialOrKnownTissueIsNamed) {
  const LabelVolume volume = one_voxel("gallbladder");
  EXPECT_NE(message_of(ErrorKind::input, [&] { assign_materials(volume, {}); }).find("'gallbladder'"),
            std::string::npos);
  const std::string unknown = message_of(ErrorKind::input, [&] { assign_materials(volume, {{"spleen", {}}}); });
  EXPECT_NE(unknown.find("unknown segment 'spleen', expected one of: gallbladder"), std::string::npos) << unknown;
  MaterialChoice all;
  all.young_kpa = 5.0;
  all.poisson = 0.4;
  EXPECT_DOUBLE_EQ(assign_materials(volume, {{"*", all}}).segments[0].material->young, 5e-3);
}

TEST(Assign, AllSegmentsWithoutMaterialAreNamedAtOnce) {
  const LabelVolume volume = make_volume({3, 1, 1}, {1, 1, 1}, [](const Index3& v) { return v[0] + 1; });
  const std::string all = message_of(ErrorKind::input, [&] { assign_materials(volume, {}); });
  for (const Segment& s : volume.segments) EXPECT_NE(all.find("'" + s.name + "'"), std::string::npos) << all;
  MaterialChoice bone;
  bone.tissue = "bone";
  const AssignedMaterials assigned = assign_materials(volume, {{"*", bone}});
  EXPECT_EQ(assigned.segments.size(), 3U);
  EXPECT_GT(assigned.segments[2].material->young, 1000) << "MPa";
}

TEST(Assign, OutOfBoundsNamesTheSegment) {
  const LabelVolume volume = one_voxel("liver");
  for (const auto& [young, poisson] : std::vector<std::pair<double, double>>{{0, 0.3}, {-1, 0.3}, {5, 0.5}, {5, -1}}) {
    MaterialChoice choice;
    choice.young_kpa = young;
    choice.poisson = poisson;
    EXPECT_NE(message_of(ErrorKind::input,
                         [&] {
                           assign_materials(volume, {{"liver", choice}});
                         })
                  .find("'liver'"),
              std::string::npos);
  }
}

TEST(Assign, TissuesFillInWhatIsNotGivenAndSaySo) {
  const LabelVolume volume = one_voxel("liver");
  MaterialChoice choice;
  choice.tissue = "muscle";
  choice.poisson = 0.4;
  const AssignedMaterials m = assign_materials(volume, {{"liver", choice}});
  EXPECT_DOUBLE_EQ(m.segments[0].material->young, 12e-3);
  EXPECT_DOUBLE_EQ(m.segments[0].material->poisson, 0.4);
  EXPECT_EQ(m.segments[0].source.find("poisson: given; young_kpa of tissue 'muscle': "), 0U) << m.segments[0].source;
  EXPECT_NE(m.segments[0].source.find("Bensamoun"), std::string::npos);
  EXPECT_EQ(m.notes.size(), 1U);
  choice.tissue.clear();
  choice.young_kpa = 3.0;
  EXPECT_EQ(assign_materials(volume, {{"liver", choice}}).segments[0].source,
            "young_kpa and poisson: given; density_kg_m3: ICRU Report 44 (1989)");
  choice.young_kpa.reset();
  choice.tissue = "cheese";
  EXPECT_NE(message_of(ErrorKind::input,
                       [&] {
                         assign_materials(volume, {{"liver", choice}});
                       })
                .find("unknown tissue 'cheese', expected one of: tumour, vessel"),
            std::string::npos);
}

TEST(MaterialFile, ReadsNumbersTissuesLawsAndNone) {
  const auto choices = parse(
      "[material.liver]\nyoung_kpa = 5\npoisson = 0.3\n"
      "[material.duct]\ntissue = 'vessel'\n"
      "[material.gallbladder]\nnone = true\n"
      "[material.femur]\npoisson = 0.3\n"
      "density_kg_m3 = { offset = 1000, slope = 0.8, min = 300 }\n"
      "young_kpa = { of = 'density_kg_m3', factor = 1e-3, exponent = 1.49 }\n"
      "[material.'rib 1']\nyoung_kpa = { points = [[0, 1], [100, 3]] }\n");
  EXPECT_EQ(std::get<double>(*choices.at("liver").young_kpa), 5);
  EXPECT_EQ(choices.at("duct").tissue, "vessel");
  EXPECT_TRUE(choices.at("gallbladder").none);
  const MaterialRule femur{*choices.at("femur").young_kpa, *choices.at("femur").poisson,
                           *choices.at("femur").density_kg_m3};
  const Material m = femur.at(500);
  EXPECT_NEAR(m.density, 1400e-12, 1e-24);
  EXPECT_NEAR(m.young, 1e-6 * std::pow(1400, 1.49), 1e-15);
  EXPECT_NEAR(femur.at(-5000).density, 300e-12, 1e-24);
  EXPECT_EQ(std::get<GreyLaw>(*choices.at("rib 1").young_kpa)(50), 2);
}

TEST(MaterialFile, MistakesAreNamedWithTheirPlace) {
  EXPECT_NE(error_of("[material.liver]\nyung_kpa = 5\n").find("m.toml:2:1: unknown key 'material.liver.yung_kpa'"),
            std::string::npos);
  EXPECT_NE(error_of("[material.liver]\nyoung_kpa = 'soft'\n").find("m.toml:2:"), std::string::npos);
  EXPECT_NE(error_of("[material.a]\nyoung_kpa = { slope = 1, exponent = 2 }\n").find("this is no law"),
            std::string::npos);
  EXPECT_NE(error_of("[material.a]\nyoung_kpa = { points = [[0, 1], [0, 2]] }\n").find("ascending"), std::string::npos);
  EXPECT_NE(error_of("[material.a]\nyoung_kpa = { slope = 1, min = 2, max = 1 }\n").find("min <= max"),
            std::string::npos);
  EXPECT_NE(error_of("[material.a]\ndensity_kg_m3 = { slope = 1, of = 'density_kg_m3' }\n").find("unknown key"),
            std::string::npos);
  EXPECT_NE(error_of("[material.a]\nnone = true\npoisson = 0.3\n").find("expected it alone"), std::string::npos);
}

/// The manual's bone, by what the papers it names give.
TEST(MaterialFile, TheManualsBoneIsAsStiffAsBone) {
  const std::string page = read_text(std::filesystem::path(HEXTOOLS_SOURCE) / "docs/tasks/materials.md");
  const std::size_t begin = page.find("[material.femur]");
  ASSERT_NE(begin, std::string::npos);
  const MaterialChoice femur = parse(page.substr(begin, page.find("```", begin) - begin)).at("femur");
  const MaterialRule bone{*femur.young_kpa, *femur.poisson, *femur.density_kg_m3};
  for (const double hounsfield : {300, 800, 1500}) {
    const double density = 0.131 + 1.067e-3 * hounsfield;  // g/cm^3
    const Material m = bone.at(hounsfield);
    EXPECT_NEAR(m.density / (density * 1e-9), 1, 1e-3);
    EXPECT_NEAR(m.young / (6850 * std::pow(density, 1.49)), 1, 2e-3);
  }
  EXPECT_GT(bone.at(1500).young, 10e3) << "cortical bone, MPa";
  EXPECT_LT(bone.at(1500).young, 20e3);
}

}  // namespace test_assign
