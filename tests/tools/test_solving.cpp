// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <sstream>

#include "hexmesh/file/lattice_file.h"
#include "hexmesh/file/result_file.h"
#include "hexmesh/surface/extract.h"
#include "support/plain_hdf5.h"
#include "tools_fixture.h"

namespace test_solving {

using namespace testing_support;
using nlohmann::json;

const char* const sway_scene = R"([solve]
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

/// The stream's last frame is the surface of the result.
void expect_last_frame(const std::string& stream_of_all, const hexmesh::Result& result) {
  std::istringstream stream(stream_of_all);
  std::string word;
  std::size_t points = 0, triangles = 0;
  stream >> word >> word >> word >> points >> word >> triangles;
  EXPECT_EQ(points, result.surface.points.size());
  const std::size_t frame = 8 + 12 * points, head = stream_of_all.find("\n\n") + 2 + 12 * triangles;
  ASSERT_EQ(stream_of_all.size(), head + 11 * frame);
  double time = 0;
  std::vector<float> positions(3 * points);
  std::memcpy(&time, &stream_of_all[head + 10 * frame], 8);
  std::memcpy(positions.data(), &stream_of_all[head + 10 * frame + 8], 12 * points);
  EXPECT_EQ(time, result.times.back());
  for (std::size_t p = 0; p < points; ++p)
    for (int d = 0; d < 3; ++d)
      ASSERT_NEAR(positions[3 * p + static_cast<std::size_t>(d)],
                  result.surface.points[p][d] + result.surface_displacement[p][d], 1e-4);
}

/// What CalculiX printed for all nodes of a result.
void expect_displacements(const std::string& printed, const hexmesh::Result& ours, double tolerance_mm) {
  std::istringstream rows(printed);
  std::string line;
  std::size_t compared = 0;
  while (std::getline(rows, line)) {
    std::istringstream values(line);
    std::size_t node = 0;
    hexmesh::Vec3 u;
    if (!(values >> node >> u[0] >> u[1] >> u[2])) continue;
    ASSERT_LE(node, ours.nodes.size());
    EXPECT_LT((ours.displacement[node - 1] - u).norm(), tolerance_mm) << "node " << node;
    ++compared;
  }
  EXPECT_EQ(compared, ours.nodes.size());
}

TEST_F(Tools, ThreadsWaitWithoutSpinningUnlessTold) {
  for (const char* tool : {"hexscan", "hexmesh", "hexsolve", "hexfit", "hexexport", "hexslice"}) {
    const std::string asks = std::string(tool) + " --version";
    const auto spins = [&](const std::string& environment) {
      const std::string said =
          run("env -u OMP_WAIT_POLICY -u GOMP_SPINCOUNT OMP_DISPLAY_ENV=verbose " + environment + " " + asks).errors;
      const std::size_t at = said.find("GOMP_SPINCOUNT = '");
      return at == std::string::npos ? -1.0 : std::stod(said.substr(at + 18));
    };
    EXPECT_EQ(spins(""), 1000) << tool;
    EXPECT_EQ(spins("GOMP_SPINCOUNT=7"), 7) << tool;
    EXPECT_GT(spins("OMP_WAIT_POLICY=active"), 1e6) << tool;
  }
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
  constexpr double asked = 0.15;
  ASSERT_EQ(run("hexsolve liver.hexmesh liver.toml --accuracy 0.15 --report acc.json -o acc.hexresult").exit_code, 0);
  const json report = json::parse(read_text(*folder / "acc.json"));
  EXPECT_LE(report["error_estimate_mm"]["mean"], asked);
  EXPECT_LE(report["error_estimate_mm"]["algebraic"], 0.1 * asked);
  EXPECT_GT(report["lattice"]["level"], 0);
  const json& levels = report["levels"];
  ASSERT_GE(levels.size(), 2U);
  EXPECT_GT(levels[levels.size() - 2]["error_mm"]["mean"], asked / 1.5);
  EXPECT_EQ(hexmesh::read_result(*folder / "acc.hexresult").level, report["lattice"]["level"].get<int>());

  // Finer than the scan: the finest level, and no success.
  const CommandResult tight = run("hexsolve liver.hexmesh liver.toml --accuracy 1e-6 -o tight.hexresult");
  EXPECT_EQ(tight.exit_code, 5);
  EXPECT_NE(tight.errors.find("accuracy not reached: the estimated error of level 0 is"), std::string::npos)
      << tight.errors;
  // Graded cells are halved until it is reached, or what was asked for is not there and the memory is named.
  const std::string graded = "hexsolve liver.hexmesh liver.toml --set 'solve.grading=\"scene\"' --accuracy ";
  const CommandResult plan = run(graded + "0.7 --plan");
  EXPECT_NE(plan.output.find("graded cells are halved for the accuracy on the way"), std::string::npos) << plan.output;
  ASSERT_EQ(run(graded + "0.7 --report graded.json -o graded.hexresult").exit_code, 0);
  EXPECT_LE(json::parse(read_text(*folder / "graded.json"))["error_estimate_mm"]["mean"], 0.7);
  const CommandResult small = run(graded + "0.001 --max-memory 1 -o small.hexresult");
  EXPECT_EQ(small.exit_code, 5);
  EXPECT_NE(small.errors.find("MB (--max-memory)"), std::string::npos) << small.errors;
  for (const char* value : {"nan", "inf", "0", "-1"})
    expect_failure(fmt::format("hexsolve liver.hexmesh liver.toml --accuracy {} -o no.hexresult", value), 2,
                   {"expected a number > 0"});
  // Of reactions, also in the scene.
  ASSERT_EQ(
      run("hexsolve liver.hexmesh liver.toml --accuracy reaction=20% --report part.json -o part.hexresult").exit_code,
      0);
  const json part = json::parse(read_text(*folder / "part.json"));
  EXPECT_LE(part["reactions_error"], 0.2);
  EXPECT_GT(part["lattice"]["level"], 0);
  double largest = 0, error = 0;
  for (const json& c : part["conditions"]) {
    const auto r = c["reaction_n"].get<std::vector<double>>();
    largest = std::max(largest, std::hypot(r[0], r[1], r[2]));
    error = std::max(error, c["reaction_error_n"].get<double>());
  }
  EXPECT_NEAR(part["reactions_error"].get<double>(), error / largest, 0.1 * error / largest);
  EXPECT_EQ(run("hexsolve liver.hexmesh liver.toml --set solve.accuracy_reactions=0.2 -o same.hexresult").exit_code, 0);
  EXPECT_EQ(run("hexbench compare --exact part.hexresult same.hexresult").exit_code, 0);
  EXPECT_EQ(run("hexsolve liver.hexmesh liver.toml --accuracy reaction=0.001% -o few.hexresult").exit_code, 5);
  for (const char* value : {"reaction=0", "reaction=200%", "reaction=", "force=5%"})
    expect_failure(fmt::format("hexsolve liver.hexmesh liver.toml --accuracy {} -o no.hexresult", value), 2,
                   {"expected", "reaction="});
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
      fmt::format("hexsolve liver.hexmesh liver.toml --level 1 -o refused.hexresult --max-memory {}", 0.1 * expected),
      3, {"--max-memory", "coarser level"});
}

TEST_F(Tools, CheckAndPlanSolveNothing) {
  const auto before = listing();
  const CommandResult check = run("hexsolve liver.hexmesh liver.toml --level 1 --check");
  EXPECT_EQ(check.exit_code, 0) << check.errors;
  EXPECT_NE(check.output.find("condition 'back': "), std::string::npos) << check.output;
  const json plan = json::parse(run("hexsolve liver.hexmesh liver.toml --level 1 --plan --report -").output);
  EXPECT_EQ(plan["levels"].back()["level"], 1);
  EXPECT_GT(plan["levels"].back()["seconds"], 0);
  EXPECT_GT(plan["setup_seconds"], 0);
  EXPECT_GT(plan["reading_seconds"], 0);
  double seconds = plan["setup_seconds"].get<double>() + plan["reading_seconds"].get<double>() +
                   plan["strain_seconds"].get<double>();
  seconds += plan["look"]["seconds"].get<double>();  // at level 0, for the error estimate
  EXPECT_EQ(plan["look"]["level"], 0);
  for (const json& l : plan["levels"]) seconds += l["seconds"].get<double>();
  EXPECT_NEAR(plan["seconds"].get<double>(), seconds, 1e-9 * seconds);
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
  EXPECT_GT(did["memory_mb"]["supports"], 0);
  EXPECT_FALSE(active(did["effects"], "gravity"));
  EXPECT_LT(std::abs(std::log(plan["memory_mb"].get<double>() / did["peak_memory_mb"].get<double>())), std::log(1.3));
}

TEST_F(Tools, ADeckIsTheSameModel) {
  // As the CalculiX program of Debian solves it, where that is installed.
  ASSERT_EQ(run("sed 's/^radius_mm = 10$/radius_mm = 10\\non = \"nodes\"/' liver.toml > nodes.toml").exit_code, 0);
  ASSERT_EQ(run("printf '[gravity]\\nm_s2 = [1, 2, -9]\\n[[force]]\\npressure_kpa = 0.5\\nhalfspace = "
                "{ point_mm = [60, 0, 0], normal = [1, 0, 0] }\\n' >> nodes.toml")
                .exit_code,
            0);
  ASSERT_EQ(run("hexsolve liver.hexmesh nodes.toml --level 0 --set solve.strain=cauchy --set solve.volumetric=full "
                "-o nodes.hexresult")
                .exit_code,
            0);
  ASSERT_EQ(run("hexexport nodes.hexresult --inp deck.inp").exit_code, 0);
  const std::string deck = read_text(*folder / "deck.inp");
  for (const char* word : {"*NODE, NSET=ALL\n", "*ELEMENT, TYPE=C3D8, ELSET=S1_liver\n", "*ELASTIC\n0.1, 0.3\n",
                           "*STEP\n*STATIC\n*BOUNDARY\n", "*CLOAD\n"})
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

  const hexmesh::Result ours = hexmesh::read_result(*folder / "nodes.hexresult");
  hexmesh::Vec3 sum = hexmesh::Vec3::Zero();
  for (const hexmesh::Vec3& force : ours.load) sum += force;
  const json report = json::parse(ours.report);
  for (const json& force : report["forces"])
    for (int d = 0; d < 3; ++d) sum[d] -= force["total_n"][static_cast<std::size_t>(d)].get<double>();
  EXPECT_LT(sum.norm(), 1e-12);
  if (run("command -v ccx").exit_code != 0) GTEST_SKIP() << "no ccx on this machine";
  ASSERT_EQ(run("OMP_NUM_THREADS=1 ccx -i deck").exit_code, 0);
  expect_displacements(read_text(*folder / "deck.dat"), ours, 1e-4);
}

TEST_F(Tools, ADeckHoldsObstacles) {
  // The body is pulled onto a plane, which moves towards it, and pressed by a ball and a box.
  const std::string scene =
      "[solve]\nstrain = \"cauchy\"\nvolumetric = \"full\"\ntolerance = 1e-10\n[[fix]]\non = \"nodes\"\n"
      "halfspace = { point_mm = [-60, 0, 0], normal = [-1, 0, 0] }\n[[force]]\nnewton = [0, -0.3, 0]\n"
      "halfspace = { point_mm = [60, 0, 0], normal = [1, 0, 0] }\n";
  const auto contact = [](const std::string& name, const std::string& shape, const std::string& by,
                          const std::string& more) {
    return "[[contact]]\nname = \"" + name + "\"\n" + shape + "\nby_mm = " + by + "\n" + more + "\n";
  };
  const auto obstacles = [&](const std::string& more) {
    return contact("plane", "plane = { point_mm = [60, -54, 0], normal = [-0.15, 1, 0] }", "[0, 7, 0]", more) +
           contact("ball", "sphere = { center_mm = [80, 0, -68], radius_mm = 45 }", "[0, 0, 20]", more) +
           contact("box",
                   "box = { center_mm = [60, 20, 80], size_mm = [40, 40, 40], turned_about = [1, 0, 0], "
                   "degrees = 30 }",
                   "[0, 0, -5]", more);
  };
  ASSERT_EQ(run("hexscan phantom liver --spacing 8 -o pressed.nrrd && hexmesh build pressed.nrrd --material "
                "'*:young_kpa=40,poisson=0.3' -o pressed.hexmesh")
                .exit_code,
            0);
  const auto deck_of = [&](const std::string& name, const std::string& more) {
    write_text(*folder / (name + ".toml"), scene + obstacles(more));
    ASSERT_EQ(run("hexsolve pressed.hexmesh " + name + ".toml --level 0 -o " + name + ".hexresult").exit_code, 0);
  };
  const auto solve = [&](const std::string& name) {
    ASSERT_EQ(run("hexexport " + name + ".hexresult --inp " + name + ".inp").exit_code, 0);
    ASSERT_EQ(run("OMP_NUM_THREADS=1 ccx -i " + name).exit_code, 0);
  };
  deck_of("rubbed", "friction = 0.3");
  expect_failure("hexexport rubbed.hexresult --inp rubbed.inp", 3, {"friction"});
  deck_of("soft", "stiffness_n_mm = 0.2");
  const hexmesh::Result soft = hexmesh::read_result(*folder / "soft.hexresult");
  for (const json& c : json::parse(soft.report)["contacts"]) EXPECT_GT(c["points"], 0) << c["name"];
  if (run("command -v ccx").exit_code != 0) GTEST_SKIP() << "no ccx on this machine";
  solve("soft");
  expect_displacements(read_text(*folder / "soft.dat"), soft, 1e-5);
  // Hard ones are as deep as the rounds that press them out leave, a thousandth of a voxel.
  deck_of("hard", "");
  solve("hard");
  expect_displacements(read_text(*folder / "hard.dat"), hexmesh::read_result(*folder / "hard.hexresult"), 8e-3);
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

TEST_F(Tools, AnInterruptedMotionIsKeptAsFarAsItCame) {
  write_text(*folder / "long.toml", sway_scene);
  const CommandResult r =
      run("true; hexsolve liver.hexmesh long.toml --level 3 --set dynamics.duration_s=4000 --progress always -o "
          "cut.hexresult "
          "--report cut.json 2>log.txt & pid=$!; for n in $(seq 600); do grep -q kinetic log.txt && break; sleep 0.05; "
          "done; kill -TERM $pid; wait $pid; echo $?; tail -n 1 log.txt");
  EXPECT_EQ(r.output.substr(0, r.output.find('\n')), "143") << r.output;
  EXPECT_NE(r.output.find("hexsolve: error: interrupted at "), std::string::npos) << r.output;
  const json report = json::parse(read_text(*folder / "cut.json"));
  EXPECT_FALSE(report["converged"]);
  const int steps = report["motion"]["steps"];
  const hexmesh::Result cut = hexmesh::read_result(*folder / "cut.hexresult");
  ASSERT_GT(steps, 0);
  EXPECT_NEAR(cut.times.back(), 0.02 * steps, 1e-9);
  EXPECT_EQ(report["motion"]["rows"].size(), cut.times.size());
  const CommandResult on =
      run("hexsolve liver.hexmesh long.toml --level 3 --set dynamics.start=cut.hexresult -o on.hexresult");
  EXPECT_EQ(on.exit_code, 0) << on.errors;
}

TEST_F(Tools, AMotionIsKeptStreamedAndGoesOnFromAResult) {
  write_text(*folder / "sway.toml", sway_scene);
  const CommandResult r =
      run("hexsolve liver.hexmesh sway.toml --level 2 -o sway.hexresult --stream --report sway.json");
  ASSERT_EQ(r.exit_code, 0) << r.errors;
  const json report = json::parse(read_text(*folder / "sway.json"));
  EXPECT_EQ(report["kind"], "dynamics");
  EXPECT_EQ(report["motion"]["steps"], 10);
  ASSERT_EQ(report["motion"]["rows"].size(), 4U);  // 0, 4, 8, 10
  EXPECT_GT(report["motion"]["rows"][3]["kinetic_n_mm"].get<double>(), 0);
  EXPECT_GT(report["steps_per_second"].get<double>(), 0);
  hexmesh::Result result = hexmesh::read_result(*folder / "sway.hexresult");
  EXPECT_TRUE(result.surface.points.empty());
  hexmesh::add_surface(result);  // that of the lattice
  EXPECT_EQ(result.times, (std::vector<double>{0, 0.08, 0.16, 0.2}));
  EXPECT_EQ(hexmesh::read_step(*folder / "sway.hexresult", result, 3).displacement, result.displacement);

  expect_last_frame(r.output, result);

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
                 {"an accuracy goes with an equilibrium"});
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

TEST_F(Tools, SolvesWithTheMatricesOfTheLatticeFile) {
  write_text(*folder / "push.toml", R"([solve]
strain = "cauchy"
tolerance = 1e-8
[[fix]]
point_mm = [-101, -6, -8]
radius_mm = 20
[[force]]
halfspace = { point_mm = [40, 0, 0], normal = [1, 0, 0] }
newton = [0.01, 0, 0.01]
)");
  for (const char* storage : {"all", "none"})
    ASSERT_EQ(run(fmt::format("hexmesh build liver.nrrd -o {0}.hexmesh --force --matrices {0}", storage)).exit_code, 0);
  const auto solve = [&](const std::string& lattice) {
    const CommandResult r =
        run(fmt::format("hexsolve {0}.hexmesh push.toml --level 2 --force -o {0}.hexresult", lattice));
    EXPECT_EQ(r.exit_code, 0) << r.errors;
    return hexmesh::read_result(*folder / (lattice + ".hexresult")).displacement;
  };
  const auto largest_difference = [](const std::vector<hexmesh::Vec3>& a, const std::vector<hexmesh::Vec3>& b,
                                     double factor) {
    double difference = 0, largest = 0;
    for (std::size_t n = 0; n < a.size(); ++n) {
      difference = std::max(difference, (a[n] - factor * b[n]).norm());
      largest = std::max(largest, a[n].norm());
    }
    return difference / largest;
  };
  const std::vector<hexmesh::Vec3> stored = solve("all");
  EXPECT_LE(largest_difference(stored, solve("none"), 1), 1e-7);

  // Twice as stiff on paper: half the displacement, and not what the voxels give.
  std::filesystem::copy(*folder / "all.hexmesh", *folder / "stiff.hexmesh");
  const int num_levels = static_cast<int>(hexmesh::cells_of_levels(*folder / "all.hexmesh").size());
  for (int level = 1; level < num_levels; ++level)
    for (const char* set : {"stiffness", "deviatoric", "bulk"})
      scale_dataset(*folder / "stiff.hexmesh", fmt::format("/levels/{}/elements/{}", level, set), 2);
  EXPECT_LE(largest_difference(stored, solve("stiff"), 2), 1e-7);
  const CommandResult check = run("hexmesh check stiff.hexmesh");
  EXPECT_EQ(check.exit_code, 3);
  EXPECT_NE(check.errors.find("'stored matrices are those of the voxels' at level 1"), std::string::npos)
      << check.errors;
  scale_dataset(*folder / "stiff.hexmesh", "/levels/2/elements/stiffness", 2);
  expect_failure("hexsolve stiff.hexmesh push.toml --level 2 -o x.hexresult", 3, {"contradict each other"});

  EXPECT_NE(run("hexmesh check none.hexmesh").output.find("levels without stored matrices, nothing to compare: 0, 1"),
            std::string::npos);
  EXPECT_TRUE(json::parse(run("hexmesh info all.hexmesh --json").output)["levels"][1]["stored_matrices"]);
  expect_failure("hexmesh build liver.nrrd -o y.hexmesh --matrices some", 2, {"--matrices"});
}

TEST_F(Tools, CellsOfSeveralLevels) {
  ASSERT_EQ(run("hexsolve liver.hexmesh liver.toml --level 0 --report ungraded.json -o ungraded.hexresult").exit_code,
            0);
  ASSERT_EQ(run("hexsolve liver.hexmesh liver.toml --level 0:2 --report graded.json -o graded.hexresult").exit_code, 0);
  ASSERT_EQ(
      run("hexsolve liver.hexmesh liver.toml --set solve.grading=scene --level 0 -o graded_scene.hexresult").exit_code,
      0);
  const json graded = json::parse(read_text(*folder / "graded.json")),
             alike = json::parse(read_text(*folder / "ungraded.json"));
  EXPECT_LT(graded["levels"].back()["dofs"].get<int>(), alike["levels"].back()["dofs"].get<int>() / 2);
  const hexmesh::Result of_graded = hexmesh::read_result(*folder / "graded.hexresult"),
                        of_alike = hexmesh::read_result(*folder / "ungraded.hexresult");
  EXPECT_EQ(of_graded.cells, of_alike.cells);
  EXPECT_EQ(of_graded.displacement, hexmesh::read_result(*folder / "graded_scene.hexresult").displacement);
  std::vector<double> levels = of_graded.cell_fields.at("cell_level");
  std::sort(levels.begin(), levels.end());
  levels.erase(std::unique(levels.begin(), levels.end()), levels.end());
  EXPECT_EQ(levels, (std::vector<double>{0, 1, 2}));
  EXPECT_FALSE(of_alike.cell_fields.contains("cell_level"));
  ASSERT_EQ(run("hexexport graded.hexresult --surface graded.vtp --lattice graded.vtu").exit_code, 0);
  ASSERT_EQ(run("hexsolve liver.hexmesh liver.toml --level 0:2 --set solve.strain=cauchy --set solve.volumetric=full "
                "-o graded_full.hexresult")
                .exit_code,
            0);
  expect_failure("hexexport graded_full.hexresult --inp graded.inp", 3, {"graded cells", "solve.grading"});
  expect_failure("hexsolve liver.hexmesh liver.toml --level 2:1 -o wrong.hexresult", 2, {"'2:1'", "FINE:COARSE"});
  write_text(*folder / "graded_sway.toml", sway_scene);
  ASSERT_EQ(run("hexsolve liver.hexmesh graded_sway.toml --level 1:2 -o graded_sway.hexresult").exit_code, 0);
  ASSERT_EQ(run("hexsolve liver.hexmesh graded_sway.toml --level 1:2 --set dynamics.start=graded_sway.hexresult "
                "--set dynamics.duration_s=0.1 --stream -o graded_on.hexresult > graded_on.stream")
                .exit_code,
            0);
  const hexmesh::Result on = hexmesh::read_result(*folder / "graded_on.hexresult");
  EXPECT_EQ(on.displacement.size(), on.nodes.size());
  EXPECT_EQ(on.velocity.size(), on.nodes.size());
}

}  // namespace test_solving
