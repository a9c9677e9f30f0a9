// SPDX-License-Identifier: Apache-2.0
// hexbench as its users call it: what it measures is right, whatever the times are.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "support/files.h"
#include "support/forms.h"

namespace test_bench {

using namespace testing_support;
using nlohmann::json;

/// A coarse phantom liver, solved once for all tests of this file.
class Bench : public testing::Test {
protected:
  static void SetUpTestSuite() {
    folder = new TemporaryFolder;
    const std::string commands =
        "hexscan -q phantom liver --spacing 5 -o liver.seg.nrrd && "
        "hexmesh -q build liver.seg.nrrd --material '*:young_kpa=100,poisson=0.3,density_kg_m3=1000' -o l.hexmesh && "
        "hexsolve -q l.hexmesh --example -o liver.toml && sed -i 's/radius_mm = 10/radius_mm = 20/' liver.toml && "
        "hexsolve -q l.hexmesh liver.toml --level 1 -o liver.hexresult";
    ASSERT_EQ(run(commands).exit_code, 0);
  }
  static void TearDownTestSuite() { delete folder; }

  static CommandResult run(const std::string& command) { return shell("cd '" + folder->path("") + "' && " + command); }

  static inline TemporaryFolder* folder = nullptr;
};

TEST_F(Bench, AccuracyComparesEveryMethodWithItsLimit) {
  const CommandResult r = run(
      "hexbench accuracy l.hexmesh liver.toml --most-elements 6000 --reference-tets 4000 --tolerances 1e-6 --repeats 1 "
      "--iterations 10 --threads 1 --csv a.csv -o a.json");
  ASSERT_EQ(r.exit_code, 0) << r.errors;
  const json report = json::parse(read_text(*folder / "a.json"));
  std::map<std::string, std::vector<std::pair<double, double>>> series;  // dofs and error of each method
  for (const json& row : report["equilibria"]) {
    ASSERT_TRUE(row["converged"]) << row.dump();
    EXPECT_NEAR(row["total_s"].get<double>() /
                    (row["mesh_s"].get<double>() + row["setup_s"].get<double>() + row["solve_s"].get<double>()),
                1, 1e-6);
    const bool is_cells = row["method"].get<std::string>().find("cells") != std::string::npos;
    const double error = row[is_cells ? "to_voxels_mm_mean" : "to_tets_mm_mean"];
    EXPECT_LE(row["to_voxels_mm_min"].get<double>(), row["to_voxels_mm_mean"].get<double>());
    EXPECT_LE(row["to_voxels_mm_mean"].get<double>(), row["to_voxels_mm_max"].get<double>());
    series[row["law"].get<std::string>() + " " + row["method"].get<std::string>()].emplace_back(row["dofs"], error);
  }
  for (const char* method :
       {"cells", "cells, graded", "uniform cells", "tetrahedra, Cholesky", "tetrahedra, graded, CG"})
    for (const char* law : {"cauchy ", "corotational "}) {
      auto& points = series[std::string(law) + method];
      ASSERT_GE(points.size(), 2U) << law << method;
      std::sort(points.begin(), points.end());
      EXPECT_LT(points.back().second, 0.7 * points.front().second) << law << method;
    }
  // The voxels are their own reference, but for the tolerance.
  EXPECT_LT(series["corotational cells"].back().second, 1e-3);
  EXPECT_TRUE(series.contains("corotational tetrahedra, QR, CG"));
  ASSERT_FALSE(report["motions"].empty());
  for (const json& row : report["motions"]) {
    EXPECT_GT(row["steps_per_second"].get<double>(), 0);
    EXPECT_LT(row["to_voxels_mm_mean"].get<double>(), 3) << row.dump();
  }
  // The table has a line for each row and as many commas in each.
  std::istringstream lines(read_text(*folder / "a.csv"));
  std::string line;
  std::getline(lines, line);
  EXPECT_EQ(line.rfind("method,law,tolerance,level,size_mm,converged", 0), 0U) << line;
  std::size_t count = 0;
  while (std::getline(lines, line)) ++count;
  EXPECT_EQ(count, report["equilibria"].size());
}

TEST_F(Bench, AccuracyTakesAScanAndMeshesFromFiles) {
  write_text(*folder / "two.msh",
             "$NOD\n5\n1 -120 -90 -90\n2 200 -90 -90\n3 -120 200 -90\n4 -120 -90 200\n5 200 200 200\n$ENDNOD\n$ELM\n2\n"
             "1 4 1 1 4 1 2 3 4\n2 4 1 1 4 2 3 4 5\n$ENDELM\n");
  CommandResult r = run(
      "hexbench accuracy liver.seg.nrrd liver.toml --laws cauchy --most-elements 400 --reference-tets 500 --repeats 1 "
      "--iterations 0 --tolerances 1e-6 --mesh two.msh");
  ASSERT_EQ(r.exit_code, 0) << r.errors;
  const json report = json::parse(r.output);
  EXPECT_TRUE(report["motions"].empty());
  const auto from_file = std::find_if(report["equilibria"].begin(), report["equilibria"].end(),
                                      [](const json& row) { return row.value("elements", 0) == 2; });
  ASSERT_NE(from_file, report["equilibria"].end());
  EXPECT_EQ((*from_file)["nodes"], 5);
  EXPECT_EQ((*from_file)["method"], "two.msh, Cholesky");
  r = run("hexbench accuracy l.hexmesh liver.toml --laws maxwell");
  EXPECT_EQ(r.exit_code, 2);
  EXPECT_NE(r.errors.find("green-lagrange"), std::string::npos);
}

TEST_F(Bench, PaperPrintsItsNumbersBesideOurs) {
  const CommandResult r = run("hexbench -q paper fig4 fig5 --json p.json");
  ASSERT_EQ(r.exit_code, 0) << r.errors;
  EXPECT_NE(r.output.find("| case | paper | ours | reference | reading |"), std::string::npos);
  const json rows = json::parse(read_text(*folder / "p.json"));
  const json& corner = rows["fig4"][0];
  EXPECT_GT(corner["ours"].get<double>(), 2 * corner["uniform"].get<double>());
  EXPECT_GT(rows["fig5"][0]["ours"].get<double>(), 1.2 * rows["fig5"][0]["uniform"].get<double>());
  EXPECT_EQ(run("hexbench paper fig99").exit_code, 2);
}

TEST_F(Bench, ThePapersTablesHoldWhatTheTextsSay) {
  const CommandResult r = run(std::string("hexbench -q paper table1 fig7 uniform --json tables.json") +
                              (is_full() ? " table2 table3" : ""));
  ASSERT_EQ(r.exit_code, 0) << r.errors;
  json rows = json::parse(read_text(*folder / "tables.json"));
  const auto has = [](const json& row, const char* word) {
    return row["case"].get<std::string>().find(word) != std::string::npos;
  };
  const auto number = [](const json& row, const char* key) { return row.at(key).get<double>(); };
  for (const auto& [name, of] : rows.items())
    for (const json& row : of)
      EXPECT_EQ(row["reading"].get<std::string>().find("NOT CONVERGED"), std::string::npos) << row;
  for (const json& row : rows["table1"]) {  // bulges, as parts of the limit's
    const double bulge = number(row, "reference") - 0.5, off = std::abs(number(row, "ours") - 0.5 - bulge) / bulge;
    EXPECT_LT(off, has(row, "linear") ? 0.01 : has(row, "mean dilatation") ? 0.06 : 0.25) << row;
    EXPECT_GT(number(row, "paper") - 0.5, 1.1 * bulge) << row;
  }
  for (const json& row : rows["table2"]) {
    const double limit = has(row, "coarse cells") ? 0.45 : has(row, "fine cells") ? 0.25 : 1;
    EXPECT_LT(number(row, "to_limit_mm"), limit) << row;
    if (!has(row, "Cauchy")) continue;
    EXPECT_GT(number(row, "ours"), 1.5) << "small strain is the worst: " << row;
  }
  for (const json& row : rows["table3"]) EXPECT_GT(number(row, "ours"), 0) << row;
  for (const json& row : rows["fig7"]) {
    EXPECT_LT(number(row, "ours"), has(row, "16 mm") ? 0.5 : 0.2) << row;
    EXPECT_LT(number(row, "to_fine_mm"), 0.75) << row;
    if (!has(row, "16 mm")) continue;
    EXPECT_LT(number(row, "to_fine_mm"), 0.7 * number(row, "uniform_to_fine_mm")) << row;
  }
  std::size_t loaded = 0;
  for (const json& row : rows["uniform"]) {
    if (has(row, "four patches") || number(row, "boundary_cells") == 0) continue;  // all prescribed; both alike
    EXPECT_LT(number(row, "ours"), number(row, "uniform")) << row;
    ++loaded;
  }
  EXPECT_GT(loaded, 10U);
}

TEST_F(Bench, CompareFindsTheDistancesThatAreThere) {
  // The result's own nodes, moved by 3-4-12 and by nothing: distances 13 and 0.
  ASSERT_EQ(run("hexexport -q liver.hexresult --csv own.csv").exit_code, 0);
  std::istringstream lines(read_text(*folder / "own.csv"));
  std::string line, text = "surface,x,y,z,ux,uy,uz\n";
  std::getline(lines, line);
  for (int n = 0; std::getline(lines, line) && n < 40; ++n) {
    std::replace(line.begin(), line.end(), ',', ' ');
    std::istringstream values(line);
    double node = 0, v[6];
    values >> node >> v[0] >> v[1] >> v[2] >> v[3] >> v[4] >> v[5];
    const bool moved = n % 4 == 0;
    std::ostringstream row;
    row.precision(12);
    row << moved << ',' << v[0] << ',' << v[1] << ',' << v[2] << ',' << v[3] + 3 * moved << ',' << v[4] + 4 * moved
        << ',' << v[5] + 12 * moved << '\n';
    text += row.str();
  }
  text += "0,9000,0,0,0,0,0\n";
  write_text(*folder / "moved.csv", text);
  ASSERT_EQ(run("gzip -k moved.csv").exit_code, 0);
  for (const char* name : {"moved.csv", "moved.csv.gz"}) {
    const CommandResult r = run(std::string("hexbench compare liver.hexresult ") + name);
    ASSERT_EQ(r.exit_code, 0) << r.errors;
    const json row = json::parse(r.output);
    EXPECT_EQ(row["points"], 40);
    EXPECT_EQ(row["outside"], 1);
    EXPECT_NEAR(row["distance_mm_mean"].get<double>(), 13.0 / 4, 1e-3);
    EXPECT_NEAR(row["distance_mm_max"].get<double>(), 13, 1e-3);
    EXPECT_NEAR(row["distance_mm_min"].get<double>(), 0, 1e-3);
    EXPECT_NEAR(row["distance_mm_std"].get<double>(), 13 * std::sqrt(3.0) / 4, 1e-3);
    EXPECT_EQ(row["surface_points"], 10);
    EXPECT_NEAR(row["surface_distance_mm_mean"].get<double>(), 13, 1e-3);
  }
  write_text(*folder / "bad.csv", "x,y,z,ux,uy,uz\n1,2,3,4,five,6\n");
  CommandResult r = run("hexbench compare liver.hexresult bad.csv");
  EXPECT_EQ(r.exit_code, 3);
  EXPECT_NE(r.errors.find("line 2: uy is 'five'"), std::string::npos) << r.errors;
  write_text(*folder / "bad.csv", "a,b\n1,2\n");
  EXPECT_EQ(run("hexbench compare liver.hexresult bad.csv").exit_code, 3);
}

TEST_F(Bench, CompareExactNamesTheDatasetsThatDiffer) {
  ASSERT_EQ(run("hexsolve -q l.hexmesh liver.toml --level 1 -o again.hexresult --threads 1 && "
                "hexsolve -q l.hexmesh liver.toml --level 1 --set solve.tolerance=1e-3 -o loose.hexresult && "
                "hexsolve -q l.hexmesh liver.toml --level 2 -o coarse.hexresult")
                .exit_code,
            0);
  const CommandResult same = run("hexbench compare --exact liver.hexresult again.hexresult");
  EXPECT_EQ(same.exit_code, 0) << same.errors;
  EXPECT_EQ(json::parse(same.output), json::array());
  const CommandResult loose = run("hexbench compare --exact liver.hexresult loose.hexresult");
  EXPECT_EQ(loose.exit_code, 1);
  EXPECT_NE(loose.errors.find("/displacement has other numbers, by "), std::string::npos) << loose.errors;
  EXPECT_EQ(loose.errors.find("/mesh/cells"), std::string::npos);
  const CommandResult coarse = run("hexbench compare --exact liver.hexresult coarse.hexresult");
  EXPECT_NE(coarse.errors.find("/mesh/cells has another shape"), std::string::npos) << coarse.errors;
  EXPECT_EQ(run("hexbench compare --exact liver.hexresult liver.toml").exit_code, 3);
}

}  // namespace test_bench
