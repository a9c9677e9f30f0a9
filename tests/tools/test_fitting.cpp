// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "hexmesh/file/result_file.h"
#include "support/files.h"
#include "tools_fixture.h"

namespace test_fitting {

using hexmesh::Result;
using hexmesh::Vec3;
using namespace testing_support;
using nlohmann::json;

class Fitting : public Tools {
protected:
  /// A deformation that the fit knows nothing of: another law, held and pulled elsewhere, pushed.
  void deform() const {
    write_text(*folder / "truth.toml",
               "[solve]\nlaw = \"neo-hookean\"\n[material.liver]\nyoung_kpa = 4\npoisson = 0.45\n"
               "[[fix]]\npoint_mm = [-50.5, 49, -12.5]\nradius_mm = 30\n"
               "[[displace]]\npoint_mm = [101, -15.5, 11.5]\nradius_mm = 15\nby_mm = [-15, -20, -28]\n"
               "[[force]]\npoint_mm = [-100, -3.5, -12.5]\nradius_mm = 25\nnewton = [0.08, -0.12, 0.04]\n");
    const CommandResult r =
        run("hexsolve -q liver.hexmesh truth.toml --level 0 --force -o truth.hexresult && "
            "hexexport -q truth.hexresult --force --segmentation now.seg.nrrd --surface now.stl");
    ASSERT_EQ(r.exit_code, 0) << r.errors;
  }
  json read_json(const char* name) const { return json::parse(read_text(*folder / name)); }
};

/// Mean over the nodes of the distance of two solutions of one level.
double distance(const Result& a, const Result& b) {
  double sum = 0;
  for (std::size_t n = 0; n < a.nodes.size(); ++n) sum += (a.displacement[n] - b.displacement[n]).norm();
  return sum / static_cast<double>(a.nodes.size());
}

TEST_F(Fitting, ADeformedSegmentationGivesTheDisplacementInside) {
  deform();
  const CommandResult fit = run(
      "hexfit liver.hexmesh now.seg.nrrd --level 0 --no-spread --set 'solve.error_estimate=\"off\"' --report fit.json "
      "-o fit.hexresult");
  ASSERT_EQ(fit.exit_code, 0) << fit.errors;
  const Result truth = hexmesh::read_result(*folder / "truth.hexresult");
  const Result found = hexmesh::read_result(*folder / "fit.hexresult");
  const json report = read_json("fit.json");
  Result rigid = found;
  for (std::size_t n = 0; n < rigid.nodes.size(); ++n)
    for (std::size_t row = 0; row < 3; ++row) {
      const json& r = report["pose"][row];
      const Vec3& x = rigid.nodes[n];
      rigid.displacement[n][static_cast<Eigen::Index>(row)] = r[0].get<double>() * x[0] + r[1].get<double>() * x[1] +
                                                              r[2].get<double>() * x[2] + r[3].get<double>() -
                                                              x[static_cast<Eigen::Index>(row)];
    }
  EXPECT_LT(distance(found, truth), 1.5);
  EXPECT_LT(distance(found, truth), 0.35 * distance(rigid, truth)) << "what a rigid motion leaves";
  EXPECT_EQ(report["inverted_voxels"], 0);
  EXPECT_EQ(report["matches"].size(), 3U) << "each segment on its own";
  EXPECT_LT(report["matches"][0]["distance"]["mean_mm"], 0.5);
}

TEST_F(Fitting, TheSceneOfAFitGivesTheSameBits) {
  deform();
  write_text(*folder / "m.mrk.json", R"({"markups": [{"type": "Fiducial", "coordinateSystem": "LPS", "controlPoints": [
    {"position": [-60, 0, 0]}]}]})");
  const CommandResult fit =
      run("hexfit liver.hexmesh now.seg.nrrd --segment liver --level 1 --trust 0.5 --outliers 20 --landmarks "
          "m.mrk.json m.mrk.json --write-scene fit.toml -o "
          "first.hexresult && hexsolve liver.hexmesh fit.toml --threads 1 -o again.hexresult");
  ASSERT_EQ(fit.exit_code, 0) << fit.errors;
  const Result a = hexmesh::read_result(*folder / "first.hexresult"),
               b = hexmesh::read_result(*folder / "again.hexresult");
  EXPECT_EQ(a.displacement, b.displacement);
  EXPECT_NE(fit.errors.find("with Poisson's ratio"), std::string::npos) << fit.errors;
  EXPECT_EQ(run("hexsolve liver.hexmesh fit.toml --plan && hexsolve liver.hexmesh fit.toml --check").exit_code, 0);
}

/// What the lattice does not have is left out, what a scene matches already stays.
TEST_F(Fitting, SegmentsGoByTheirNamesAndScenesKeepTheirMatches) {
  deform();
  write_text(*folder / "n.mrk.json", R"({"markups": [{"type": "Fiducial", "coordinateSystem": "LPS", "controlPoints": [
    {"position": [-60, 0, 0]}]}]})");
  write_text(*folder / "more.toml", "[[match]]\nname = \"mark\"\nfrom = \"n.mrk.json\"\nto = \"n.mrk.json\"\n");
  const CommandResult r = run(
      "hexmesh build -q liver.nrrd --segment liver --material liver:young_kpa=3,poisson=0.45 -o only.hexmesh && hexfit "
      "only.hexmesh now.seg.nrrd --level 2 --scene more.toml --report only.json -o only.hexresult");
  ASSERT_EQ(r.exit_code, 0) << r.errors;
  EXPECT_NE(r.errors.find("'tumour' of the segmentation is none of the lattice's"), std::string::npos) << r.errors;
  const json report = read_json("only.json");
  ASSERT_EQ(report["matches"].size(), 2U);
  EXPECT_EQ(report["matches"][0]["name"], "mark");
  EXPECT_EQ(report["spread"].size(), 1U) << "one material has no contrast";
}

TEST_F(Fitting, ASegmentationOfTheBodyItselfMovesNothing) {
  const CommandResult fit = run("hexfit liver.hexmesh liver.nrrd --level 1 --no-spread -o same.hexresult");
  ASSERT_EQ(fit.exit_code, 0) << fit.errors;
  for (const Vec3& u : hexmesh::read_result(*folder / "same.hexresult").displacement) ASSERT_LT(u.norm(), 1e-6);
}

TEST_F(Fitting, WhatIsNoTargetIsToldInOneLine) {
  const std::string to = " -o no.hexresult";
  expect_failure("hexfit liver.hexmesh" + to, 2, {"no target", "--landmarks"});
  expect_failure("hexfit liver.hexmesh liver.nrrd --segment spleen" + to, 3, {"spleen"});
  write_text(*folder / "empty.off", "OFF\n0 0 0\n");
  expect_failure("hexfit liver.hexmesh empty.off" + to, 3, {"empty.off"});
  write_text(*folder / "patch.off", "OFF\n3 1 0\n0 0 0\n20 0 0\n0 20 0\n3 0 1 2\n");
  expect_failure("hexfit liver.hexmesh patch.off" + to, 3, {"names no segment", "liver, tumour, vessel"});
  expect_failure("hexfit liver.hexmesh patch.off --body liver --largest-component" + to, 2, {"no target is one"});
  expect_failure("hexfit liver.hexmesh liver.nrrd --body liver" + to, 2, {"--body", "3 segments"});
  expect_failure("hexfit liver.hexmesh patch.off --body spleen" + to, 3, {"spleen", "liver, tumour, vessel"});
  const std::string marks = R"({"markups": [{"type": "Fiducial", "coordinateSystem": "LPS", "controlPoints": [)";
  write_text(*folder / "one.mrk.json", marks + R"({"position": [0, 0, 0]}]}]})");
  write_text(*folder / "two.mrk.json", marks + R"({"position": [0, 0, 0]}, {"position": [9, 0, 0]}]}]})");
  expect_failure("hexfit liver.hexmesh --landmarks one.mrk.json two.mrk.json" + to, 3, {"1 points", "2 in"});
  expect_failure("hexfit liver.hexmesh liver.nrrd --set solve.strain=cauchy" + to, 3, {"cauchy"});
  expect_failure("hexfit liver.hexmesh liver.nrrd --write-scene -" + to, 2, {"--write-scene"});
  write_text(*folder / "both.toml", "[[match]]\nsurface = \"x.hexsurface\"\nfrom = \"one.mrk.json\"\n");
  expect_failure("hexsolve liver.hexmesh both.toml" + to, 3, {"x.hexsurface"});
  write_text(*folder / "half.toml", "[[match]]\nfrom = \"one.mrk.json\"\n");
  expect_failure("hexsolve liver.hexmesh half.toml" + to, 3, {"half.toml:1", "from and to"});
  EXPECT_FALSE(std::filesystem::exists(*folder / "no.hexresult"));
}

/// Another organ: nothing is called a solution that is far off, and what there is is told.
TEST_F(Fitting, AnotherBodyEndsWithWhatIsLeft) {
  const CommandResult r =
      run("hexscan -q phantom sheet --set length=300 --set width=300 --set height=16 --spacing 8 -o sheet.nrrd && "
          "hexfit liver.hexmesh sheet.nrrd --body liver --level 3 --trust 5 --no-spread --set solve.error_estimate=off "
          "-o sheet.hexresult");
  EXPECT_EQ(r.exit_code, 5) << r.errors;
  EXPECT_NE(r.errors.find("mm"), std::string::npos) << r.errors;
}

TEST_F(Fitting, LungsOfTwoBreathingStates) {
  const std::filesystem::path data = shared_data() / "data/itkelastix-lung";
  if (!std::filesystem::exists(data)) GTEST_SKIP() << "needs the lungs of the shared data";
  const std::string before = (data / "CT_3D_lung_fixed_mask.mha").string();
  const std::string now = (data / "CT_3D_lung_moving_mask.mha").string();
  const CommandResult r = run(
      "hexmesh build -q '" + before +
      "' --segment 1=lung --material lung:young_kpa=3,poisson=0.3 -o lung.hexmesh && hexfit "
      "lung.hexmesh '" +
      now +
      "' --segment 1=lung --level 3 --no-spread --set solve.error_estimate=off --report lung.json -o lung.hexresult");
  ASSERT_EQ(r.exit_code, 0) << r.errors;
  const json report = read_json("lung.json");
  EXPECT_LT(report["matches"][0]["distance"]["mean_mm"], 1);
  EXPECT_EQ(report["inverted_voxels"], 0);
  EXPECT_GT(report["min_jacobian"], 0);
}

}  // namespace test_fitting
