// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "hexmesh/file/result_file.h"
#include "support/files.h"

namespace testing_support {

using hexmesh::Result;
using hexmesh::Vec3;
using nlohmann::json;

inline std::string mpi(int processes) {
  return fmt::format(
      "OMP_NUM_THREADS=1 OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 '{}' --oversubscribe "
      "-n {} hexsolve-mpi ",
      HEXTOOLS_MPIEXEC, processes);
}

/// A phantom, solved by one process and by several.
class HexsolveMpi : public testing::Test {
protected:
  static void SetUpTestSuite() {
    folder = new TemporaryFolder;
    const CommandResult r =
        run("hexscan phantom liver --spacing 5 -o liver.seg.nrrd && "
            "hexmesh build liver.seg.nrrd --material '*:young_kpa=100,poisson=0.3' "
            "--material 'tumour:young_kpa=400,poisson=0.4' -o liver.hexmesh && "
            "hexsolve liver.hexmesh --example -o liver.toml");
    ASSERT_EQ(r.exit_code, 0) << r.errors;
  }
  static void TearDownTestSuite() { delete folder; }

  static CommandResult run(const std::string& command) { return shell("cd '" + folder->path("") + "' && " + command); }
  static json report(const std::string& name) { return json::parse(read_text(*folder / name)); }
  static Result result(const std::string& name) { return hexmesh::read_result(*folder / name); }

  static inline TemporaryFolder* folder = nullptr;
};

inline double largest_difference(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
  if (a.size() != b.size()) return std::numeric_limits<double>::infinity();
  double largest = 0;
  for (std::size_t n = 0; n < a.size(); ++n) largest = std::max(largest, (a[n] - b[n]).norm());
  return largest;
}

/// The same body in the same order, and the same state to what the residuals leave open.
inline void expect_same(const Result& a, const Result& b) {
  EXPECT_EQ(a.labels, b.labels);
  EXPECT_EQ(a.level, b.level);
  EXPECT_EQ(a.cells, b.cells);
  EXPECT_EQ(a.parting, b.parting);
  EXPECT_EQ(a.owners, b.owners);
  EXPECT_EQ(a.cell_nodes, b.cell_nodes);
  EXPECT_EQ(a.segment, b.segment);
  EXPECT_EQ(a.surface.triangles, b.surface.triangles);
  EXPECT_LT(largest_difference(a.nodes, b.nodes), 1e-9);
  EXPECT_LT(largest_difference(a.displacement, b.displacement), 1e-6);
  EXPECT_LT(largest_difference(a.surface_displacement, b.surface_displacement), 1e-6);
  ASSERT_EQ(a.conditions.size(), b.conditions.size());
  for (std::size_t c = 0; c < a.conditions.size(); ++c) {
    EXPECT_EQ(a.conditions[c].name, b.conditions[c].name);
    EXPECT_EQ(a.conditions[c].axes, b.conditions[c].axes);
    EXPECT_LT(largest_difference(a.conditions[c].points, b.conditions[c].points), 1e-9);
    EXPECT_LT(largest_difference(a.conditions[c].displacement, b.conditions[c].displacement), 1e-6);
  }
  ASSERT_EQ(a.cell_fields.size(), b.cell_fields.size());
  for (const auto& [name, values] : a.cell_fields) {
    const std::vector<double>& others = b.cell_fields.at(name);
    ASSERT_EQ(values.size(), others.size()) << name;
    double scale = 0, difference = 0;
    for (std::size_t n = 0; n < values.size(); ++n) {
      scale = std::max(scale, std::abs(values[n]));
      difference = std::max(difference, std::abs(values[n] - others[n]));
    }
    EXPECT_LE(difference, 1e-6 * scale) << name;
  }
}

inline void expect_same_reports(const json& one, const json& many) {
  for (const char* key : {"converged", "conditions", "forces", "kept_directions", "strain", "law", "volumetric",
                          "warnings", "lattice", "inverted_cells"}) {
    if (std::string(key) != "conditions" && std::string(key) != "forces") {
      EXPECT_EQ(one[key], many[key]) << key;
      continue;
    }
    ASSERT_EQ(one[key].size(), many[key].size()) << key;
    for (std::size_t n = 0; n < one[key].size(); ++n)
      for (const auto& [name, value] : one[key][n].items()) {
        if (!value.is_array() && !value.is_number_float()) {
          EXPECT_EQ(value, many[key][n][name]) << name;
          continue;
        }
        const auto numbers = [](const json& v) {
          return v.is_array() ? v.get<std::vector<double>>() : std::vector<double>{v};
        };
        const std::vector<double> a = numbers(value), b = numbers(many[key][n][name]);
        // Estimates come from levels that are solved roughly.
        const double off = name == "reaction_error_n" ? 0.01 * std::abs(a[0]) : 1e-6;
        for (std::size_t d = 0; d < a.size(); ++d) EXPECT_NEAR(a[d], b[d], off + 1e-6 * std::abs(a[d])) << name;
      }
  }
  for (const char* key : {"strain_energy_n_mm", "min_jacobian", "pressure_checkerboard_kpa"})
    EXPECT_NEAR(one[key].get<double>(), many[key].get<double>(), 1e-6 * std::abs(one[key].get<double>())) << key;
  // Coarser levels are solved roughly, but what is told of them is told of the same bodies.
  ASSERT_EQ(one["levels"].size(), many["levels"].size());
  for (std::size_t n = 0; n < one["levels"].size(); ++n) {
    EXPECT_EQ(one["levels"][n]["cells"], many["levels"][n]["cells"]);
    EXPECT_EQ(one["levels"][n]["dofs"], many["levels"][n]["dofs"]);
  }
  const json &a = one["error_estimate_mm"]["mean"], &b = many["error_estimate_mm"]["mean"];
  ASSERT_EQ(a.is_null(), b.is_null());
  if (a.is_null()) return;
  EXPECT_NEAR(a.get<double>(), b.get<double>(), 0.01 * a.get<double>());
}

}  // namespace testing_support
