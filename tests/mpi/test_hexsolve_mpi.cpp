// SPDX-License-Identifier: Apache-2.0
#include "mpi/hexsolve_mpi.h"
#include "support/forms.h"

namespace test_hexsolve_mpi {

using namespace testing_support;

TEST_F(HexsolveMpi, AnyNumberOfProcessesFindsWhatOneFinds) {
  const std::string sharp = "liver.hexmesh liver.toml --level 0 --set solve.tolerance=1e-10 --force ";
  ASSERT_EQ(run("hexsolve " + sharp + "-o one.hexresult --report one.json").exit_code, 0);
  const Result one = result("one.hexresult");
  for (const int processes : whole_or<std::vector<int>>({1, 2, 4}, {1, 3})) {
    SCOPED_TRACE(fmt::format("{} processes", processes));
    const CommandResult r = run(mpi(processes) + sharp + "-o many.hexresult --force --report many.json");
    ASSERT_EQ(r.exit_code, 0) << r.errors;
    expect_same(one, result("many.hexresult"));
    const json many = report("many.json");
    expect_same_reports(report("one.json"), many);
    EXPECT_NEAR(many["linear_iterations"].get<int>(), report("one.json")["linear_iterations"].get<int>(), 1);
  }
  const CommandResult exported = run("hexexport many.hexresult --lattice many.vtu --html many.html");
  EXPECT_EQ(exported.exit_code, 0) << exported.errors;
}

TEST_F(HexsolveMpi, ErrorsAreEstimatedAsByOne) {
  // By a look at the next finer level.
  const std::string coarse = "liver.hexmesh liver.toml --level 2 --set solve.tolerance=1e-10 --force ";
  ASSERT_EQ(run("hexsolve " + coarse + "-o one.hexresult --report one.json").exit_code, 0);
  ASSERT_EQ(run(mpi(3) + coarse + "-o many.hexresult --report many.json").exit_code, 0);
  EXPECT_FALSE(report("one.json")["error_estimate_mm"]["mean"].is_null());
  expect_same_reports(report("one.json"), report("many.json"));
}

TEST_F(HexsolveMpi, NearlyIncompressibleBodiesWithGapsTakeAsManyIterationsAsByOne) {
  ASSERT_EQ(run(fmt::format("hexscan phantom liver --spacing {} -o vessels.seg.nrrd && ", whole_or(3, 5)) +
                "hexmesh build vessels.seg.nrrd --material '*:young_kpa=10,poisson=0.49' --material vessel:none "
                "-o vessels.hexmesh && hexsolve vessels.hexmesh --example -o vessels.toml")
                .exit_code,
            0);
  for (const char* strain : {"cauchy", "corotational"}) {
    const std::string arguments =
        fmt::format("vessels.hexmesh vessels.toml --level 0 --set solve.strain={} --force ", strain);
    ASSERT_EQ(run("hexsolve " + arguments + "-o one.hexresult --report one.json").exit_code, 0);
    const int iterations_of_one = report("one.json")["linear_iterations"].get<int>();
    for (const int processes : whole_or<std::vector<int>>({1, 2, 3, 4}, {2})) {
      SCOPED_TRACE(fmt::format("{}, {} processes", strain, processes));
      const CommandResult r = run(mpi(processes) + arguments + "-o many.hexresult --report many.json");
      ASSERT_EQ(r.exit_code, 0) << r.errors;
      // As multigrid's smoothers begin with the same noise, all differ by rounding only.
      EXPECT_NEAR(report("many.json")["linear_iterations"].get<int>(), iterations_of_one, 1);
    }
  }
}

TEST_F(HexsolveMpi, SmallLevelsAreSolvedAtOnceAsByOne) {
  // Where a factor of the whole level is the preconditioner, Newton's steps are the same to rounding, level by level.
  const std::string arguments =
      "liver.hexmesh liver.toml --level 3 --set solve.strain=corotational --set solve.error_estimate=off --force ";
  const auto iterations = [](const json& of) {
    std::vector<int> out;
    for (const json& level : of["levels"]) out.push_back(level["linear_iterations"].get<int>());
    return out;
  };
  ASSERT_EQ(run("hexsolve " + arguments + "-o one.hexresult --report one.json").exit_code, 0);
  const json one = report("one.json");
  ASSERT_LE(one["levels"].back()["dofs"].get<int>(), 600);
  for (const int processes : {1, 3}) {
    SCOPED_TRACE(fmt::format("{} processes", processes));
    const CommandResult r = run(mpi(processes) + arguments + "-o many.hexresult --report many.json");
    ASSERT_EQ(r.exit_code, 0) << r.errors;
    const json many = report("many.json");
    EXPECT_EQ(many["linear_iterations"], one["linear_iterations"]);
    EXPECT_EQ(many["newton_iterations"], one["newton_iterations"]);
    EXPECT_EQ(iterations(many), iterations(one));
    EXPECT_LT(largest_difference(result("one.hexresult").displacement, result("many.hexresult").displacement), 1e-6);
  }
}

TEST_F(HexsolveMpi, NoProcessHoldsTheWholeBody) {
  // A long body in many layers: what a process holds is its share, and what lies around it.
  ASSERT_EQ(run("hexscan phantom beam --spacing 2 --set rotate_y=90 -o beam.seg.nrrd && "
                "hexmesh build beam.seg.nrrd --material '*:young_kpa=100,poisson=0.3' -o beam.hexmesh --force --report "
                "beam.json && "
                "hexsolve beam.hexmesh --example -o beam.toml")
                .exit_code,
            0);
  constexpr std::size_t processes = 4;
  const CommandResult r = run(mpi(processes) +
                              "beam.hexmesh beam.toml --level 0 --set displace.0.by_mm=[0,0,5] "
                              "-o beam.hexresult --force --report many.json --set solve.strain=cauchy");
  ASSERT_EQ(r.exit_code, 0) << r.errors;
  const json many = report("many.json"), level = report("beam.json")["levels"][0];
  ASSERT_EQ(many["processes"].size(), processes);
  std::size_t cells = 0, nodes = 0, voxels = 0;
  for (const json& p : many["processes"]) {
    cells += p["cells"].get<std::size_t>();
    nodes += p["nodes"].get<std::size_t>();
    voxels += p["voxels_read"].get<std::size_t>();
    EXPECT_LE(p["cells"].get<std::size_t>(), level["cells"].get<std::size_t>() / processes + 1);
    EXPECT_LE(p["nodes_of_others"].get<std::size_t>(), p["nodes"].get<std::size_t>() / 2);
    // Its layers and one on each side, of 80.
    EXPECT_LE(p["cells_read"].get<std::size_t>(),
              level["cells"].get<std::size_t>() / processes + 3 * level["cells"].get<std::size_t>() / 80);
  }
  EXPECT_EQ(cells, level["cells"].get<std::size_t>());
  EXPECT_EQ(nodes, level["nodes"].get<std::size_t>());
  EXPECT_GT(voxels, 0U);
}

TEST_F(HexsolveMpi, SinglePointsAreTheNearestOfAllProcesses) {
  // With points on different processes, each near others as far away.
  ASSERT_EQ(run("sed 's/^radius_mm = .*/radius_mm = 0/' liver.toml >points.toml").exit_code, 0);
  const std::string sharp =
      fmt::format("liver.hexmesh points.toml --level {} --set solve.tolerance=1e-10 --force ", whole_or(0, 1));
  ASSERT_EQ(run("hexsolve " + sharp + "-o one.hexresult").exit_code, 0);
  const CommandResult r = run(mpi(4) + sharp + "-o many.hexresult");
  ASSERT_EQ(r.exit_code, 0) << r.errors;
  const Result many = result("many.hexresult");
  for (const hexmesh::ConditionPoints& c : many.conditions) EXPECT_EQ(c.points.size(), 1U) << c.name;
  expect_same(result("one.hexresult"), many);
}

TEST_F(HexsolveMpi, AlgebraicMultigridFindsTheSame) {
  const std::string sharp = "liver.hexmesh liver.toml --level 0 --set solve.tolerance=1e-10 --force ";
  ASSERT_EQ(run("hexsolve " + sharp + "-o one.hexresult").exit_code, 0);
  const CommandResult r = run(mpi(2) + sharp + "-o many.hexresult -- -pc_type gamg -pc_gamg_agg_nsmooths 1 -ksp_view");
  ASSERT_EQ(r.exit_code, 0) << r.errors;
  EXPECT_NE(r.output.find("type: gamg"), std::string::npos) << r.output;
  EXPECT_NE(r.output.find("near null space"), std::string::npos) << r.output;
  expect_same(result("one.hexresult"), result("many.hexresult"));
}

TEST_F(HexsolveMpi, WhatIsWrongIsSaidOnceAndLeavesNothing) {
  const auto expect = [&](const std::string& arguments, int code, const std::string& words) {
    SCOPED_TRACE(arguments);
    const CommandResult r = run(mpi(whole_or(3, 2)) + arguments);
    EXPECT_EQ(r.exit_code, code) << r.errors;
    const std::size_t first = r.errors.find("hexsolve-mpi: error: ");
    ASSERT_NE(first, std::string::npos) << r.errors;
    EXPECT_EQ(r.errors.find("hexsolve-mpi: error: ", first + 1), std::string::npos) << r.errors;
    EXPECT_NE(r.errors.find(words), std::string::npos) << r.errors;
    EXPECT_FALSE(std::filesystem::exists(*folder / "none.hexresult"));
  };
  const std::string lattice = "liver.hexmesh ", to = " -o none.hexresult";
  if (is_full()) {
    expect(lattice + "liver.toml", 2, "-o RESULT is missing");
    expect("absent.hexmesh liver.toml" + to, 3, "absent.hexmesh");
    expect(lattice + "liver.toml --level 9" + to, 3, "expected 0 to");
  }
  expect("liver.seg.nrrd liver.toml" + to, 3, "not a readable HDF5 file");
  expect(lattice + "liver.toml --set solve.islands=drop" + to, 3, "not for several processes");
  write_text(*folder / "unheld.toml",
             "[[displace]]\nby_mm = [1, 0, 0]\naxes = \"x\"\npoint_mm = [0, 0, 0]\nradius_mm = 30\n"
             "max_distance_mm = 100\n");
  expect(lattice + "unheld.toml" + to, 4, "missing supports");
  write_text(*folder / "far.toml", "[[fix]]\npoint_mm = [500, 0, 0]\n");
  if (is_full()) expect(lattice + "far.toml" + to, 4, "mm from the nearest surface point");
  write_text(*folder / "segment.toml", "[[fix]]\nsegment = \"spleen\"\n");
  expect(lattice + "segment.toml" + to, 3, "unknown segment 'spleen'");
}

TEST_F(HexsolveMpi, PartsThatHangByAnEdgeAreToldAsByOne) {
  // Two boxes on different processes that share one edge: the second turns about it.
  ASSERT_EQ(run("hexscan phantom box --spacing 5 --set width=40 --set length=40 --set height=40 -o one.nrrd && "
                "hexscan phantom box --spacing 5 --set width=40 --set length=40 --set height=40 --set shift_x=40 "
                "--set shift_z=40 -o two.nrrd && hexscan --input one=one.nrrd --input two=two.nrrd -o boxes.nrrd && "
                "hexmesh build boxes.nrrd --material '*:young_kpa=100,poisson=0.3' -o boxes.hexmesh")
                .exit_code,
            0);
  write_text(*folder / "hinge.toml", "[[fix]]\nhalfspace = { point_mm = [-19, 0, 0], normal = [-1, 0, 0] }\n");
  const std::string arguments = "boxes.hexmesh hinge.toml --level 0 -o hinge.hexresult";
  const CommandResult one = run("hexsolve " + arguments);
  ASSERT_EQ(one.exit_code, 4) << one.errors;
  const std::size_t begin = one.errors.find("missing supports"), end = one.errors.find(", expected every part held");
  ASSERT_NE(begin, std::string::npos) << one.errors;
  for (const int processes : {1, 2, 3}) {
    const CommandResult many = run(mpi(processes) + arguments);
    EXPECT_EQ(many.exit_code, 4) << many.errors;
    EXPECT_NE(many.errors.find(one.errors.substr(begin, end - begin)), std::string::npos) << many.errors;
  }
}

TEST_F(HexsolveMpi, MoreProcessesThanLayersAndFarSurfacesFindTheSame) {
  // A sheet of one layer, with a surface that lies away from its cells.
  ASSERT_EQ(
      run("hexscan phantom sheet --spacing 5 --set height=5 -o sheet.nrrd && "
          "hexmesh build sheet.nrrd --material '*:young_kpa=100,poisson=0.3' -o flat.hexmesh && "
          "printf 'v -40 -40 7\\nv 40 -40 7\\nv 0 40 9\\nf 1 2 3\\n' >far.obj && "
          "hexmesh build sheet.nrrd --material '*:young_kpa=100,poisson=0.3' --embed \"$(hexmesh info flat.hexmesh "
          "--json | sed -n 's/.*\"name\": \"\\(.*\\)\".*/\\1/p' | head -1)=far.obj\" -o sheet.hexmesh")
          .exit_code,
      0);
  write_text(*folder / "sheet.toml",
             "[[fix]]\nhalfspace = { point_mm = [-44, 0, 0], normal = [-1, 0, 0] }\n[[displace]]\n"
             "halfspace = { point_mm = [44, 0, 0], normal = [1, 0, 0] }\nby_mm = [0, 4, 3]\n");
  const std::string sharp =
      "sheet.hexmesh sheet.toml --level 0 --set solve.strain=corotational --set solve.tolerance=1e-10 --force ";
  ASSERT_EQ(run("hexsolve " + sharp + "-o one.hexresult").exit_code, 0);
  for (const int processes : whole_or<std::vector<int>>({1, 5}, {5})) {
    const CommandResult r = run(mpi(processes) + sharp + "-o many.hexresult");
    ASSERT_EQ(r.exit_code, 0) << r.errors;
    const Result many = result("many.hexresult");
    EXPECT_GT(many.surface_displacement.size(), 0U);
    EXPECT_GT(many.surface_displacement.front().norm(), 0);
    expect_same(result("one.hexresult"), many);
  }
}

TEST_F(HexsolveMpi, ProcessesWithoutCellsFindTheSame) {
  // Eight cells, which are one process's.
  ASSERT_EQ(run("hexscan phantom box --spacing 5 --set width=10 --set length=10 --set height=10 -o tiny.nrrd && "
                "hexmesh build tiny.nrrd --material '*:young_kpa=100,poisson=0.49' -o tiny.hexmesh")
                .exit_code,
            0);
  write_text(*folder / "tiny.toml",
             "[[fix]]\nhalfspace = { point_mm = [-4.9, 0, 0], normal = [-1, 0, 0] }\n[[displace]]\n"
             "halfspace = { point_mm = [4.9, 0, 0], normal = [1, 0, 0] }\nby_mm = [0, 1, 1]\n");
  const std::string sharp = "tiny.hexmesh tiny.toml --level 0 --set solve.tolerance=1e-10 --force ";
  ASSERT_EQ(run("hexsolve " + sharp + "-o one.hexresult").exit_code, 0);
  const CommandResult r = run(mpi(4) + sharp + "-o many.hexresult");
  ASSERT_EQ(r.exit_code, 0) << r.errors;
  expect_same(result("one.hexresult"), result("many.hexresult"));
}

TEST_F(HexsolveMpi, SurfacePointsMoveWithTheNearestCellWhoeverHasIt) {
  // The point of the surface over the small box lies in layers of a process that has cells of the large one only.
  ASSERT_EQ(
      run("hexscan phantom box --spacing 5 --set width=40 --set length=40 --set height=40 -o small.nrrd && "
          "hexscan phantom box --spacing 5 --set width=120 --set length=120 --set height=40 --set shift_x=70 "
          "--set shift_z=40 -o large.nrrd && hexscan --input small=small.nrrd --input large=large.nrrd -o steps.nrrd "
          "&& "
          "printf 'v -12 0 28\\nv -12 3 28\\nv -15 0 28\\nf 1 2 3\\n' >over.obj && "
          "hexmesh build steps.nrrd --material '*:young_kpa=100,poisson=0.3' --embed small=over.obj -o steps.hexmesh")
          .exit_code,
      0);
  write_text(
      *folder / "steps.toml",
      "[[fix]]\nhalfspace = { point_mm = [129, 0, 0], normal = [1, 0, 0] }\n[[displace]]\nhalfspace = { point_mm = "
      "[-19, 0, 0], normal = [-1, 0, 0] }\nby_mm = [0, 4, 3]\n");
  const std::string sharp =
      "steps.hexmesh steps.toml --level 0 --set solve.strain=corotational --set solve.tolerance=1e-10 --force ";
  ASSERT_EQ(run("hexsolve " + sharp + "-o one.hexresult").exit_code, 0);
  const CommandResult r = run(mpi(5) + sharp + "-o many.hexresult");
  ASSERT_EQ(r.exit_code, 0) << r.errors;
  const Result one = result("one.hexresult");
  EXPECT_GT(one.surface_displacement.front().norm(), 1);
  expect_same(one, result("many.hexresult"));
}

TEST_F(HexsolveMpi, OptionsThatWouldFindSomethingElseAreRefused) {
  const std::string arguments = "liver.hexmesh liver.toml --level 2 -o none.hexresult -- ";
  for (const char* option : whole_or<std::vector<const char*>>(
           {"-snes_linesearch_type bt", "-snes_type newtontr", "-pc_mg_levels 2", "-snes_max_it 1", "-pc_type mg"},
           {"-snes_type newtontr", "-pc_type mg"})) {
    const CommandResult r = run(mpi(2) + arguments + option);
    EXPECT_EQ(r.exit_code, 2) << option << r.errors;
    EXPECT_NE(r.errors.find("PETSc's option -"), std::string::npos) << r.errors;
    EXPECT_FALSE(std::filesystem::exists(*folder / "none.hexresult"));
  }
  const CommandResult r = run(mpi(2) + "liver.hexmesh liver.toml --level 2 --force -o some.hexresult -- -kps_monitor");
  EXPECT_EQ(r.exit_code, 0) << r.errors;
  EXPECT_NE(r.errors.find("did not ask for its option '-kps_monitor'"), std::string::npos) << r.errors;
}

TEST_F(HexsolveMpi, SupportsMoveInPartsWhereTheLawHasNoMeaningBeyond) {
  write_text(*folder / "far.toml",
             "[solve]\nlaw = \"neo-hookean\"\n[[fix]]\nhalfspace = { point_mm = [40, 0, 0], normal = [1, 0, 0] }\n"
             "[[displace]]\nhalfspace = { point_mm = [-40, 0, 0], normal = [-1, 0, 0] }\nby_mm = [-90, 0, 0]\n");
  const std::string sharp = "liver.hexmesh far.toml --level 1 --set solve.tolerance=1e-10 --force ";
  const CommandResult one = run("hexsolve " + sharp + "-o one.hexresult");
  ASSERT_EQ(one.exit_code, 0) << one.errors;
  const CommandResult many = run(mpi(2) + sharp + "-o many.hexresult");
  ASSERT_EQ(many.exit_code, 0) << many.errors;
  EXPECT_LT(largest_difference(result("one.hexresult").displacement, result("many.hexresult").displacement), 1e-6);
}

TEST_F(HexsolveMpi, ALoadThatCannotBeReachedIsNotCalledSolved) {
  const std::string far = "liver.hexmesh liver.toml --level 2 --set 'displace.0.by_mm=[0,0,900]' --force ";
  const CommandResult one = run("hexsolve " + far + "-o one.hexresult");
  const CommandResult many = run(mpi(2) + far + "-o many.hexresult --report many.json");
  EXPECT_EQ(one.exit_code, many.exit_code) << many.errors;
  if (many.exit_code == 0) return;
  EXPECT_EQ(many.exit_code, 5);
  EXPECT_FALSE(report("many.json")["converged"].get<bool>());
  EXPECT_FALSE(json::parse(result("many.hexresult").report)["converged"].get<bool>());
}

TEST_F(HexsolveMpi, ARealLiverAtFullResolution) {
  const auto scan = shared_data() / "data/totalsegmentator/example_seg.nii.gz";
  if (!std::filesystem::exists(scan)) GTEST_SKIP() << "no shared data beside the project";
  ASSERT_EQ(run(fmt::format("hexscan '{}' --segment 5=liver --largest-component -o real.nrrd && "
                            "hexmesh build real.nrrd --material liver:young_kpa=100,poisson=0.3 -o real.hexmesh && "
                            "hexsolve real.hexmesh --example -o real.toml",
                            scan.string()))
                .exit_code,
            0);
  const std::string sharp =
      fmt::format("real.hexmesh real.toml --level {} --set solve.tolerance=1e-10 --force ", whole_or(0, 1));
  ASSERT_EQ(run("hexsolve " + sharp + "-o real1.hexresult --report one.json").exit_code, 0);
  const CommandResult r = run(mpi(2) + sharp + "-o real2.hexresult --report many.json");
  ASSERT_EQ(r.exit_code, 0) << r.errors;
  expect_same(result("real1.hexresult"), result("real2.hexresult"));
  expect_same_reports(report("one.json"), report("many.json"));
  EXPECT_NEAR(report("many.json")["linear_iterations"].get<int>(), report("one.json")["linear_iterations"].get<int>(),
              1);
}

TEST_F(HexsolveMpi, ARealLiverWithItsVesselsCutOutTakesAsManyIterationsAsByOne) {
  const auto scan = shared_data() / "data/derived/liver-medrad-p2.seg.nrrd";
  if (!std::filesystem::exists(scan)) GTEST_SKIP() << "no shared data beside the project";
  ASSERT_EQ(run(fmt::format("hexscan '{}' --segment liver --largest-component -o cut.nrrd && "
                            "hexmesh build cut.nrrd --material liver:young_kpa=10,poisson=0.49 -o cut.hexmesh && "
                            "hexsolve cut.hexmesh --example -o cut.toml",
                            scan.string()))
                .exit_code,
            0);
  const std::string arguments =
      "cut.hexmesh cut.toml --level 2 --set solve.islands=error --set solve.strain=cauchy --force ";
  ASSERT_EQ(run("hexsolve " + arguments + "-o cut1.hexresult --report one.json").exit_code, 0);
  const CommandResult r = run(mpi(2) + arguments + "-o cut2.hexresult --report many.json");
  ASSERT_EQ(r.exit_code, 0) << r.errors;
  EXPECT_NEAR(report("many.json")["linear_iterations"].get<int>(), report("one.json")["linear_iterations"].get<int>(),
              1);
}

}  // namespace test_hexsolve_mpi
