// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <regex>

#include "hexmesh/core/grid.h"
#include "hexmesh/file/result_file.h"
#include "tools_fixture.h"

namespace test_tools {

using hexmesh::Vec3;
using namespace testing_support;
using nlohmann::json;

Vec3 mean_of(const std::vector<Vec3>& vectors) {
  Vec3 sum = Vec3::Zero();
  for (const Vec3& v : vectors) sum += v;
  return sum / static_cast<double>(vectors.size());
}

TEST_F(Tools, HelpNamesOptionsExitCodesAndAnExample) {
  for (const char* tool : {"hexscan", "hexmesh", "hexsolve", "hexfit", "hexexport", "hexslice", "hexbench"}) {
    const CommandResult r = run(std::string(tool) + " --help");
    EXPECT_EQ(r.exit_code, 0);
    for (const char* word : {"Exit codes", "Example:", "--threads", "--quiet"})
      EXPECT_NE(r.output.find(word), std::string::npos) << tool << " " << word;
    const std::string version = run(std::string(tool) + " --version").output;
    EXPECT_TRUE(
        std::regex_match(version, std::regex(tool + std::string(R"( \d+\.\d+\.\d+( \([0-9a-f]{7,}(-dirty)?\))?\n)"))))
        << version;
  }
}

TEST_F(Tools, TheExamplesOfTheHelpRun) {
  ASSERT_EQ(run("hexsolve liver.hexmesh liver.toml --level 2 -o liver.hexresult").exit_code, 0);
  for (const char* tool : {"hexscan", "hexmesh", "hexsolve", "hexfit", "hexexport", "hexslice", "hexbench"}) {
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
  expect_failure("hexsolve liver.hexmesh liver.toml -o a.vtu", 2, {"'a.vtu' would be no .vtu", ".hexresult"});
  expect_failure("hexsolve liver.hexmesh liver.toml --level 2 --set solve.level=1 -o a", 2,
                 {"solve.level=1", "--level"});
  expect_failure("hexsolve liver.hexmesh liver.toml --example", 2, {"excludes"});
  expect_failure("hexslice volume liver.hexresult --view left --direction 1,0,0 -o a.png", 2, {"excludes"});
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
  expect_failure("hexscan phantom box --set width=40 length=80 -o a.nrrd", 2, {"length=80", "not expected"});
  ASSERT_EQ(run("hexscan phantom box --set shift_x=900 -o far.nrrd").exit_code, 0);
  expect_failure("hexscan far.nrrd --intensity ct.nrrd --intensity-out a.nrrd -o b.nrrd", 4, {"covers none"});
  expect_failure("hexscan liver.nrrd --max-memory 0.1 -o a.nrrd", 3, {"--max-memory", "0.1 MB"});
}

TEST_F(Tools, NoToolTakesMoreMemoryThanItMay) {
  const auto before = listing();
  const std::string limited = "hexscan phantom box --spacing 0.25 -o large.nrrd --max-memory ";
  expect_failure(limited + "20", 3, {"--max-memory", "20 MB"});
  ASSERT_EQ(run("hexscan phantom box --spacing 0.5 -o large.nrrd").exit_code, 0);
  const std::string build =
      "hexmesh build large.nrrd --material '*:young_kpa=3,poisson=0.3' -o large.hexmesh --report -";
  const CommandResult built = run(build);
  ASSERT_EQ(built.exit_code, 0) << built.errors;
  const double peak = json::parse(built.output)["peak_memory_mb"];
  expect_failure(build + fmt::format(" --force --max-memory {}", peak / 3), 3, {"--max-memory"});
  const CommandResult again = run(build + fmt::format(" --force --max-memory {}", 1.5 * peak));
  EXPECT_EQ(again.exit_code, 0) << again.errors;
  EXPECT_LT(json::parse(again.output)["peak_memory_mb"], 1.5 * peak);
  // Threads' stacks, and threads of libraries, where nearly nothing is left.
  ASSERT_EQ(run("hexsolve -q liver.hexmesh liver.toml --level 1 -o small.hexresult").exit_code, 0);
  for (const char* command :
       {"hexsolve liver.hexmesh liver.toml --level 1 -o many.hexresult", "hexexport small.hexresult --html many.html",
        "hexexport small.hexresult --transform many.h5", "hexslice volume small.hexresult -o many.png"})
    for (const int megabytes : {1, 20}) {
      const CommandResult r = run(fmt::format("{} --threads 16 --max-memory {}", command, megabytes));
      EXPECT_TRUE(r.exit_code == 0 || (r.exit_code == 3 && std::count(r.errors.begin(), r.errors.end(), '\n') == 1))
          << r.exit_code << ", " << command << "\n"
          << r.errors;
      run("rm -f many.*");
    }
  run("rm small.hexresult large.*");
  EXPECT_EQ(listing(), before);
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
  expect_failure("hexsolve liver.hexmesh both.toml --level 1 -o a", 4, {"incompatible", "'a'", "'b'"});
}

TEST_F(Tools, NotConvergedExits5AndTheResultSaysSo) {
  // Pressed by more than half its length: a law that gets weaker below 0.58 of it has no solution there.
  const CommandResult r =
      run("hexsolve liver.hexmesh liver.toml --level 2 --set 'displace.0.by_mm=[-120,0,0]' "
          "--set solve.strain=green-lagrange --set solve.volumetric=full --report five.json -o five.hexresult");
  EXPECT_EQ(r.exit_code, 5) << r.errors;
  const auto report = nlohmann::json::parse(read_text(*folder / "five.json"));
  EXPECT_FALSE(report["converged"]);
  EXPECT_GT(report["load_fraction"], 0);
  EXPECT_LT(report["load_fraction"], 1);
  EXPECT_LE(report["relative_residual"], report["tolerance"]) << "the state that is kept is an equilibrium";
  const hexmesh::Result kept = hexmesh::read_result(*folder / "five.hexresult");
  EXPECT_FALSE(nlohmann::json::parse(kept.report)["converged"]);
  EXPECT_NEAR(mean_of(kept.conditions.back().displacement)[0], -120 * report["load_fraction"].get<double>(), 0.1);
}

TEST_F(Tools, OutputErrorsExit6AndNothingIsOverwritten) {
  const CommandResult full = run("bash -c \"trap '' XFSZ; ulimit -f 8; hexmesh build liver.nrrd -o full\"");
  EXPECT_EQ(full.exit_code, 6) << full.errors;
  EXPECT_NE(full.errors.find("into 'full': File too large"), std::string::npos) << full.errors;
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
  EXPECT_EQ(a.labels, b.labels);
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

TEST_F(Tools, AnInterruptedRunLeavesNoFile) {
  const auto before = listing();
  EXPECT_EQ(run("timeout --preserve-status -s INT 0.3 hexscan phantom liver --spacing 0.5 -o late.nrrd").exit_code,
            130);
  EXPECT_EQ(listing(), before);
}

TEST_F(Tools, TheExampleOfAThinOrASmallBodyCanBeSolved) {
  for (const auto& [solid, spacing, pull] : {std::tuple{"beam --set length=160 --set width=12 --set height=12", 2, "5"},
                                             std::tuple{"box --set length=12 --set width=9 --set height=9", 1, "3"}}) {
    const CommandResult r =
        run(fmt::format("hexscan phantom {} --spacing {} -o thin.nrrd --force && hexmesh build thin.nrrd --material "
                        "'*:tissue=liver' -o thin.hexmesh --force && "
                        "hexsolve thin.hexmesh --example -o thin.toml --force && head -1 thin.toml && "
                        "hexsolve -q thin.hexmesh thin.toml --level 0 -o thin.hexresult --force",
                        solid, spacing));
    EXPECT_EQ(r.exit_code, 0) << r.errors;
    EXPECT_NE(r.output.find(fmt::format("pulled by {} mm", pull)), std::string::npos) << r.output;
  }
}

TEST_F(Tools, VoxelsOfAThinSurfaceThatMissItsVolumeAreTold) {
  // A box of 60 x 40 x 30 mm with walls of 1.4 mm; the same without its lid; and a solid one.
  const auto box = [](double low, const Vec3& high, int first, bool inwards, int triangles) {
    std::string points, faces;
    for (int n = 0; n < 8; ++n)
      points += fmt::format("v {} {} {}\n", n & 1 ? high[0] : low, n & 2 ? high[1] : low, n & 4 ? high[2] : low);
    const std::array<std::array<int, 3>, 12> all = {{{0, 2, 1},
                                                     {1, 2, 3},
                                                     {4, 5, 6},
                                                     {5, 7, 6},
                                                     {0, 1, 4},
                                                     {1, 5, 4},
                                                     {2, 6, 3},
                                                     {3, 6, 7},
                                                     {0, 4, 2},
                                                     {2, 4, 6},
                                                     {1, 3, 5},
                                                     {3, 7, 5}}};
    for (int n = 0; n < triangles; ++n) {
      const auto& t = all[static_cast<std::size_t>(n)];
      faces += fmt::format("f {} {} {}\n", first + t[0], first + t[inwards ? 2 : 1], first + t[inwards ? 1 : 2]);
    }
    return points + faces;
  };
  const Vec3 outer(60, 40, 30), inner(58.6, 38.6, 28.6);
  write_text(*folder / "wall.obj", box(0, outer, 1, false, 12) + box(1.4, inner, 9, true, 12));
  write_text(*folder / "lid.obj", box(0, outer, 1, false, 10));
  write_text(*folder / "solid.obj", box(0, outer, 1, false, 12));
  EXPECT_NE(run("hexscan wall.obj --spacing 1 -o wall.nrrd").errors.find("coarse for it"), std::string::npos);
  EXPECT_NE(run("hexscan lid.obj --spacing 1 -o lid.nrrd").errors.find("follow --spacing"), std::string::npos);
  EXPECT_EQ(run("hexscan solid.obj --spacing 1 -o solid.nrrd").errors.find("warning"), std::string::npos);
}

TEST_F(Tools, TheSameRunIsTheSameBytes) {
  // A second later, with another number of threads; results are left out, as they tell what they cost.
  const std::string chain =
      " && cd bytes && "
      "hexscan phantom liver --spacing 8 --intensity-out ct.nrrd -o l.nrrd && hexmesh build l.nrrd -o l.hexmesh && "
      "hexsolve l.hexmesh ../liver.toml --level 0 -o l.hexresult && "
      "hexexport l.hexresult --lattice l.vtu --surface l.vtp --conditions c.vtp --csv n.csv --scan ct.nrrd "
      "--to moved.nrrd --segmentation l.seg.nrrd --transform to_rest.h5 --transform-points from_rest.nrrd && "
      "hexexport l.hexresult --lattice l.hdf --surface l.stl && hexslice planes l.hexresult --scan ct.nrrd -o planes "
      "&& hexslice volume l.hexresult -o volume.png && rm l.hexresult && cd ..";
  const CommandResult r = run("mkdir bytes" + chain +
                              " && mv bytes first && sleep 1.1 && export OMP_NUM_THREADS=1 && "
                              "mkdir bytes" +
                              chain + " && diff -r bytes first && ls bytes | wc -l");
  EXPECT_EQ(r.exit_code, 0) << r.output << r.errors;
  EXPECT_EQ(r.output, "15\n");
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
      shell("'" HEXTOOLS_SOURCE "/pipelines/liver.sh' --paper --levels '3 2' -o '" + folder.path("demo") + "'");
  ASSERT_EQ(r.exit_code, 0) << r.errors;
  for (const char* nu : {"0.3", "0.4"}) {
    const std::string name = fmt::format("demo/nu{}", nu);
    double energy = 1e300;
    for (const int level : {3, 2}) {
      const auto report = nlohmann::json::parse(read_text(folder / fmt::format("{}-level{}.json", name, level)));
      EXPECT_TRUE(report["converged"]);
      EXPECT_EQ(report["lattice"]["level"], level);
      EXPECT_LT(report["strain_energy_n_mm"], energy) << "smaller cells are softer";
      energy = report["strain_energy_n_mm"];
      const hexmesh::Result result = hexmesh::read_result(folder / fmt::format("{}-level{}.hexresult", name, level));
      EXPECT_NEAR(mean_of(result.conditions.back().displacement).norm(), 40, 0.1);
    }
    for (const char* picture : {"axial_1", "axial_2", "sagittal_1", "coronal_2", "volume"}) {
      const std::string bytes = read_text(folder / fmt::format("demo/pictures-nu{}/{}.png", nu, picture));
      EXPECT_EQ(bytes.rfind("\x89PNG", 0), 0U) << picture;
      EXPECT_GT(bytes.size(), 10000U) << "one colour takes less: " << picture;
    }
    EXPECT_NE(read_text(folder / fmt::format("{}-level2.vtp", name)).find("displacement"), std::string::npos);
    EXPECT_NE(read_text(folder / fmt::format("demo/report-nu{}.html", nu)).find("left end"), std::string::npos);
  }
  EXPECT_EQ(read_text(folder / "demo/pipe.vtu"), read_text(folder / "demo/nu0.3-level3.vtu"));
  std::istringstream summary(read_text(folder / "demo/summary.txt"));
  std::size_t rows = 0;
  for (std::string line; std::getline(summary, line);) ++rows;
  EXPECT_EQ(rows, 5U);
}

TEST(Executables, HexsolveLinksNoImageLibrary) {
  const CommandResult r = shell("ldd \"$(command -v hexsolve)\"");
  for (const char* library : {"libitk", "libITK", "libvtk", "libCGAL"})
    EXPECT_EQ(r.output.find(library), std::string::npos) << library;
  EXPECT_NE(r.output.find("libhdf5"), std::string::npos);
}

}  // namespace test_tools
