// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <numbers>

#include "hexmesh/file/lattice_file.h"
#include "hexmesh/scan/image_io.h"
#include "support/bodies.h"
#include "support/scan_files.h"
#include "tools_fixture.h"

namespace test_segments {

using hexmesh::Index3;
using hexmesh::LabelVolume;
using hexmesh::Vec3;
using namespace testing_support;

/// A study: a CT of 1 mm and a SEG of it with two organs, of which one has a speck beside it.
class Segments : public testing::Test {
protected:
  static void SetUpTestSuite() {
    folder = new TemporaryFolder;
    LabelVolume organs = make_volume({24, 20, 12}, {2, 2, 2}, [](const Index3& v) {
      if (v == Index3{22, 1, 1}) return 1;
      if (v[0] >= 3 && v[0] < 12 && v[1] >= 4 && v[1] < 16 && v[2] >= 2 && v[2] < 10) return 1;
      return v[0] >= 14 && v[0] < 20 && v[1] >= 4 && v[1] < 16 && v[2] >= 2 && v[2] < 10 ? 2 : 0;
    });
    organs.segments[0].name = "liver";
    organs.segments[1].name = "kidney";
    std::filesystem::create_directory(*folder / "study");
    write_ct_series(organs, *folder / "study/ct");
    write_dicom_seg(organs, SegType::binary, *folder / "study/seg.dcm");
    hexmesh::write_labels(organs, *folder / "organs.nrrd");
  }
  static void TearDownTestSuite() { delete folder; }
  static CommandResult run(const std::string& command) { return shell("cd '" + folder->path("") + "' && " + command); }

  static void expect_usage(const std::string& command, const std::string& words) {
    const CommandResult r = run(command);
    EXPECT_EQ(r.exit_code, 2) << command << r.errors;
    EXPECT_NE(r.errors.find(words), std::string::npos) << r.errors;
  }
  static double ml_of(const std::string& file) {
    const LabelVolume v = hexmesh::read_labels(*folder / file);
    std::size_t voxels = 0;
    for (const std::size_t n : hexmesh::count_voxels(v)) voxels += n;
    return static_cast<double>(voxels) * v.grid.voxel_volume() / 1000;
  }

  static inline TemporaryFolder* folder = nullptr;
};

TEST_F(Segments, ALatticeIsBuiltFromADicomStudyInOneCommand) {
  const std::string options = "--segment liver=organ --largest-component --margin 4";
  const CommandResult r =
      run("hexmesh build study --intensity study/ct " + options +
          " --material organ:young_kpa=3,poisson=0.45 -o direct.hexmesh && hexscan study " + options +
          " -o organ.nrrd && hexmesh build organ.nrrd --material "
          "organ:young_kpa=3,poisson=0.45 -o by_nrrd.hexmesh");
  ASSERT_EQ(r.exit_code, 0) << r.errors;
  const hexmesh::Lattice direct = hexmesh::read_lattice(*folder / "direct.hexmesh"),
                         by_nrrd = hexmesh::read_lattice(*folder / "by_nrrd.hexmesh");
  EXPECT_EQ(direct.levels[0].cells.size(), 9U * 12 * 8) << "without the speck and the kidney";
  EXPECT_EQ(direct.labels, by_nrrd.labels);
  EXPECT_TRUE(hexmesh::same_grid(direct.voxels, by_nrrd.voxels));
  EXPECT_EQ(direct.segments[0].segment.name, "organ");
  EXPECT_NE(direct.history.back().find("  study"), std::string::npos) << "the checksum of what was read";
}

TEST_F(Segments, HexmeshBuildTakesEveryFormThatHexscanTakes) {
  ASSERT_EQ(run("hexscan -q organs.nrrd --segment liver -o body.nrrd && hexmesh -q build body.nrrd --material "
                "'*:young_kpa=3,poisson=0.4' -o body.hexmesh && hexmesh surface body.hexmesh -o body.stl")
                .exit_code,
            0);
  for (const char* input : {"organs.nrrd", "study", "--input all=organs.nrrd", "body.stl --spacing 2"}) {
    const CommandResult r =
        run(fmt::format("hexmesh build {} --material '*:young_kpa=3,poisson=0.4' -o forms.hexmesh --force", input));
    EXPECT_EQ(r.exit_code, 0) << input << r.errors;
  }
  expect_usage("hexmesh build --material '*:young_kpa=3,poisson=0.4' -o none.hexmesh", "no input");
}

TEST_F(Segments, AZoneOfInterestNeedsNoSegmentation) {
  // Grey values of the series are labels - 1000.
  ASSERT_EQ(run("hexscan study/ct --threshold -999:-999 --as organ -o by_grey.nrrd").exit_code, 0);
  EXPECT_NEAR(ml_of("by_grey.nrrd"), (9 * 12 * 8 + 1) * 0.008, 1e-9);
  const LabelVolume grey = hexmesh::read_labels(*folder / "by_grey.nrrd");
  const Vec3 inside = grey.grid.position(Vec3(5, 6, 4));
  const std::string at = fmt::format("{},{},{}", inside[0], inside[1], inside[2]);
  ASSERT_EQ(run("hexscan study/ct --threshold -999: --connected-to " + at + " --as organ -o connected.nrrd").exit_code,
            0);
  EXPECT_NEAR(ml_of("connected.nrrd"), 9 * 12 * 8 * 0.008, 1e-9);
  const Vec3 far = inside + Vec3::Constant(3);
  ASSERT_EQ(run(fmt::format("hexscan study/ct --as box --box {},{},{},{},{},{} -o box.nrrd", inside[0] - 1, far[0],
                            inside[1] - 1, far[1], inside[2] - 1, far[2]))
                .exit_code,
            0);
  EXPECT_NEAR(ml_of("box.nrrd"), 8 * 0.008, 1e-9);
  ASSERT_EQ(run("hexscan study/ct --as ball --sphere " + at + ",2.1 -o sphere.nrrd").exit_code, 0);
  EXPECT_NEAR(ml_of("sphere.nrrd"), 7 * 0.008, 1e-9);
  ASSERT_EQ(run("hexmesh build study/ct --threshold -999: --largest-component --as organ --material "
                "organ:tissue=liver -o zone.hexmesh")
                .exit_code,
            0);
}

TEST_F(Segments, AnExpressionIsABody) {
  ASSERT_EQ(run("hexscan --as egg --implicit 'x*x/900 + y*y/400 + z*z/400 - 1' --box -31,31,-21,21,-21,21 --spacing 1 "
                "-o egg.nrrd")
                .exit_code,
            0);
  EXPECT_NEAR(ml_of("egg.nrrd"), 4 * std::numbers::pi / 3 * 30 * 20 * 20 / 1000, 0.3);
  ASSERT_EQ(run("hexscan study/ct --threshold -999: --implicit 'x - 12' --as half -o half.nrrd").exit_code, 0);
  double half = 0;  // those of both organs whose centres are there
  const LabelVolume organs = hexmesh::read_labels(*folder / "organs.nrrd");
  for (std::size_t n = 0; n < organs.labels.size(); ++n)
    half += organs.labels[n] != 0 && organs.grid.position(Vec3(organs.grid.index(n)[0], 0, 0))[0] <= 12 ? 0.008 : 0;
  EXPECT_NEAR(ml_of("half.nrrd"), half, 1e-9);
  EXPECT_GT(half, 0);
  // Where a part of it has no value, nothing is.
  for (const char* odd : {"10-sqrt(x)", "1-1/(x-x)", "min(sqrt(x), 0-1)"}) {
    const CommandResult r =
        run(fmt::format("hexscan --as odd --implicit '{}' --box=-20,-1,-20,20,-20,20 --spacing 4 -o "
                        "odd.nrrd --force",
                        odd));
    EXPECT_NE(r.errors.find("no voxel has a label"), std::string::npos) << odd << r.errors;
  }
  expect_usage("hexscan --as egg --implicit 'x*x + q' --box -3,3,-2,2,-2,2 --spacing 1 -o no.nrrd", "x*x + q");
  expect_usage("hexscan --as egg --implicit 'x*x - 1' -o no.nrrd", "--box and --spacing");
  expect_usage("hexscan study/ct --as a -o no.nrrd", "--threshold, --box");
  expect_usage("hexscan study/ct --as a --threshold 5:2 -o no.nrrd", "'5:2', expected LOW:HIGH");
  expect_usage("hexscan study/ct --as a --threshold 2 -o no.nrrd", "'2', expected LOW:HIGH");
  expect_usage("hexscan study/ct --as a --sphere 1,2,3 -o no.nrrd", "expected x,y,z,r");
  expect_usage("hexscan study/ct --as a --threshold 0: --segment 3 -o no.nrrd", "expected no --input");
  expect_usage("hexscan study/ct --threshold 0: -o no.nrrd", "--as");
  const CommandResult off = run("hexscan study/ct --threshold -999: --connected-to 0,0,900 --as a -o no.nrrd");
  EXPECT_EQ(off.exit_code, 4) << off.errors;
}

TEST_F(Segments, SheetsHaveTheThicknessThatIsAsked) {
  write_text(*folder / "sheet.off", "OFF\n4 2 0\n0 0 0\n100 0 0\n100 80 0\n0 80 0\n3 0 1 2\n3 0 2 3\n");
  const CommandResult shell = run("hexscan sheet.off --spacing 1 -o shell.nrrd");
  EXPECT_NE(shell.errors.find("expected --thickness"), std::string::npos) << shell.errors;
  for (const double spacing : {1.0, 0.5}) {
    const CommandResult r =
        run(fmt::format("hexscan sheet.off --spacing {} --thickness 4 -o sheet.nrrd --force", spacing));
    ASSERT_EQ(r.exit_code, 0);
    EXPECT_EQ(r.errors.find("warning"), std::string::npos) << r.errors;
    // With a round rim: half a pipe of 4 mm around it.
    EXPECT_NEAR(ml_of("sheet.nrrd"), (100 * 80 * 4 + 360 * std::numbers::pi * 4 / 2) / 1000, 2.0) << spacing;
  }
  EXPECT_NE(run("hexscan sheet.off --spacing 2 --thickness 1 -o thin.nrrd").errors.find("less than a voxel"),
            std::string::npos);
}

TEST_F(Segments, ThickSlicesBecomeCubes) {
  LabelVolume thick = make_volume({24, 20, 5}, {2, 2, 6}, [](const Index3& v) {
    return v[0] > 2 + v[2] && v[0] < 15 + v[2] && v[1] > 3 && v[1] < 16 && v[2] > 0 && v[2] < 4;
  });
  hexmesh::write_labels(thick, *folder / "thick.nrrd");
  const CommandResult r = run("hexscan thick.nrrd --isotropic 1 -o cubes.nrrd");
  ASSERT_EQ(r.exit_code, 0) << r.errors;
  EXPECT_NE(r.errors.find("made 1 mm"), std::string::npos) << r.errors;
  const LabelVolume cubes = hexmesh::read_labels(*folder / "cubes.nrrd");
  EXPECT_EQ(cubes.grid.spacing(), Vec3(1, 1, 1));
  EXPECT_NEAR(ml_of("cubes.nrrd") / ml_of("thick.nrrd"), 1, 0.005);
  const CommandResult lost = run("hexscan thick.nrrd --isotropic 90 -o lost.nrrd");
  EXPECT_EQ(lost.exit_code, 4);
  EXPECT_NE(lost.errors.find("expected a smaller --isotropic"), std::string::npos) << lost.errors;
}

}  // namespace test_segments
