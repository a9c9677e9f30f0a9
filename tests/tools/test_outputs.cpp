// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "hexmesh/file/result_file.h"
#include "hexmesh/scan/image_io.h"
#include "hexmesh/view/slice.h"
#include "support/files.h"

namespace test_outputs {

using namespace testing_support;
using hexmesh::Vec3;
using nlohmann::json;

/// A phantom with its CT, solved once for all tests of this file.
class Outputs : public testing::Test {
protected:
  static void SetUpTestSuite() {
    folder = new TemporaryFolder;
    const std::string commands =
        "hexscan phantom liver --spacing 4 --intensity-out ct.nrrd -o liver.seg.nrrd && "
        "hexmesh build liver.seg.nrrd --material '*:young_kpa=100,poisson=0.3' -o liver.hexmesh && "
        "hexsolve liver.hexmesh --example -o liver.toml && "
        "hexsolve liver.hexmesh liver.toml --level 1 -o liver.hexresult --report liver.json";
    ASSERT_EQ(run(commands).exit_code, 0);
  }
  static void TearDownTestSuite() { delete folder; }

  static CommandResult run(const std::string& command) { return shell("cd '" + folder->path("") + "' && " + command); }
  static hexmesh::Result result() { return hexmesh::read_result(*folder / "liver.hexresult"); }

  static inline TemporaryFolder* folder = nullptr;
};

/// 2 |A and B| / (|A| + |B|) of the voxels of a label; of all of them where it is 0.
double dice(const std::vector<std::uint16_t>& a, const std::vector<std::uint16_t>& b, std::uint16_t label) {
  std::size_t both = 0, sum = 0;
  for (std::size_t n = 0; n < a.size(); ++n) {
    const bool in_a = label == 0 ? a[n] != 0 : a[n] == label, in_b = label == 0 ? b[n] != 0 : b[n] == label;
    both += in_a && in_b;
    sum += static_cast<std::size_t>(in_a) + static_cast<std::size_t>(in_b);
  }
  return 2.0 * static_cast<double>(both) / static_cast<double>(sum);
}

TEST_F(Outputs, ParaViewOpensTheLatticeInBothFormats) {
  if (run("command -v pvbatch").exit_code != 0) GTEST_SKIP() << "no pvbatch (Debian's package paraview)";
  write_text(*folder / "open.py",
             "from paraview.simple import OpenDataFile, UpdatePipeline\n"
             "for name in ('cells.vtu', 'cells.hdf'):\n"
             "    data = OpenDataFile(name)\n"
             "    UpdatePipeline(proxy=data)\n"
             "    info = data.GetDataInformation()\n"
             "    low, high = data.PointData['displacement'].GetRange(-1)\n"
             "    print(info.GetNumberOfPoints(), info.GetNumberOfCells(), '%.9g' % high)\n");
  const CommandResult r =
      run("hexexport liver.hexresult --lattice cells.vtu && hexexport liver.hexresult --lattice cells.hdf && "
          "pvbatch --force-offscreen-rendering open.py 2>errors.txt || cat errors.txt");
  std::istringstream lines(r.output);
  std::string vtu, hdf;
  std::getline(lines, vtu);
  std::getline(lines, hdf);
  EXPECT_EQ(vtu, hdf) << r.output;
  EXPECT_EQ(vtu.find(fmt::format("{} {} ", result().nodes.size(), result().cells.size())), 0U) << r.output;
}

TEST_F(Outputs, ItkMovesTheSegmentationAsItIsExported) {
  const CommandResult r =
      run("hexexport liver.hexresult --segmentation moved.seg.nrrd --transform to_rest.h5 && "
          "itk_resample liver.seg.nrrd to_rest.h5 moved.seg.nrrd by_itk.nrrd nearest");
  ASSERT_EQ(r.exit_code, 0) << r.errors;
  const hexmesh::LabelVolume ours = hexmesh::read_labels(*folder / "moved.seg.nrrd");
  const hexmesh::LabelVolume theirs = hexmesh::read_labels(*folder / "by_itk.nrrd");
  const hexmesh::LabelVolume before = hexmesh::read_labels(*folder / "liver.seg.nrrd");
  ASSERT_TRUE(hexmesh::same_grid(ours.grid, theirs.grid));
  EXPECT_GE(dice(ours.labels, theirs.labels, 0), 0.99);
  ASSERT_EQ(ours.segments.size(), 3U);
  for (std::size_t s = 0; s < 3; ++s) {
    EXPECT_GE(dice(ours.labels, theirs.labels, ours.segments[s].label), 0.99) << ours.segments[s].name;
    EXPECT_EQ(ours.segments[s].name, before.segments[s].name);
    for (std::size_t c = 0; c < 3; ++c) EXPECT_NEAR(ours.segments[s].color[c], before.segments[s].color[c], 1e-5);
  }
  // It did move, and nothing was lost or doubled.
  const auto count = [](const hexmesh::LabelVolume& v) {
    return static_cast<double>(std::count_if(v.labels.begin(), v.labels.end(), [](auto l) { return l != 0; }));
  };
  EXPECT_NEAR(count(ours) / count(before), 1, 0.03);
}

TEST_F(Outputs, ItkMovesTheScanAsTheSlicesShowIt) {
  const hexmesh::Result solved = result();
  const hexmesh::IntensityVolume ct = hexmesh::read_intensity(*folder / "ct.nrrd");
  hexmesh::SliceOptions options;
  options.before = options.outlines = false;
  options.pixel_mm = 1.5;
  options.level = 60;
  options.window = 400;
  const hexmesh::SliceRenderer renderer(solved, &ct, options);
  ASSERT_EQ(run("hexexport liver.hexresult --transform slice.h5").exit_code, 0);
  for (const double height : {-20.0, 3.0}) {
    const hexmesh::Canvas sheet = renderer.draw(hexmesh::plane_across(hexmesh::SliceAxis::axial, height));
    // The picture's pixels as a volume of one layer, for ITK to fill.
    const hexmesh::Bounds b = hexmesh::bounds_of(solved);
    const Vec3 size = (b.high - b.low).array() + 24;
    const hexmesh::Grid pixels({static_cast<std::int32_t>(size[0] / 1.5), static_cast<std::int32_t>(size[1] / 1.5), 1},
                               Vec3::Constant(1.5), {b.low[0] - 12, b.low[1] - 12, height});
    hexmesh::write_labels({pixels, std::vector<std::uint16_t>(pixels.num_voxels()), {}}, *folder / "like.nrrd");
    ASSERT_EQ(run("itk_resample ct.nrrd slice.h5 like.nrrd moved_ct.nrrd linear").exit_code, 0);
    const hexmesh::IntensityVolume moved = hexmesh::read_intensity(*folder / "moved_ct.nrrd");
    const hexmesh::DisplacementField material = hexmesh::displacement_to_rest(solved, pixels);
    double sum = 0;
    std::size_t compared = 0, far_off = 0;
    for (std::size_t n = 0; n < pixels.num_voxels(); ++n) {
      if (std::isnan(material.values[n][0])) continue;
      const hexmesh::Index3 p = pixels.index(n);
      const double grey = 255 * std::clamp((static_cast<double>(moved.values[n]) + 140) / 400, 0.0, 1.0);
      const double off = std::abs(sheet.at(22 + p[0], 44 + p[1])[0] - grey);  // letters of 22, a header of 22 pixels
      sum += off;
      far_off += off > 3;
      ++compared;
    }
    ASSERT_GT(compared, 2000U);
    EXPECT_LT(sum / static_cast<double>(compared), 0.6) << "grey levels; half of one is rounding";
    EXPECT_LT(static_cast<double>(far_off) / static_cast<double>(compared), 0.01);
  }
}

TEST_F(Outputs, BothTransformsUndoEachOtherInItk) {
  // A picture of the x coordinate, there and back.
  hexmesh::IntensityVolume x{hexmesh::Grid({90, 60, 60}, Vec3::Constant(4), {-180, -120, -120}), {}};
  for (std::size_t n = 0; n < x.grid.num_voxels(); ++n)
    x.values.push_back(static_cast<float>(x.grid.position(Vec3(x.grid.index(n)[0], 0, 0))[0]));
  hexmesh::write_intensity(x, *folder / "x.nrrd");
  const CommandResult r =
      run("hexexport liver.hexresult --transform a.h5 --transform-points b.h5 && "
          "itk_resample x.nrrd a.h5 x.nrrd moved_x.nrrd linear && "
          "itk_resample moved_x.nrrd b.h5 x.nrrd back_x.nrrd linear");
  ASSERT_EQ(r.exit_code, 0) << r.errors;
  const hexmesh::IntensityVolume back = hexmesh::read_intensity(*folder / "back_x.nrrd");
  const hexmesh::LabelVolume labels = hexmesh::read_labels(*folder / "liver.seg.nrrd");
  double sum = 0, count = 0;
  for (std::size_t n = 0; n < labels.labels.size(); ++n) {
    if (labels.labels[n] == 0) continue;
    const hexmesh::Index3 v = labels.grid.index(n);
    const Vec3 p = labels.grid.position(Vec3(v[0], v[1], v[2]));
    sum += std::abs(hexmesh::value_at(back, p) - p[0]);
    ++count;
  }
  // Twice interpolated between voxels of 4 mm.
  EXPECT_LT(sum / count, 0.1 * 4);
  // How far the fields themselves are off is said by the tool.
  EXPECT_NE(r.errors.find("undo each other in the body to 0.00"), std::string::npos) << r.errors;
}

TEST_F(Outputs, AScanIsDeformedOnItsOwnGridOrOneThatFits) {
  CommandResult r = run("hexexport liver.hexresult --warp ct.nrrd --to moved.nrrd --segmentation moved.nii.gz");
  ASSERT_EQ(r.exit_code, 0) << r.errors;
  const hexmesh::IntensityVolume ct = hexmesh::read_intensity(*folder / "ct.nrrd");
  const hexmesh::IntensityVolume moved = hexmesh::read_intensity(*folder / "moved.nrrd");
  EXPECT_TRUE(hexmesh::same_grid(ct.grid, moved.grid));
  const hexmesh::LabelVolume labels = hexmesh::read_labels(*folder / "moved.nii.gz");
  EXPECT_TRUE(hexmesh::same_grid(ct.grid, labels.grid));
  // Grey values moved with the labels.
  const auto mean = [](const hexmesh::IntensityVolume& v, const hexmesh::LabelVolume& l, std::uint16_t label) {
    double sum = 0, count = 0;
    for (std::size_t n = 0; n < l.labels.size(); ++n)
      if (l.labels[n] == label) {
        sum += static_cast<double>(v.values[n]);
        ++count;
      }
    return sum / count;
  };
  const hexmesh::LabelVolume before = hexmesh::read_labels(*folder / "liver.seg.nrrd");
  const double liver = mean(ct, before, before.segments[0].label);
  EXPECT_NEAR(mean(moved, labels, before.segments[0].label), liver, 4) << "border voxels mix with what is around";
  for (const hexmesh::Segment& s : {before.segments[1], before.segments[2]}) {
    // Structures of a few voxels lose some contrast between voxels.
    const double contrast = (mean(moved, labels, s.label) - liver) / (mean(ct, before, s.label) - liver);
    EXPECT_GT(contrast, 0.6) << s.name;
    EXPECT_LT(contrast, 1.05) << s.name;
  }

  // A thin slab of a grid does not hold the body: said, and --grid fitted does.
  hexmesh::write_intensity({hexmesh::Grid({40, 40, 4}, Vec3::Constant(4), {-80, -80, -8}), std::vector<float>(6400)},
                           *folder / "slab.nrrd");
  r = run("hexexport liver.hexresult --warp ct.nrrd --to slab_ct.nrrd --grid slab.nrrd");
  ASSERT_EQ(r.exit_code, 0) << r.errors;
  EXPECT_NE(r.errors.find("out of the volume"), std::string::npos) << r.errors;
  EXPECT_EQ(hexmesh::read_intensity(*folder / "slab_ct.nrrd").grid.extent(), (hexmesh::Index3{40, 40, 4}));
  r = run("hexexport liver.hexresult --warp ct.nrrd --to fitted.nrrd --grid fitted");
  ASSERT_EQ(r.exit_code, 0) << r.errors;
  EXPECT_EQ(r.errors.find("out of"), std::string::npos) << r.errors;
}

TEST_F(Outputs, ProbesTellWherePointsGo) {
  write_text(*folder / "points.fcsv",
             "# Markups fiducial file version = 4.11\n# CoordinateSystem = LPS\n# columns = id,x,y,z,ow,ox,oy,oz,vis,"
             "sel,lock,label,desc,associatedNodeID\n1,0,0,0,0,0,0,1,1,1,0,F-1,,\n");
  const CommandResult r = run("hexexport -q liver.hexresult --probe 98,-18,6 --probe points.fcsv");
  ASSERT_EQ(r.exit_code, 0) << r.errors;
  std::istringstream lines(r.output);
  std::string line;
  std::getline(lines, line);
  EXPECT_EQ(line, "probe,time_s,x,y,z,ux,uy,uz,segment");
  std::getline(lines, line);
  EXPECT_EQ(line.find("\"98,-18,6\",,98,-18,6,"), 0U) << line;
  EXPECT_NE(line.find(",liver"), std::string::npos);
  // Pulled by 40 mm to the front and down.
  double x = 0, y = 0, z = 0;
  ASSERT_EQ(std::sscanf(line.c_str(), "\"98,-18,6\",,98,-18,6,%lf,%lf,%lf", &x, &y, &z), 3);
  EXPECT_NEAR(y, -28.28, 1.5);
  EXPECT_NEAR(z, -28.28, 1.5);
  std::getline(lines, line);
  EXPECT_EQ(line.find("points.fcsv:1,,0,0,0,"), 0U) << line;
  EXPECT_EQ(run("hexexport liver.hexresult --probe 900,0,0").exit_code, 4);
  EXPECT_EQ(run("hexexport liver.hexresult --probe nowhere").exit_code, 2);
  EXPECT_EQ(run("hexexport liver.hexresult --probe 1,2,3 --lattice -").exit_code, 2);
}

TEST_F(Outputs, NamesAreCheckedBeforeAnythingIsWritten) {
  const auto refuses = [&](const std::string& options, int code, const char* word) {
    const CommandResult r = run("hexexport liver.hexresult " + options);
    EXPECT_EQ(r.exit_code, code) << options << "\n" << r.errors;
    EXPECT_NE(r.errors.find(word), std::string::npos) << r.errors;
    EXPECT_FALSE(std::filesystem::exists(*folder / "early.vtu")) << options;
  };
  refuses("--lattice early.vtu --html late.txt", 2, ".html");
  refuses("--lattice early.vtu --segmentation x.xyz", 2, ".nrrd");
  refuses("--lattice early.vtu --report liver.json", 6, "exists");
  refuses("--lattice early.vtu --csv same.csv --report ./same.csv", 2, "two names");
  refuses("--lattice early.vtu --segmentation seg.nrrd --grid nowhere.nrrd", 3, "nowhere.nrrd");
  refuses("--lattice early.vtu --to x.nrrd", 2, "--warp");
  refuses("--lattice early.vtu --transform -", 2, "written to files");
  const CommandResult pictures = run("hexslice planes liver.hexresult -o a.png");
  EXPECT_EQ(pictures.exit_code, 2);
  EXPECT_NE(pictures.errors.find("'a.png' would be a folder"), std::string::npos) << pictures.errors;
  // A disk that is full.
  for (const char* output : {"--csv full.csv", "--lattice full.hdf", "--lattice full.vtu", "--segmentation full.nii",
                             "--segmentation full.nrrd", "--transform full.mha", "--html full.html"}) {
    const CommandResult full =
        run(fmt::format("bash -c \"trap '' XFSZ; ulimit -f 2; hexexport liver.hexresult {}\"", output));
    EXPECT_EQ(full.exit_code, 6) << output << "\n" << full.errors;
    EXPECT_FALSE(std::filesystem::exists(*folder / std::string(output).substr(std::string(output).find(' ') + 1)));
  }
  const CommandResult full =
      run("bash -c \"trap '' XFSZ; ulimit -f 8; hexsolve liver.hexmesh liver.toml --level 2 -o full\"");
  EXPECT_EQ(full.exit_code, 6) << full.errors;
  EXPECT_NE(full.errors.find("into 'full': No space left on device"), std::string::npos) << full.errors;
  EXPECT_FALSE(std::filesystem::exists(*folder / "full"));
}

TEST_F(Outputs, TheReportIsThatOfTheSolution) {
  ASSERT_EQ(
      run("hexexport -q liver.hexresult --report r.json && hexexport -q liver.hexresult --report r.csv").exit_code, 0);
  const json report = json::parse(read_text(*folder / "r.json")), said = json::parse(read_text(*folder / "liver.json"));
  EXPECT_EQ(report["strain_energy_n_mm"], said["strain_energy_n_mm"]);
  EXPECT_EQ(report["conditions"], said["conditions"]);
  const std::string csv = read_text(*folder / "r.csv");
  EXPECT_EQ(csv.find("key,value\n"), 0U);
  EXPECT_NE(csv.find(fmt::format("\nstrain_energy_n_mm,{}", said["strain_energy_n_mm"].dump())), std::string::npos);
  EXPECT_NE(csv.find("\nconditions/0/name,right end\n"), std::string::npos) << csv;
}

TEST_F(Outputs, HistoryHoldsTheChecksumsOfWhatWasRead) {
  const std::vector<std::string> history = result().history;
  ASSERT_EQ(history.size(), 2U);
  const json lattice = json::parse(run("hexmesh info --json liver.hexmesh").output);
  for (const auto& [entry, sum] : {std::pair{0, run("sha256sum liver.seg.nrrd").output},
                                   std::pair{1, lattice["sha256"].get<std::string>() + "  liver.hexmesh\n"},
                                   std::pair{1, run("sha256sum liver.toml").output}})
    EXPECT_NE((history[static_cast<std::size_t>(entry)] + "\n").find("\n" + sum), std::string::npos) << history[1];
}

TEST_F(Outputs, HistoryHoldsTheChecksumsOfMarkupsThatTheSceneNames) {
  const CommandResult r =
      run("hexsolve liver.hexmesh '" HEXTOOLS_SOURCE "/examples/markups.toml' --level 2 -o markups.hexresult");
  ASSERT_EQ(r.exit_code, 0) << r.errors;
  const std::string history = hexmesh::read_result(*folder / "markups.hexresult").history.back();
  for (const char* file : {"pull.mrk.json", "right_lobe.mrk.json"}) {
    const std::string sum = run(std::string("sha256sum '" HEXTOOLS_SOURCE "/examples/") + file + "'").output;
    EXPECT_NE(history.find(sum.substr(0, 64)), std::string::npos) << history;
  }
}

TEST_F(Outputs, TheHtmlReportIsOneFileWithAllInIt) {
  const CommandResult r = run("hexexport liver.hexresult --html report.html --warp ct.nrrd");
  ASSERT_EQ(r.exit_code, 0) << r.errors;
  const std::string html = read_text(*folder / "report.html");
  for (const char* part : {"right end", "estimated mean error", "level 2", "<svg", "data:image/png;base64,", "Effects",
                           "hexsolve liver.hexmesh"})
    EXPECT_NE(html.find(part), std::string::npos) << part;
  for (const char* outside : {"http:", "https:", "src=\"/", "<script", "<link", "url("})
    EXPECT_EQ(html.find(outside), std::string::npos) << outside;
  EXPECT_NE(html.find(result().history.back().substr(result().history.back().find('\n') + 1, 64)), std::string::npos)
      << "the checksum of the lattice";
}

TEST_F(Outputs, ABrowserShowsTheHtmlReport) {
  if (shell("command -v chromium").exit_code != 0) GTEST_SKIP() << "chromium is not installed";
  ASSERT_EQ(run("hexexport liver.hexresult --html report.html --warp ct.nrrd --force").exit_code, 0);
  ASSERT_EQ(run("timeout 120 chromium --headless --no-sandbox --disable-gpu --hide-scrollbars --window-size=1150,4200 "
                "--user-data-dir=browser --screenshot=page.png \"file://$PWD/report.html\"")
                .exit_code,
            0);
  // A page that shows: text and frames in dark, the pictures' colours, mostly white paper.
  const hexmesh::Canvas page = hexmesh::read_png(*folder / "page.png");
  std::set<hexmesh::Rgb> colors;
  std::size_t white = 0;
  for (int y = 0; y < page.height(); ++y)
    for (int x = 0; x < page.width(); ++x) {
      colors.insert(page.at(x, y));
      white += page.at(x, y) == hexmesh::Rgb{255, 255, 255};
    }
  EXPECT_GT(colors.size(), 3000U);
  EXPECT_GT(static_cast<double>(white), 0.3 * page.width() * page.height());
}

TEST_F(Outputs, SlicesAndVolumesAreDrawnAsAskedFor) {
  CommandResult r = run(
      "hexslice planes liver.hexresult --scan ct.nrrd --axis coronal --every 20 --lattice --arrows -o every && "
      "hexslice planes liver.hexresult --normal 1,1,0 --point 0,0,0 --color von_mises_stress -o oblique && "
      "hexslice planes liver.hexresult --contact-sheet --count 4 --only deformed -o sheet && "
      "hexslice volume liver.hexresult --scan ct.nrrd --view left --perspective 30 --highlight tumour --size 200,100 "
      "--show 'liver:opacity=0.02,color=0.5/0.5/1' -o volume.png");
  ASSERT_EQ(r.exit_code, 0) << r.errors;
  for (const char* file : {"every/coronal_1.png", "every/coronal_4.png", "oblique/oblique_1.png", "sheet/axial.png"})
    EXPECT_TRUE(std::filesystem::exists(*folder / file)) << file;
  const hexmesh::Canvas volume = hexmesh::read_png(*folder / "volume.png");
  EXPECT_EQ(volume.width(), 200);
  EXPECT_EQ(volume.height(), 100);
  const auto refuses = [&](const std::string& options, const char* word) {
    const CommandResult refused = run("hexslice " + options);
    EXPECT_EQ(refused.exit_code, 2) << refused.errors;
    EXPECT_NE(refused.errors.find(word), std::string::npos) << refused.errors;
    EXPECT_EQ(std::count(refused.errors.begin(), refused.errors.end(), '\n'), 1) << refused.errors;
    EXPECT_FALSE(std::filesystem::exists(*folder / "refused"));
  };
  refuses("planes liver.hexresult --color temperature -o refused", "von_mises_stress");
  refuses("planes liver.hexresult --at 3 -o refused", "--axis");
  refuses("planes liver.hexresult --axis axial --at 999 -o refused", "within the body");
  refuses("planes liver.hexresult --normal 0,0,0 -o refused", "direction");
  refuses("planes liver.hexresult --every 1e-8 -o refused", "2000");
  refuses("planes liver.hexresult --pixel-mm nan -o refused", "nan");
  refuses("planes liver.hexresult --pixel-mm 0.001 -o refused", "8192");
  refuses("planes liver.hexresult --level 3 -o refused", "--scan");
  refuses("steps liver.hexresult -o refused", "no motion");
  refuses("volume liver.hexresult -o refused", ".png");
  refuses("volume liver.hexresult --show liver:colour=1 -o refused.png", "opacity or color");
  refuses("volume liver.hexresult --direction 0,0,1 --up 0,0,1 -o refused.png", "--up");
}

TEST_F(Outputs, AMotionIsShownStepByStepInOneFrame) {
  write_text(*folder / "sway.toml",
             "[solve]\nkind = 'dynamics'\n[dynamics]\nstep_s = 0.02\nduration_s = 0.08\noutput_every = 2\n"
             "[[fix]]\npoint_mm = [-99, -1, -15]\n[gravity]\nm_s2 = [0, 9.81, 0]\n");
  const CommandResult r = run(
      "hexsolve liver.hexmesh sway.toml --level 2 -o sway.hexresult && hexslice steps sway.hexresult --scan ct.nrrd "
      "--axis sagittal -o steps && hexslice steps sway.hexresult --contact-sheet -o steps && "
      "hexexport -q sway.hexresult --probe 50,-18,6 --html sway.html");
  ASSERT_EQ(r.exit_code, 0) << r.errors;
  const hexmesh::Canvas first = hexmesh::read_png(*folder / "steps/step_0000.png");
  const hexmesh::Canvas last = hexmesh::read_png(*folder / "steps/step_0002.png");
  EXPECT_EQ(first.width(), last.width());
  EXPECT_EQ(first.height(), last.height());
  EXPECT_TRUE(std::filesystem::exists(*folder / "steps/steps.png"));
  EXPECT_EQ(std::count(r.output.begin(), r.output.end(), '\n'), 4) << r.output;
  EXPECT_NE(r.output.find("\n\"50,-18,6\",0.08,50,"), std::string::npos) << r.output;
  EXPECT_NE(read_text(*folder / "sway.html").find("Energies of the motion"), std::string::npos);
}

}  // namespace test_outputs
