// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <nlohmann/json.hpp>

#include "hexmesh/file/result_file.h"
#include "hexmesh/scan/image_io.h"
#include "hexmesh/view/canvas.h"
#include "tools_fixture.h"

namespace test_motion_outputs {

using hexmesh::Vec3;
using namespace testing_support;
using nlohmann::json;

constexpr const char* falling_scene =
    "[solve]\nkind = \"dynamics\"\n[dynamics]\nstep_s = 0.02\nduration_s = 0.1\noutput_every = 2\n[gravity]\nm_s2 = "
    "[0, 9.81, 0]\n"
    "[[fix]]\nname = \"right\"\nhalfspace = { point_mm = [-65, 0, 0], normal = [-1, 0, 0] }\n"
    "[[contact]]\nname = \"table\"\nplane = { point_mm = [0, 48, 0], normal = [0, -1, 0] }\nstiffness_n_mm = 0.5\n"
    "[[contact]]\nname = \"ball\"\nsphere = { center_mm = [0, 0, -80], radius_mm = 25 }\nstiffness_n_mm = 0.5\n";

/// A motion with obstacles, solved once.
class MotionOutputs : public Tools {
protected:
  static void SetUpTestSuite() {
    Tools::SetUpTestSuite();
    write_text(*folder / "fall.toml", falling_scene);
    const CommandResult r =
        run("hexsolve liver.hexmesh fall.toml --level 2 -o fall.hexresult --report fall.json && "
            "hexsolve liver.hexmesh fall.toml --level 2 --set dynamics.output_fields=end -o end.hexresult");
    ASSERT_EQ(r.exit_code, 0) << r.errors;
  }
};

TEST_F(MotionOutputs, EveryStateHasItsStressesStrainsAndContactForces) {
  const hexmesh::Result result = hexmesh::read_result(*folder / "fall.hexresult");
  const json rows = json::parse(read_text(*folder / "fall.json"))["motion"]["rows"];
  ASSERT_EQ(result.times.size(), 4U);  // 0, 2, 4, 5 steps
  for (std::size_t n = 0; n < result.times.size(); ++n) {
    const hexmesh::MotionStep step = hexmesh::read_step(*folder / "fall.hexresult", result, n);
    Vec3 force = Vec3::Zero(), told = Vec3::Zero();
    for (const Vec3& f : step.contact_force) force += f;
    ASSERT_EQ(rows[n]["contacts"].size(), 2U);
    for (const json& contact : rows[n]["contacts"])
      for (int d = 0; d < 3; ++d) told[d] += contact["force_n"][static_cast<std::size_t>(d)].get<double>();
    EXPECT_LT((force - told).norm(), 1e-9 * (1 + told.norm())) << "weights of a point add up to 1";
    double energy = 0;  // of all cells, of equal size
    const std::vector<double>& fill = result.cell_fields.at("fill");
    for (std::size_t c = 0; c < fill.size(); ++c) energy += fill[c] * step.cell_fields.at("strain_energy_density")[c];
    const double cell = 16 * 16 * 16;
    EXPECT_NEAR(energy * cell, rows[n]["strain_n_mm"].get<double>(), 1e-6 * (1e-3 + energy * cell));
  }
  EXPECT_GT(rows.back()["contacts"][0]["points"], 0);
  // The last state is the result's own, but for single precision.
  const hexmesh::MotionStep last = hexmesh::read_step(*folder / "fall.hexresult", result, 3);
  EXPECT_EQ(last.contact_force, result.contact_force);
  for (const char* name : {"von_mises_stress", "pressure", "principal_stretch_1", "min_jacobian"}) {
    const std::vector<double>&mine = last.cell_fields.at(name), &whole = result.cell_fields.at(name);
    for (std::size_t c = 0; c < mine.size(); ++c) ASSERT_EQ(mine[c], static_cast<float>(whole[c])) << name;
  }
  EXPECT_FALSE(last.cell_fields.contains("young_modulus")) << "which never changes";
}

TEST_F(MotionOutputs, FieldsOfStatesMayBeLeftOut) {
  const hexmesh::Result result = hexmesh::read_result(*folder / "end.hexresult");
  EXPECT_TRUE(hexmesh::read_step(*folder / "end.hexresult", result, 3).cell_fields.empty());
  EXPECT_EQ(hexmesh::read_result(*folder / "fall.hexresult").displacement, result.displacement);
  expect_failure("hexslice steps end.hexresult --color pressure -o frames", 2, {"'pressure' is kept of the end only"});
}

TEST_F(MotionOutputs, PicturesOfStatesShareTheirColoursAndOneLegend) {
  ASSERT_EQ(run("hexslice steps fall.hexresult --color von_mises_stress --axis coronal --contact-sheet -o sheet && "
                "hexslice steps fall.hexresult --color von_mises_stress --axis coronal -o single")
                .exit_code,
            0);
  const hexmesh::Canvas sheet = hexmesh::read_png(*folder / "sheet/steps.png"),
                        single = hexmesh::read_png(*folder / "single/step_0003.png");
  EXPECT_LT(sheet.width() * sheet.height(), 4 * single.width() * single.height()) << "three legends fewer";
  // All have the numbers of one legend.
  const hexmesh::Canvas first = hexmesh::read_png(*folder / "single/step_0000.png");
  ASSERT_EQ(first.width(), single.width());
  std::size_t ink = 0;
  for (int y = 0; y < first.height(); ++y)
    for (int x = first.width() - 80; x < first.width(); ++x) {
      ASSERT_EQ(first.at(x, y), single.at(x, y));
      ink += first.at(x, y) != first.at(0, 0);
    }
  EXPECT_GT(ink, 100U);
}

TEST_F(MotionOutputs, AFilmTakesFfmpegAndIsWholeOrNotThere) {
  expect_failure("hexslice steps fall.hexresult --contact-sheet -o film.mp4", 2, {"film.mp4", "contact sheet"});
  expect_failure("hexslice steps fall.hexresult --fps 60 -o film.gif", 2, {"--fps is 60", "50"});
  expect_failure("hexslice steps fall.hexresult --fps 5 -o frames", 2, {"--fps", "without a film"});
  expect_failure("hexslice planes fall.hexresult -o FILM.MP4", 2, {"'FILM.MP4', expected a folder"});
  const CommandResult none = run("PATH=$(dirname \"$(command -v hexslice)\") hexslice steps fall.hexresult -o no.mp4");
  EXPECT_EQ(none.exit_code, 6);
  EXPECT_NE(none.errors.find("'no.mp4' takes the program ffmpeg"), std::string::npos) << none.errors;
  EXPECT_FALSE(std::filesystem::exists(*folder / "no.mp4"));
  // One that fails says why.
  std::filesystem::create_directory(*folder / "fake");
  write_text(*folder / "fake/ffmpeg", "#!/bin/sh\n[ \"$1\" = -version ] || { echo 'no such codec' >&2; exit 1; }\n");
  const CommandResult fails =
      run("chmod +x fake/ffmpeg && PATH=$PWD/fake:$PATH hexslice steps fall.hexresult -o no.gif");
  EXPECT_EQ(fails.exit_code, 6);
  EXPECT_NE(fails.errors.find("'no.gif': ffmpeg says 'no such codec'"), std::string::npos) << fails.errors;
  if (shell("command -v ffmpeg").exit_code != 0) GTEST_SKIP() << "no ffmpeg here";
  const CommandResult r =
      run("hexslice steps fall.hexresult --scan ct.nrrd -o fall.mp4 && hexslice steps fall.hexresult -o fall.gif && "
          "ffprobe -v error -count_frames -show_entries stream=nb_read_frames -of csv=p=0 fall.mp4");
  ASSERT_EQ(r.exit_code, 0) << r.errors;
  EXPECT_EQ(r.output, "4\n");
  EXPECT_EQ(read_text(*folder / "fall.gif").substr(0, 4), "GIF8");
}

TEST_F(MotionOutputs, ObstaclesAreExportedWhereTheyAre) {
  ASSERT_EQ(run("hexexport fall.hexresult --obstacles obstacles.vtp").exit_code, 0);
  const std::string text = read_text(*folder / "obstacles.vtp");
  EXPECT_NE(text.find("Name=\"obstacle\""), std::string::npos);
  ASSERT_EQ(run("hexsolve -q liver.hexmesh liver.toml --level 2 -o plain.hexresult").exit_code, 0);
  expect_failure("hexexport plain.hexresult --obstacles none.vtp", 2, {"no obstacles"});
}

TEST_F(MotionOutputs, SubcommandsHaveHelpWithAnExampleThatRuns) {
  ASSERT_EQ(run("hexsolve liver.hexmesh liver.toml --level 2 -o liver.hexresult && "
                "cp fall.hexresult motion.hexresult")
                .exit_code,
            0);
  for (const char* command : {"hexscan phantom", "hexscan info", "hexmesh build", "hexmesh info", "hexmesh check",
                              "hexmesh surface", "hexslice planes", "hexslice steps", "hexslice volume"}) {
    const std::string help = run(std::string(command) + " --help").output;
    EXPECT_NE(help.find("--max-memory"), std::string::npos) << command << " takes what the tool takes";
    const std::size_t at = help.find("Example:\n  ") + 11;
    const std::string example = help.substr(at, help.find('\n', at) - at);
    EXPECT_EQ(example.find(command), 0U) << example;
    const CommandResult r = run("mkdir -p examples && cp *.nrrd liver.hexmesh *.hexresult examples && cd examples && " +
                                example + " --force");
    EXPECT_EQ(r.exit_code, 0) << example << "\n" << r.errors;
  }
}

TEST_F(MotionOutputs, SurfacesInMetresAreToldAndScaled) {
  write_text(*folder / "metres.off",
             "OFF\n4 4 0\n0 0 0\n0.1 0 0\n0 0.1 0\n0 0 0.1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n");
  const CommandResult small = run("hexscan metres.off --spacing 0.01 -o metres.nrrd");
  EXPECT_NE(small.errors.find("0.1 mm large, expected coordinates in mm (--scale 1000"), std::string::npos)
      << small.errors;
  const CommandResult r = run("hexscan metres.off --scale 1000 --spacing 2 -o scaled.nrrd");
  ASSERT_EQ(r.exit_code, 0) << r.errors;
  EXPECT_EQ(r.errors.find("--scale"), std::string::npos) << r.errors;
  const hexmesh::LabelVolume volume = hexmesh::read_labels(*folder / "scaled.nrrd");
  double ml = 0;
  for (const std::size_t voxels : hexmesh::count_voxels(volume))
    ml += static_cast<double>(voxels) * volume.grid.voxel_volume() / 1000;
  EXPECT_NEAR(ml, 1000.0 / 6, 3) << "of a corner of 100 mm";
}

TEST_F(MotionOutputs, LabelsAreNamedByATable) {
  ASSERT_EQ(run("hexscan -q liver.nrrd --segment liver -o one.nrrd").exit_code, 0);
  hexmesh::LabelVolume bare = hexmesh::read_labels(*folder / "one.nrrd");
  hexmesh::write_labels(bare, *folder / "bare.nii.gz");  // which holds labels only
  write_text(*folder / "names.ctbl", fmt::format("{} hepar 10 20 30 255\n", bare.segments[0].label));
  const CommandResult r = run("hexscan bare.nii.gz --labels names.ctbl --segment hepar -o named.nrrd");
  EXPECT_EQ(r.exit_code, 0) << r.errors;
  EXPECT_NE(run("hexscan info bare.nii.gz --labels names.ctbl").output.find("'hepar'"), std::string::npos);
  write_text(*folder / "names.ctbl", "what\n");
  expect_failure("hexscan info bare.nii.gz --labels names.ctbl", 3, {"names.ctbl", "line 1", "'what'", "VALUE NAME"});
}

/// Copies what comes in, then tells the longest time in which nothing came [s].
constexpr const char* silence_script =
    "import sys, time\nlast, longest = time.monotonic(), 0\nfor line in sys.stdin:\n"
    "    now = time.monotonic()\n    last, longest = now, max(longest, now - last)\n    print(line, end='')\n"
    "print(longest)\n";

TEST(RealLivers, NoToolIsSilentForLongAndProgressEntersNoData) {
  const std::filesystem::path data = shared_data() / "data";
  if (!std::filesystem::exists(data)) GTEST_SKIP() << "no real scans here";
  const char* form = std::getenv("HEXTOOLS_TESTS");
  const bool is_full = form && std::string(form) == "full";
  struct Body {
    std::string scan, choice, level;
  };
  std::vector<Body> bodies = {{data / "totalsegmentator/example_seg.nii.gz", "5=liver", "1"}};
  if (is_full) bodies.push_back({data / "med-rad/Liver/Patient2/liver.nii.gz", "1=liver", "0"});
  for (const Body& body : bodies) {
    const TemporaryFolder folder;
    write_text(folder / "silence.py", silence_script);
    for (const std::string& command : {
             fmt::format("hexscan {} --segment {} --largest-component -o l.nrrd", body.scan, body.choice),
             std::string("hexmesh build l.nrrd --material liver:tissue=liver -o l.hexmesh"),
             std::string("hexsolve l.hexmesh --example -o l.toml"),
             fmt::format("hexsolve l.hexmesh l.toml --set solve.islands=drop --level {} -o l.hexresult", body.level),
             std::string("hexexport l.hexresult --lattice l.vtu --surface l.vtp --segmentation moved.nrrd "
                         "--transform t.h5 --html l.html"),
             std::string("hexslice planes l.hexresult --contact-sheet --color displacement --every 5 -o pictures"),
             std::string("hexslice volume l.hexresult -o volume.png"),
             std::string("hexmesh check l.hexmesh"),
             std::string("hexexport l.hexresult --report - | python3 -m json.tool"),
         }) {
      const std::string said = shell("cd '" + folder.path("") + "' && { { " + command +
                                     "; } 2>&1 >/dev/null; echo exit $?; } | python3 -u silence.py")
                                   .output;
      EXPECT_NE(said.find("exit 0\n"), std::string::npos) << command << "\n" << said;
      EXPECT_LT(std::stod(said.substr(said.find("exit 0\n") + 7)), 15)
          << command << ": a line is due after 10 s; a busy machine may bring it late";
      EXPECT_EQ(said.find('\r'), std::string::npos) << "what is written over is for terminals";
    }
  }
}

}  // namespace test_motion_outputs
