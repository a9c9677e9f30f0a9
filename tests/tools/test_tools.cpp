// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <nlohmann/json.hpp>
#include <sstream>

#include "hexmesh/file/result_file.h"
#include "support/files.h"

using namespace testing_support;
using nlohmann::json;

namespace {

/// A phantom, its lattice and a scene, made once for all tests of this file.
class Tools : public testing::Test {
protected:
  static void SetUpTestSuite() {
    folder = new TemporaryFolder;
    const std::string at = "cd '" + folder->path("") + "' && ";
    ASSERT_EQ(shell(at + "hexscan phantom liver --spacing 4 --intensity-out ct.nrrd -o liver.nrrd").exit_code, 0);
    ASSERT_EQ(
        shell(at + "hexmesh build liver.nrrd --material '*:young_kpa=100,poisson=0.3' -o liver.hexmesh").exit_code, 0);
    ASSERT_EQ(shell(at + "hexsolve liver.hexmesh --example -o liver.toml").exit_code, 0);
  }
  static void TearDownTestSuite() { delete folder; }

  static CommandResult run(const std::string& command) { return shell("cd '" + folder->path("") + "' && " + command); }

  /// Exit code, exactly one line of error that starts with the tool's name and holds the words, and no new file.
  static void expect_failure(const std::string& command, int code, const std::vector<std::string>& words) {
    const auto before = listing();
    const CommandResult r = run(command);
    EXPECT_EQ(r.exit_code, code) << command << "\n" << r.errors;
    EXPECT_EQ(std::count(r.errors.begin(), r.errors.end(), '\n'), 1) << r.errors;
    EXPECT_EQ(r.errors.find(command.substr(0, command.find(' ')) + ": error: "), 0U) << r.errors;
    for (const std::string& word : words) EXPECT_NE(r.errors.find(word), std::string::npos) << r.errors;
    EXPECT_EQ(r.output, "");
    EXPECT_EQ(listing(), before) << command;
  }

  static std::vector<std::string> listing() {
    std::vector<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(*folder / "")) names.push_back(entry.path().string());
    std::sort(names.begin(), names.end());
    return names;
  }

  static inline TemporaryFolder* folder = nullptr;
};

}  // namespace

TEST_F(Tools, HelpNamesOptionsExitCodesAndAnExample) {
  for (const char* tool : {"hexscan", "hexmesh", "hexsolve", "hexexport", "hexslice", "hexbench"}) {
    const CommandResult r = run(std::string(tool) + " --help");
    EXPECT_EQ(r.exit_code, 0);
    for (const char* word : {"Exit codes", "Example:", "--threads", "--quiet"})
      EXPECT_NE(r.output.find(word), std::string::npos) << tool << " " << word;
    EXPECT_EQ(run(std::string(tool) + " --version").output, "0.1.0\n");
  }
}

TEST_F(Tools, TheExamplesOfTheHelpRun) {
  ASSERT_EQ(run("hexsolve liver.hexmesh liver.toml --level 2 -o liver.hexresult").exit_code, 0);
  for (const char* tool : {"hexscan", "hexmesh", "hexsolve", "hexexport", "hexslice", "hexbench"}) {
    const std::string help = run(std::string(tool) + " --help").output;
    const std::size_t at = help.find("Example:\n  ") + 11;
    std::string example = help.substr(at, help.find('\n', at) - at);
    for (const char* scan : {"ct.nrrd"}) EXPECT_TRUE(std::filesystem::exists(*folder / scan));
    const CommandResult r =
        run("mkdir -p examples && cp liver.nrrd liver.hexmesh liver.toml liver.hexresult ct.nrrd "
            "examples && cd examples && " +
            example + " --force");
    EXPECT_EQ(r.exit_code, 0) << example << "\n" << r.errors;
  }
}

TEST_F(Tools, UsageErrorsExit2) {
  expect_failure("hexscan --colour red -o a.nrrd", 2, {"--help"});
  expect_failure("hexscan -o a.nrrd", 2, {"no input"});
  expect_failure("hexmesh", 2, {"subcommand"});
  expect_failure("hexmesh build liver.nrrd --material liver:young=3 -o a", 2, {"unknown key 'young'", "young_kpa"});
  expect_failure("hexsolve liver.hexmesh -o a", 2, {"SCENE"});
  expect_failure("hexsolve liver.hexmesh liver.toml --set solve -o a", 2, {"key=value"});
  expect_failure("hexexport liver.hexmesh", 2, {"--lattice"});
  expect_failure("hexslice planes x --count 0 -o a", 2, {"--count"});
  expect_failure("hexmesh build liver.nrrd -o liver.nrrd --force", 2, {"also an input"});
}

TEST_F(Tools, BadInputExits3) {
  expect_failure("hexscan missing.nrrd -o a.nrrd", 3, {"missing.nrrd"});
  expect_failure("hexscan liver.nrrd --segment spleen -o a.nrrd", 3, {"'spleen'", "1=liver, 2=tumour, 3=vessel"});
  expect_failure("hexscan ct.nrrd -o a.nrrd", 3, {"whole numbers"});
  expect_failure("hexmesh build liver.toml -o a", 3, {"unknown format"});
  expect_failure("hexmesh build liver.nrrd --material spleen:young_kpa=1,poisson=0.3 -o a", 3, {"'spleen'"});
  expect_failure("hexmesh build liver.nrrd --material liver:poisson=0.5 -o a", 3, {"'liver'", "poisson is 0.5"});
  expect_failure("hexmesh info liver.nrrd", 3, {"HDF5"});
  expect_failure("hexsolve liver.nrrd liver.toml -o a", 3, {"lattice file"});
  expect_failure("hexsolve liver.hexmesh missing.toml -o a", 3, {"missing.toml"});
  expect_failure("hexsolve liver.hexmesh liver.toml --level 29 -o a", 2, {"--level is 29, expected 0 to"});
  expect_failure("hexsolve liver.hexmesh liver.toml --set solve.level=29 -o a", 3, {"solve.level is 29"});
  expect_failure("hexexport liver.hexmesh --level 29 --lattice a.vtu", 3, {"level is 29"});
  expect_failure("hexexport liver.nrrd --lattice a.vtu", 3, {"liver.nrrd", "HDF5"});
  expect_failure("hexslice planes liver.hexmesh -o a", 3, {"hexmesh lattice", "hexmesh result"});
  expect_failure("hexmesh surface liver.hexmesh --segment spleen -o a.stl", 3, {"'spleen'", "liver, tumour, vessel"});
  write_text(*folder / "bad.toml", "[material.liver]\nyoung_kpa = { slope = 'steep' }\n");
  expect_failure("hexmesh build liver.nrrd --materials bad.toml -o a", 3,
                 {"bad.toml:2:", "material.liver.young_kpa.slope"});
}

TEST_F(Tools, InfoSaysWhatAScanHolds) {
  const json info = json::parse(run("hexscan info liver.nrrd --json").output);
  const json& volume = info["inputs"][0];
  EXPECT_EQ(volume["format"], "NRRD");
  EXPECT_EQ(volume["axes"], "LPS");
  EXPECT_EQ(volume["segments"][0]["name"], "liver");
  EXPECT_NEAR(volume["segments"][0]["volume_ml"], volume["segments"][0]["voxels"].get<double>() * 0.064, 1e-9);
  const std::string text = run("hexscan info ct.nrrd").output;
  EXPECT_NE(text.find("grey values: "), std::string::npos) << text;
}

TEST_F(Tools, AZoneOfInterestCleaningAndTheScanGoTogether) {
  const CommandResult r = run(
      "hexscan liver.nrrd --segment liver --segment tumour --roi-mm -30,60,-60,60,-60,60 --fill-cavities --intensity "
      "ct.nrrd --intensity-out zone_ct.nrrd -o zone.nrrd");
  ASSERT_EQ(r.exit_code, 0) << r.errors;
  EXPECT_NE(r.errors.find("segment 'liver', cavities filled: 0 voxels"), std::string::npos) << r.errors;
  const json labels = json::parse(run("hexscan info zone.nrrd --json").output)["inputs"][0];
  const json scan = json::parse(run("hexscan info zone_ct.nrrd --json").output)["inputs"][0];
  EXPECT_EQ(labels["extent"], scan["extent"]);
  EXPECT_EQ(labels["origin_mm"], scan["origin_mm"]);
  EXPECT_GE(labels["origin_mm"][0], -30);
  EXPECT_LE(labels["extent"][0], 23);  // 90 mm of 4 mm voxels
  write_text(*folder / "line.mrk.json", R"({"markups":[{"type":"Line","controlPoints":[{"position":[1,2,3]}]}]})");
  expect_failure("hexscan liver.nrrd --roi-markup line.mrk.json -o a.nrrd", 3, {"line.mrk.json", "ROI"});
  expect_failure("hexscan liver.nrrd --roi-mm 900,901,0,1,0,1 -o a.nrrd", 4, {"zone of interest", "no voxel"});
  expect_failure("hexscan liver.nrrd --roi-mm 9,1,0,1,0,1 -o a.nrrd", 2, {"x0 < x1"});
  expect_failure("hexscan liver.nrrd --intensity ct.nrrd -o a.nrrd", 2, {"--intensity-out"});
  expect_failure("hexscan liver.nrrd --intensity ct.nrrd --intensity-out a.nrrd -o a.nrrd", 2, {"both 'a.nrrd'"});
  expect_failure("hexscan liver.nrrd -o a.nii.gz", 2, {"a.nii.gz", ".nrrd"});
  ASSERT_EQ(run("hexscan phantom box --set shift_x=900 -o far.nrrd").exit_code, 0);
  expect_failure("hexscan far.nrrd --intensity ct.nrrd --intensity-out a.nrrd -o b.nrrd", 4, {"covers none"});
  expect_failure("hexscan liver.nrrd --max-memory 0.1 -o a.nrrd", 3, {"--max-memory", "0.1 MB"});
}

TEST_F(Tools, SurfacesAndLinesBecomeOneLabelledVolume) {
  ASSERT_EQ(run("hexmesh surface liver.hexmesh --segment liver -o body.stl").exit_code, 0);
  write_text(*folder / "wing.obj", "v 0 0 0\nv 0 90 0\nv 0 90 90\nf 1 2 3\n");
  write_text(*folder / "tail.obj", "v 0 0 0\nv -150 10 20\nl 1 2\n");
  const CommandResult r = run("hexscan --input body=body.stl wing.obj tail.obj --spacing 4 -o dragon.nrrd");
  ASSERT_EQ(r.exit_code, 0) << r.errors;
  const json segments = json::parse(run("hexscan info dragon.nrrd --json").output)["inputs"][0]["segments"];
  ASSERT_EQ(segments.size(), 3U);
  EXPECT_EQ(segments[0]["name"], "wing");
  EXPECT_EQ(segments[2]["name"], "body");
  const json liver = json::parse(run("hexscan info liver.nrrd --json").output)["inputs"][0]["segments"][0];
  // The extracted surface is smooth: its body is that of the voxels to a few per cent.
  EXPECT_NEAR(segments[2]["volume_ml"].get<double>() / liver["volume_ml"].get<double>(), 1, 0.05);
  EXPECT_EQ(run("hexmesh build dragon.nrrd --material '*:young_kpa=10,poisson=0.3' -o dragon.hexmesh").exit_code, 0);
  expect_failure("hexscan body.stl -o a.nrrd", 2, {"--spacing"});
}

TEST_F(Tools, MaterialsFollowTheGreyValuesOfTheScan) {
  const std::string build = "hexmesh build liver.nrrd --materials " HEXTOOLS_SOURCE "/examples/materials/liver.toml";
  const CommandResult r = run(build + " --intensity ct.nrrd -o grey.hexmesh --report grey.json");
  ASSERT_EQ(r.exit_code, 0) << r.errors;
  const json liver = json::parse(read_text(*folder / "grey.json"))["segments"][0];
  EXPECT_GT(liver["materials"], 10);
  EXPECT_NEAR(liver["young_kpa"], 6.7, 0.2);  // grey values of 110 +- 12
  EXPECT_EQ(run("hexmesh check grey.hexmesh").exit_code, 0);
  EXPECT_EQ(run("hexsolve grey.hexmesh liver.toml --level 1 -o grey.hexresult").exit_code, 0);
  expect_failure(build + " -o a", 2, {"--intensity"});
}

TEST_F(Tools, ALatticeCanBeLookedAtBeforeItIsSolved) {
  ASSERT_EQ(run("hexexport liver.hexmesh --level 2 --lattice level2.vtu --surface rest.vtp").exit_code, 0);
  ASSERT_EQ(run("hexmesh surface liver.hexmesh --segment tumour -o tumour.stl").exit_code, 0);
  ASSERT_EQ(run("hexmesh build liver.nrrd --embed tumour=tumour.stl --surface liver=500 --surface vessel=0 "
                "-o surfaces.hexmesh --report surfaces.json")
                .exit_code,
            0);
  const json surfaces = json::parse(read_text(*folder / "surfaces.json"))["surfaces"];
  ASSERT_EQ(surfaces.size(), 2U);
  EXPECT_NEAR(surfaces[0]["triangles"], 500, 2);
  write_text(*folder / "far.obj", "v 900 0 0\nv 901 0 0\nv 900 1 0\nf 1 2 3\n");
  expect_failure("hexmesh build liver.nrrd --embed tumour=far.obj -o a", 4, {"far.obj", "(900.0, 0.0, 0.0)", "10 mm"});
}

TEST_F(Tools, CellsHaveTheSizeAskedFor) {
  const CommandResult r = run("hexmesh build liver.nrrd --cell-size 15 -o cells.hexmesh --report cells.json");
  ASSERT_EQ(r.exit_code, 0) << r.errors;
  const json report = json::parse(read_text(*folder / "cells.json"));
  EXPECT_EQ(report["levels"][2]["cell_mm"], json({15.0, 15.0, 15.0}));
}

TEST_F(Tools, ASceneTypoNamesFileLineAndColumn) {
  write_text(*folder / "typo.toml", "[solve]\nkind = \"equilibrium\"\nstrian = \"cauchy\"\n");
  expect_failure("hexsolve liver.hexmesh typo.toml -o a", 3, {"typo.toml:3:1", "solve.strian", "strain"});
}

TEST_F(Tools, GeometryErrorsExit4) {
  expect_failure("hexsolve liver.hexmesh liver.toml --set 'fix.0.point_mm=[-149,-1,-15]' -o a", 4,
                 {"'right end'", "48.5 mm", "max_distance_mm = 5"});
  write_text(*folder / "free.toml", "[[displace]]\npoint_mm = [98, -18, 6]\nby_mm = [0, 0, 5]\nradius_mm = 0\n");
  expect_failure("hexsolve liver.hexmesh free.toml --level 1 -o a", 4, {"missing supports", "free to turn"});
  write_text(*folder / "none.toml", "[solve]\nlevel = 1\n");
  expect_failure("hexsolve liver.hexmesh none.toml -o a", 4, {"held by nothing"});
  write_text(*folder / "both.toml",
             "[[fix]]\nname = 'a'\npoint_mm = [98, -18, 6]\n[[displace]]\nname = 'b'\npoint_mm = [98, -18, 6]\n"
             "by_mm = [0, 0, 5]\n");
  expect_failure("hexsolve liver.hexmesh both.toml --level 1 -o a", 4, {"contradict", "'a'", "'b'"});
}

TEST_F(Tools, NotConvergedExits5AndTheResultSaysSo) {
  // Two patches 200 mm apart pushed 300 mm into and through each other.
  const CommandResult r =
      run("hexsolve liver.hexmesh liver.toml --level 2 --set 'displace.0.by_mm=[-300,0,0]' "
          "--set solve.tolerance=1e-12 --report five.json -o five.hexresult");
  const auto report = nlohmann::json::parse(read_text(*folder / "five.json"));
  EXPECT_EQ(r.exit_code, report["converged"].get<bool>() ? 0 : 5);
  EXPECT_EQ(report["converged"].get<bool>(), report["load_fraction"].get<double>() == 1);
  EXPECT_TRUE(std::filesystem::exists(*folder / "five.hexresult"));
  EXPECT_EQ(nlohmann::json::parse(hexmesh::read_result(*folder / "five.hexresult").report)["converged"],
            report["converged"]);
}

TEST_F(Tools, OutputErrorsExit6AndNothingIsOverwritten) {
  const std::string before = read_text(*folder / "liver.hexmesh");
  expect_failure("hexmesh build liver.nrrd -o liver.hexmesh", 6, {"exists", "--force"});
  EXPECT_EQ(read_text(*folder / "liver.hexmesh"), before);
  expect_failure("hexscan phantom liver -o nowhere/a.nrrd", 6, {"nowhere/a.nrrd"});
}

TEST_F(Tools, APipeAndFilesGiveTheSameNumbers) {
  ASSERT_EQ(run("hexsolve liver.hexmesh liver.toml --level 2 -o files.hexresult").exit_code, 0);
  const CommandResult piped = run(
      "hexscan -q phantom liver --spacing 4 -o - | hexmesh -q build - --material '*:young_kpa=100,poisson=0.3' -o - "
      "| hexsolve -q - liver.toml --level 2 --threads 1 -o - > pipe.hexresult");
  ASSERT_EQ(piped.exit_code, 0) << piped.errors;
  const hexmesh::Result a = hexmesh::read_result(*folder / "files.hexresult");
  const hexmesh::Result b = hexmesh::read_result(*folder / "pipe.hexresult");
  EXPECT_EQ(a.nodes, b.nodes);
  EXPECT_EQ(a.displacement, b.displacement);
  EXPECT_EQ(a.cell_fields, b.cell_fields);
  EXPECT_EQ(a.surface_displacement, b.surface_displacement);
  const CommandResult exported = run("hexexport - --lattice - < files.hexresult");
  EXPECT_NE(exported.output.find("<VTKFile"), std::string::npos);
}

TEST_F(Tools, InfoGivesLevelsAndSegments) {
  const auto info = nlohmann::json::parse(run("hexmesh info liver.hexmesh --json").output);
  EXPECT_EQ(info["segments"][0]["name"], "liver");
  EXPECT_EQ(info["segments"][0]["young_kpa"], 100);
  EXPECT_GT(info["levels"].size(), 3U);
  EXPECT_NE(run("hexmesh info liver.hexmesh").output.find("'liver'"), std::string::npos);
}

TEST_F(Tools, TheReportHasTheKeysThatScriptsRelyOn) {
  ASSERT_EQ(run("hexsolve liver.hexmesh liver.toml --level 3 --report keys.json -o keys.hexresult").exit_code, 0);
  const auto report = nlohmann::json::parse(read_text(*folder / "keys.json"));
  for (const char* key : {"converged",
                          "reason",
                          "newton_iterations",
                          "linear_iterations",
                          "relative_residual",
                          "load_fraction",
                          "constraint_violation_mm",
                          "conditions",
                          "strain_energy_n_mm",
                          "min_jacobian",
                          "inverted_cells",
                          "lattice",
                          "levels",
                          "seconds",
                          "peak_memory_mb",
                          "memory_mb",
                          "effects",
                          "warnings",
                          "free_modes",
                          "error_estimate_mm"})
    EXPECT_TRUE(report.contains(key)) << key;
  EXPECT_EQ(report["conditions"].size(), 4U);
  EXPECT_LE(report["constraint_violation_mm"].get<double>(), 1e-6);
}

TEST_F(Tools, AnAccuracyEndsAtTheFirstLevelThatIsGoodEnough) {
  ASSERT_EQ(run("hexsolve liver.hexmesh liver.toml --accuracy 0.7 --report acc.json -o acc.hexresult").exit_code, 0);
  const json report = json::parse(read_text(*folder / "acc.json"));
  EXPECT_LE(report["error_estimate_mm"]["mean"], 0.7);
  EXPECT_LE(report["error_estimate_mm"]["algebraic"], 0.07);
  EXPECT_GT(report["lattice"]["level"], 0);
  const json& levels = report["levels"];
  ASSERT_GE(levels.size(), 2U);
  EXPECT_GT(levels[levels.size() - 2]["error_mm"]["mean"], 0.7);
  EXPECT_EQ(hexmesh::read_result(*folder / "acc.hexresult").level, report["lattice"]["level"].get<int>());

  // Finer than the scan: the finest level, and no success.
  const CommandResult tight = run("hexsolve liver.hexmesh liver.toml --accuracy 1e-6 -o tight.hexresult");
  EXPECT_EQ(tight.exit_code, 5);
  EXPECT_NE(tight.errors.find("accuracy not reached: the estimated error of level 0 is"), std::string::npos)
      << tight.errors;
  for (const char* value : {"nan", "inf", "0", "-1"})
    expect_failure(fmt::format("hexsolve liver.hexmesh liver.toml --accuracy {} -o no.hexresult", value), 2,
                   {"expected a number > 0"});
  // One point has no limit.
  expect_failure("hexsolve liver.hexmesh liver.toml --set displace.0.radius_mm=0 --accuracy 1 -o point.hexresult", 3,
                 {"single points", "radius > 0"});
}

TEST_F(Tools, ABudgetGivesTheBestLevelThatThereIsTimeFor) {
  ASSERT_EQ(run("hexsolve liver.hexmesh liver.toml --budget 1000 --report much.json -o much.hexresult").exit_code, 0);
  EXPECT_EQ(json::parse(read_text(*folder / "much.json"))["lattice"]["level"], 0);
  ASSERT_EQ(run("hexsolve liver.hexmesh liver.toml --budget 0.001 --report none.json -o none.hexresult").exit_code, 0);
  const json none = json::parse(read_text(*folder / "none.json"));
  EXPECT_EQ(none["levels"].size(), 1U);
  EXPECT_NE(none["warnings"].dump().find("budget_s"), std::string::npos);
  expect_failure("hexsolve liver.hexmesh liver.toml --budget 1 --level 2 -o x.hexresult", 2, {"--budget", "--level"});
}

TEST_F(Tools, WhereMemoryIsShortItTakesLongerOrIsRefused) {
  const CommandResult plan = run("hexsolve liver.hexmesh liver.toml --level 1 --plan --report -");
  ASSERT_EQ(plan.exit_code, 0) << plan.errors;
  const double expected = json::parse(plan.output)["levels"].back()["memory_mb"];
  const CommandResult fast = run("hexsolve liver.hexmesh liver.toml --level 1 -o fast.hexresult --report -");
  const CommandResult lean = run(fmt::format(
      "hexsolve liver.hexmesh liver.toml --level 1 -o lean.hexresult --report - --max-memory {}", 0.95 * expected));
  ASSERT_EQ(fast.exit_code, 0) << fast.errors;
  ASSERT_EQ(lean.exit_code, 0) << lean.errors;
  EXPECT_NE(lean.errors.find("to save memory it takes longer"), std::string::npos) << lean.errors;
  const json of_fast = json::parse(fast.output), of_lean = json::parse(lean.output);
  const double frames_mb = of_fast["lattice"]["cells"].get<double>() * 72 * sizeof(double) / (1 << 20);
  EXPECT_LE(of_lean["memory_mb"]["elasticity"].get<double>(),
            of_fast["memory_mb"]["elasticity"].get<double>() - frames_mb);
  EXPECT_NEAR(of_lean["strain_energy_n_mm"].get<double>(), of_fast["strain_energy_n_mm"].get<double>(),
              1e-8 * of_fast["strain_energy_n_mm"].get<double>());
  expect_failure(
      fmt::format("hexsolve liver.hexmesh liver.toml --level 1 -o none.hexresult --max-memory {}", 0.1 * expected), 3,
      {"--max-memory", "coarser level"});
}

TEST_F(Tools, CheckAndPlanSolveNothing) {
  const auto before = listing();
  const CommandResult check = run("hexsolve liver.hexmesh liver.toml --level 1 --check");
  EXPECT_EQ(check.exit_code, 0) << check.errors;
  EXPECT_NE(check.output.find("condition 'back': "), std::string::npos) << check.output;
  const json plan = json::parse(run("hexsolve liver.hexmesh liver.toml --level 1 --plan --report -").output);
  EXPECT_EQ(plan["levels"].back()["level"], 1);
  EXPECT_GT(plan["levels"].back()["seconds"], 0);
  const auto active = [](const json& effects, const std::string& name) {
    for (const json& e : effects)
      if (e["name"] == name) return e["active"].get<bool>();
    ADD_FAILURE() << name;
    return false;
  };
  EXPECT_TRUE(active(plan["effects"], "rotation"));
  EXPECT_FALSE(active(plan["effects"], "gravity"));
  EXPECT_EQ(listing(), before);
  // The plan's choice of levels is the solution's.
  ASSERT_EQ(run("hexsolve liver.hexmesh liver.toml --level 1 --report did.json -o did.hexresult").exit_code, 0);
  const json did = json::parse(read_text(*folder / "did.json"));
  ASSERT_EQ(did["levels"].size(), plan["levels"].size());
  for (std::size_t n = 0; n < did["levels"].size(); ++n) EXPECT_EQ(did["levels"][n]["dofs"], plan["levels"][n]["dofs"]);
  EXPECT_FALSE(active(did["effects"], "gravity"));
}

TEST_F(Tools, ADeckIsTheSameModel) {
  // As the CalculiX program of Debian solves it, where that is installed.
  ASSERT_EQ(run("sed 's/^radius_mm = 10$/radius_mm = 10\\non = \"nodes\"/' liver.toml > nodes.toml").exit_code, 0);
  ASSERT_EQ(run("hexsolve liver.hexmesh nodes.toml --level 0 --set solve.strain=cauchy --set solve.volumetric=full "
                "-o nodes.hexresult")
                .exit_code,
            0);
  ASSERT_EQ(run("hexexport nodes.hexresult --inp deck.inp").exit_code, 0);
  const std::string deck = read_text(*folder / "deck.inp");
  for (const char* word : {"*NODE, NSET=ALL\n", "*ELEMENT, TYPE=C3D8, ELSET=S1_liver\n", "*ELASTIC\n0.1, 0.3\n",
                           "*STEP\n*STATIC\n*BOUNDARY\n"})
    EXPECT_NE(deck.find(word), std::string::npos) << word;
  expect_failure("hexexport nodes.hexresult --inp deck.txt", 2, {".inp"});
  ASSERT_EQ(run("hexsolve liver.hexmesh liver.toml --level 0 -o faces.hexresult").exit_code, 0);
  expect_failure("hexexport faces.hexresult --inp faces.inp", 3, {"volumetric"});
  ASSERT_EQ(run("hexsolve liver.hexmesh liver.toml --level 0 --set solve.strain=cauchy --set solve.volumetric=full "
                "-o linear.hexresult")
                .exit_code,
            0);
  expect_failure("hexexport linear.hexresult --inp linear.inp", 3, {"condition 'right end'", "on = \"nodes\""});
  ASSERT_EQ(run("hexsolve liver.hexmesh nodes.toml --level 1 --set solve.strain=cauchy --set solve.volumetric=full "
                "-o coarse.hexresult")
                .exit_code,
            0);
  expect_failure("hexexport coarse.hexresult --inp coarse.inp", 3, {"partly filled", "level 0"});

  if (run("command -v ccx").exit_code != 0) GTEST_SKIP() << "no ccx on this machine";
  ASSERT_EQ(run("OMP_NUM_THREADS=1 ccx -i deck").exit_code, 0);
  const hexmesh::Result ours = hexmesh::read_result(*folder / "nodes.hexresult");
  std::istringstream rows(read_text(*folder / "deck.dat"));
  std::string line;
  std::size_t compared = 0;
  while (std::getline(rows, line)) {
    std::istringstream values(line);
    std::size_t node = 0;
    hexmesh::Vec3 u;
    if (!(values >> node >> u[0] >> u[1] >> u[2])) continue;
    ASSERT_LE(node, ours.nodes.size());
    EXPECT_LT((ours.displacement[node - 1] - u).norm(), 1e-4) << "node " << node;
    ++compared;
  }
  EXPECT_EQ(compared, ours.nodes.size());
}

TEST_F(Tools, TheNumberOfThreadsChangesNoDigit) {
  for (const char* strain : {"cauchy", "corotational"}) {
    for (const char* threads : {"1", "2"})
      ASSERT_EQ(run(fmt::format("hexsolve liver.hexmesh liver.toml --level 1 --threads {0} --set solve.strain={1} "
                                "-o {1}{0}.hexresult",
                                threads, strain))
                    .exit_code,
                0);
    const hexmesh::Result a = hexmesh::read_result(*folder / fmt::format("{}1.hexresult", strain));
    const hexmesh::Result b = hexmesh::read_result(*folder / fmt::format("{}2.hexresult", strain));
    EXPECT_EQ(a.displacement, b.displacement);
    EXPECT_EQ(a.cell_fields, b.cell_fields);
  }
}

TEST_F(Tools, AMotionIsKeptStreamedAndGoesOnFromAResult) {
  const std::string scene = R"([solve]
kind = "dynamics"
[[fix]]
point_mm = [-101, -6, -8]
radius_mm = 20
[gravity]
m_s2 = [0, 0, -9.81]
[dynamics]
step_s = 0.02
duration_s = 0.2
output_every = 4
solver = "jacobi"
solver_iterations = 10
)";
  write_text(*folder / "sway.toml", scene);
  const CommandResult r =
      run("hexsolve liver.hexmesh sway.toml --level 2 -o sway.hexresult --stream --report sway.json");
  ASSERT_EQ(r.exit_code, 0) << r.errors;
  const json report = json::parse(read_text(*folder / "sway.json"));
  EXPECT_EQ(report["kind"], "dynamics");
  EXPECT_EQ(report["motion"]["steps"], 10);
  ASSERT_EQ(report["motion"]["rows"].size(), 4U);  // 0, 4, 8, 10
  EXPECT_GT(report["motion"]["rows"][3]["kinetic_n_mm"].get<double>(), 0);
  EXPECT_GT(report["steps_per_second"].get<double>(), 0);
  const hexmesh::Result result = hexmesh::read_result(*folder / "sway.hexresult");
  EXPECT_EQ(result.times, (std::vector<double>{0, 0.08, 0.16, 0.2}));
  EXPECT_EQ(hexmesh::read_step(*folder / "sway.hexresult", result, 3).displacement, result.displacement);

  // The stream: its last frame is the surface of the result.
  std::istringstream stream(r.output);
  std::string word;
  std::size_t points = 0, triangles = 0;
  stream >> word >> word >> word >> points >> word >> triangles;
  EXPECT_EQ(points, result.surface.points.size());
  const std::size_t frame = 8 + 12 * points, head = r.output.find("\n\n") + 2 + 12 * triangles;
  ASSERT_EQ(r.output.size(), head + 11 * frame);
  double time = 0;
  std::vector<float> positions(3 * points);
  std::memcpy(&time, &r.output[head + 10 * frame], 8);
  std::memcpy(positions.data(), &r.output[head + 10 * frame + 8], 12 * points);
  EXPECT_EQ(time, result.times.back());
  for (std::size_t p = 0; p < points; ++p)
    for (int d = 0; d < 3; ++d)
      ASSERT_NEAR(positions[3 * p + static_cast<std::size_t>(d)],
                  result.surface.points[p][d] + result.surface_displacement[p][d], 1e-4);

  ASSERT_EQ(run("hexexport sway.hexresult --surface sway.pvd --lattice cells.pvd").exit_code, 0);
  EXPECT_NE(read_text(*folder / "sway.pvd").find("timestep=\"0.16\" part=\"0\" file=\"sway/sway_0002.vtp\""),
            std::string::npos);
  for (const char* file : {"sway/sway_0003.vtp", "cells/cells_0000.vtu"})
    EXPECT_TRUE(std::filesystem::exists(*folder / file)) << file;

  ASSERT_EQ(run("hexsolve -q liver.hexmesh sway.toml --level 2 -o - | hexexport -q - --surface piped.vtp").exit_code,
            0);
  // Half of it, and the other half from there.
  ASSERT_EQ(run("hexsolve liver.hexmesh sway.toml --level 2 -o half.hexresult --set dynamics.duration_s=0.1").exit_code,
            0);
  ASSERT_EQ(run("hexsolve liver.hexmesh sway.toml --level 2 -o rest.hexresult --set dynamics.duration_s=0.1 "
                "--set dynamics.start=half.hexresult")
                .exit_code,
            0);
  EXPECT_EQ(hexmesh::read_result(*folder / "rest.hexresult").displacement, result.displacement);

  // A reader that leaves does not take the result with it.
  const CommandResult left =
      run("bash -c 'hexsolve liver.hexmesh sway.toml --level 2 --stream -o left.hexresult | head -c 100 > /dev/null; "
          "exit ${PIPESTATUS[0]}'");
  EXPECT_EQ(left.exit_code, 0) << left.errors;
  EXPECT_NE(left.errors.find("the motion goes on to its file"), std::string::npos) << left.errors;
  EXPECT_EQ(hexmesh::read_result(*folder / "left.hexresult").displacement, result.displacement);
  expect_failure("hexsolve liver.hexmesh sway.toml --accuracy 1 -o y.hexresult", 2,
                 {"--accuracy goes with an equilibrium"});
  expect_failure("hexexport sway.hexresult --inp sway.inp", 3, {"the result is a motion"});
  expect_failure("hexexport sway.hexresult --lattice z.pvd --surface z.pvd", 2, {"expected two names"});
  expect_failure("hexsolve liver.hexmesh sway.toml -o y.hexresult --report sway.json", 6, {"sway.json"});
  expect_failure("hexsolve liver.hexmesh liver.toml --stream", 2, {"--stream goes with a motion"});
  expect_failure("hexsolve liver.hexmesh sway.toml --level 2 --stream --report -", 2, {"takes standard output"});
  expect_failure("hexsolve liver.hexmesh sway.toml --level 1 -o x --set dynamics.start=half.hexresult", 3,
                 {"expected a result of this lattice at level 1"});
  EXPECT_NE(run("hexsolve liver.hexmesh sway.toml --plan --level 2").output.find("on   inertia"), std::string::npos);
  EXPECT_NE(run("hexsolve liver.hexmesh sway.toml --check --level 2").output.find("a motion"), std::string::npos);
}

TEST_F(Tools, AnInterruptedRunLeavesNoFile) {
  const auto before = listing();
  run("timeout -s INT 0.3 hexscan phantom liver --spacing 0.5 -o late.nrrd");
  EXPECT_EQ(listing(), before);
}

TEST_F(Tools, EveryExampleSceneConverges) {
  std::size_t scenes = 0;
  for (const auto& entry : std::filesystem::directory_iterator(HEXTOOLS_SOURCE "/examples")) {
    if (entry.path().extension() != ".toml") continue;
    ++scenes;
    const CommandResult r =
        run("hexsolve liver.hexmesh '" + entry.path().string() + "' --level 1 --force -o example.hexresult");
    EXPECT_EQ(r.exit_code, 0) << entry.path() << "\n" << r.errors;
  }
  EXPECT_GE(scenes, 3U);
}

TEST(Demo, TheLiverExperimentRunsFromScanToPictures) {
  const TemporaryFolder folder;
  const CommandResult r =
      shell("'" HEXTOOLS_SOURCE "/pipelines/liver.sh' --levels '3 2' -o '" + folder.path("demo") + "'");
  ASSERT_EQ(r.exit_code, 0) << r.errors;
  for (const char* file : {"demo/pictures-nu0.3/axial_2.png", "demo/pictures-nu0.4/sagittal_1.png",
                           "demo/nu0.3-level2.vtu", "demo/nu0.4-level2.vtp", "demo/pipe.vtu", "demo/summary.txt"})
    EXPECT_TRUE(std::filesystem::exists(folder / file)) << file;
}

TEST(Executables, HexsolveLinksNoImageLibrary) {
  const CommandResult r = shell("ldd \"$(command -v hexsolve)\"");
  for (const char* library : {"libitk", "libITK", "libvtk", "libCGAL"})
    EXPECT_EQ(r.output.find(library), std::string::npos) << library;
  EXPECT_NE(r.output.find("libhdf5"), std::string::npos);
}
