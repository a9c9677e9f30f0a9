// SPDX-License-Identifier: Apache-2.0
// "Only the effects a scene calls for": a scene without gravity, contact, rotations and forces costs what a program
// costs that knows none of them.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <regex>
#include <sstream>
#include <utility>
#include <vector>

#include "support/files.h"
#include "support/forms.h"

namespace test_effects {

using namespace testing_support;

constexpr const char* scene = R"([solve]
strain = "cauchy"
tolerance = 1e-8
error_estimate = "off"
[[fix]]
point_mm = [-101, -6, -8]
[[fix]]
point_mm = [-55, 48, -16]
[[fix]]
point_mm = [-55, -14, -50]
[[displace]]
point_mm = [99, -14, 4]
by_mm = [0, -2.8, -2.8]
)";
constexpr const char* patches =
    "-101 -6 -8 10 0 0 0  -55 48 -16 10 0 0 0  -55 -14 -50 10 0 0 0  99 -14 4 10 0 -2.8 -2.8";

/// The number after the last match of `before`.
double number_after(const std::string& text, const std::string& before) {
  const std::size_t at = text.rfind(before);
  EXPECT_NE(at, std::string::npos) << text;
  return at == std::string::npos ? 0 : std::stod(text.substr(at + before.size()));
}

class Effects : public testing::Test {
protected:
  static void SetUpTestSuite() {
    folder = new TemporaryFolder;
    write_text(*folder / "scene.toml", scene);
    for (const int spacing : {4, 7}) {
      const CommandResult made = run(
          fmt::format("hexscan phantom liver --spacing {0} -o {0}.nrrd --quiet && hexmesh build {0}.nrrd --material "
                      "'*:young_kpa=100,poisson=0.3' -o {0}.hexmesh --quiet",
                      spacing));
      ASSERT_EQ(made.exit_code, 0) << made.errors;
    }
  }
  static void TearDownTestSuite() { delete folder; }
  static CommandResult run(const std::string& command) {
    return shell("cd '" + folder->path("") + "' && export OMP_NUM_THREADS=1 && " + command);
  }

  /// What `measure` says of hexsolve's command over what it says of that of the least program, less what both say of
  /// their start.
  template <class F>
  static void expect_equal(int spacing, F&& measure) {
    const double least = measure(fmt::format("elastic_only {}.hexmesh least.hexresult {}", spacing, patches)) -
                         measure("elastic_only - -");
    const double ours =
        measure(fmt::format("hexsolve {}.hexmesh scene.toml --level 0 --force --quiet -o ours.hexresult", spacing)) -
        measure("hexsolve --help");
    std::printf("least program %.0f, hexsolve %.0f: %+.2f %%\n", least, ours, 100 * (ours / least - 1));
    EXPECT_GT(least, 0);
    EXPECT_NEAR(ours, least, 0.005 * least);
  }
  static double instructions_of(const std::string& command) {
    const CommandResult r = run("valgrind --tool=callgrind --callgrind-out-file=/dev/null " + command);
    EXPECT_TRUE(r.exit_code == 0 || command == "elastic_only - -") << r.errors;  // which only starts
    return number_after(r.errors, "Collected : ");
  }
  static double bytes_read_by(const std::string& command) {
    return number_after(run("sh -c '" + command + " >/dev/null; cat /proc/$$/io'").output, "rchar: ");
  }
  static bool has_valgrind() { return shell("command -v valgrind").exit_code == 0; }

  static inline TemporaryFolder* folder = nullptr;
};

TEST_F(Effects, ThatAreOffTakeNoInstructions) {
  if (!has_valgrind()) GTEST_SKIP() << "no valgrind";
  expect_equal(7, instructions_of);
}

TEST_F(Effects, ThatAreOffTakeNoMemory) {
  if (!is_full()) GTEST_SKIP() << "half a minute: of the label slow";
  if (!has_valgrind()) GTEST_SKIP() << "no valgrind";
  expect_equal(7, [](const std::string& command) {
    run("valgrind --tool=massif --massif-out-file=heap " + command);
    std::istringstream lines(read_text(*folder / "heap"));
    double peak = 0;
    for (std::string line; std::getline(lines, line);)
      if (line.rfind("mem_heap_B=", 0) == 0) peak = std::max(peak, number_after(line, "mem_heap_B="));
    return peak;
  });
}

TEST_F(Effects, OfTheScanWhereFewCellsAreSolvedAreSmall) {
  // The same body of eight times as many voxels, solved with as many cells.
  ASSERT_EQ(run("hexscan phantom liver --spacing 2 -o 2.nrrd --quiet && hexmesh build 2.nrrd --material "
                "'*:young_kpa=100,poisson=0.3' -o 2.hexmesh --quiet")
                .exit_code,
            0);
  const auto solve = [](int spacing, int level) {
    return fmt::format("hexsolve {}.hexmesh scene.toml --level {} --force --quiet -o coarse.hexresult", spacing, level);
  };
  const auto ratio = [&](auto&& measure) {
    const double start = measure("hexsolve --help");
    return (measure(solve(2, 4)) - start) / (measure(solve(4, 3)) - start);
  };
  EXPECT_LT(ratio([](const std::string& command) { return bytes_read_by(command); }), 1.5);
  if (!has_valgrind()) GTEST_SKIP() << "no valgrind";
  EXPECT_LT(ratio([](const std::string& command) { return instructions_of(command); }), 1.5);
}

TEST_F(Effects, ThatAreOffEnterNoFunction) {
  if (!has_valgrind()) GTEST_SKIP() << "no valgrind";
  // Functions of the program that a solution enters; `options`: the level, and what is more than the scene without
  // effects.
  const auto functions = [](const std::string& tables, const std::string& options) {
    write_text(*folder / "effect.toml", std::string(scene) + tables);
    const CommandResult r = run(
        "valgrind --tool=callgrind --compress-strings=no --callgrind-out-file=entered hexsolve 7.hexmesh effect.toml "
        "--force --quiet -o effect.hexresult --set solve.volumetric=full --level " +
        options);
    EXPECT_EQ(r.exit_code, 0) << options << r.errors;
    std::string names;
    std::istringstream lines(read_text(*folder / "entered"));
    for (std::string line; std::getline(lines, line);)
      if (line.rfind("fn=", 0) == 0) names += line + "\n";
    return names;
  };
  struct Case {
    std::vector<std::pair<const char*, const char*>> effects;  ///< name, and what only it enters
    std::string tables, options;
  };
  const std::string motion = "[dynamics]\nstep_s = 0.1\nduration_s = 0.2\n[damping]\nstiffness_s = 0.1\n";
  const std::string loads =
      "[gravity]\nm_s2 = [0, 0.1, 0]\n[[contact]]\nplane = { point_mm = [0, 90, 0], normal = [0, -1, 0] }\n"
      "stiffness_n_mm = 0.1\n";
  const std::vector<Case> cases = {
      {{{"gravity", "DeadLoad::"},
        {"contact", "PenaltyContact::"},
        {"rotation", "CorotationalCells::"},
        {"near-incompressibility", "mean_dilatation_stiffness"},
        {"error estimate", "ErrorEstimator::add"}},
       loads,
       "3 --set solve.strain=corotational --set solve.volumetric=mean --set solve.error_estimate=look"},
      {{{"averaged edges", "EdgeRotatedCells::"}}, "", "3 --set solve.strain=corotational --set solve.rotation=edges"},
      {{{"large strain", "HyperelasticCells::"}}, "", "3 --set solve.law=neo-hookean --set solve.strain=auto"},
      {{{"automatic strain", "choose_strain"}, {"graded cells", "number_graded_nodes"}},
       "",
       "2:3 --set solve.strain=auto"},
      {{{"smoother of near-incompressibility", "BraessSarazin"}},
       "",
       "0 --set solve.volumetric=mean --set material.liver.poisson=0.4995 --set solve.tolerance=0.1"},
      {{{"inertia", "hexsolver::Inertia::"}, {"motion", "hexsolver::Motion::"}, {"damping", "StiffnessDamping::"}},
       motion,
       "3 --set solve.kind=dynamics"},
  };
  const std::string without = functions("", "3");
  EXPECT_NE(without.find("CauchyCells::add_product"), std::string::npos);
  for (const Case& c : cases) {
    const std::string with = functions(c.tables, c.options);
    for (const auto& [name, function] : c.effects) {
      EXPECT_EQ(without.find(function), std::string::npos) << name << " is off, but entered";
      EXPECT_NE(with.find(function), std::string::npos) << name << " has other functions";
    }
  }
}

TEST_F(Effects, ThatADefaultSceneDoesNotNeedCostLittle) {
  // Small motion with every default: what looks for rotations is all that is more than small strain asked for.
  if (!has_valgrind()) GTEST_SKIP() << "no valgrind";
  write_text(*folder / "defaults.toml",
             std::regex_replace(std::string(scene), std::regex("strain.*\ntolerance.*\nerror.*\n"), ""));
  // It looks at 30 cells at least, a larger part of the smaller body of the short form.
  const int spacing = whole_or(4, 7);
  const double allowed = is_full() ? 1.03 : 1.25;
  const auto instructions = [&](const char* options) {
    return instructions_of(
        fmt::format("hexsolve {}.hexmesh defaults.toml --level {} --force --quiet -o d.hexresult "
                    "--set displace.0.by_mm=[0,-0.04,-0.04] {}",
                    spacing, is_full() ? 0 : 1, options));
  };
  const double small = instructions("--set solve.strain=cauchy"), found = instructions("");
  std::printf("small strain %.4g, found %.4g instructions: %+.2f %%\n", small, found, 100 * (found / small - 1));
  EXPECT_GT(found, small);
  EXPECT_LT(found, allowed * small);
}

TEST_F(Effects, ThatAreOffReadNothing) { expect_equal(4, bytes_read_by); }

TEST_F(Effects, OfIslandsThatAreNotThereReadNothing) {
  // Voxels and finer levels are read only where islands go.
  const std::string coarse = "hexsolve 4.hexmesh scene.toml --level 2 --force --quiet -o coarse.hexresult";
  const double as_is = bytes_read_by(coarse);
  EXPECT_NEAR(bytes_read_by(coarse + " --set solve.islands=drop"), as_is, 0.01 * as_is);
}

}  // namespace test_effects
