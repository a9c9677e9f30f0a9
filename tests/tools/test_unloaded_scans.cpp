// SPDX-License-Identifier: Apache-2.0
// solve.reference = "loaded" by the tools: what is written, told and refused.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "hexmesh/file/result_file.h"
#include "tools_fixture.h"

namespace test_unloaded_scans {

using namespace testing_support;
using nlohmann::json;

/// On the right side, held there.
constexpr const char* scene = R"([solve]
reference = "loaded"
level = 2
error_estimate = "off"
[[fix]]
name = "side"
halfspace = { point_mm = [-70, 0, 0], normal = [-1, 0, 0] }
[loaded.gravity]
m_s2 = [-9.81, 0, 0]
[material.liver]
young_kpa = 10
)";

double largest(const std::vector<hexmesh::Vec3>& field) {
  double out = 0;
  for (const hexmesh::Vec3& v : field) out = std::max(out, v.norm());
  return out;
}

TEST_F(Tools, AScanUnderLoadHasAShapeWithoutIt) {
  write_text(*folder / "u.toml", scene);
  CommandResult r = run("hexsolve liver.hexmesh u.toml -o u.hexresult --report u.json");
  ASSERT_EQ(r.exit_code, 0) << r.errors;
  EXPECT_NE(r.errors.find("without load the body is"), std::string::npos) << r.errors;
  const hexmesh::Result rest = hexmesh::read_result(*folder / "u.hexresult");
  EXPECT_EQ(rest.displacement, rest.rest_displacement);
  const double away = largest(rest.displacement);
  EXPECT_GT(away, 2);
  EXPECT_GT(rest.cell_fields.at("loaded_von_mises_stress")[0], 100 * rest.cell_fields.at("von_mises_stress")[0]);
  const json report = json::parse(read_text(*folder / "u.json"));
  EXPECT_TRUE(report["converged"]);
  const json& loaded = report["loaded"];
  EXPECT_GT(loaded["rest_displacement_mm"]["max"].get<double>(), 2);  // of the material, not of nodes beyond it
  const double weight = loaded["forces"].back()["total_n"][0];
  EXPECT_LT(weight, -1);
  EXPECT_NEAR(loaded["conditions"][0]["reaction_n"][0].get<double>(), -weight, 1e-6 * std::abs(weight));
  EXPECT_NEAR(report["conditions"][0]["reaction_n"][0].get<double>(), 0, 1e-6);

  // The scan's loads bring it back; others take it elsewhere. Exports have all of it.
  r =
      run("hexsolve -q liver.hexmesh u.toml --set gravity.m_s2=[-9.81,0,0] -o b.hexresult && "
          "hexsolve -q liver.hexmesh u.toml --set gravity.m_s2=[0,9.81,0] -o p.hexresult && "
          "hexexport -q p.hexresult --lattice p.vtu && grep -ao 'Name=\"[a-z_]*displacement[a-z_]*\"' p.vtu");
  ASSERT_EQ(r.exit_code, 0) << r.errors;
  for (const char* name : {"\"displacement\"", "\"rest_displacement\"", "\"displacement_from_rest\""})
    EXPECT_NE(r.output.find(name), std::string::npos) << r.output;
  EXPECT_LT(largest(hexmesh::read_result(*folder / "b.hexresult").displacement), 1e-6);
  const hexmesh::Result posture = hexmesh::read_result(*folder / "p.hexresult");
  EXPECT_GT(largest(posture.displacement), 0.5 * away);
  EXPECT_EQ(posture.rest_displacement, rest.rest_displacement);
}

TEST_F(Tools, AMotionDoesNotStartFromAScanUnderLoad) {
  write_text(*folder / "m.toml", scene);
  write_text(*folder / "d.toml",
             "[solve]\nkind = \"dynamics\"\nlevel = 3\n[dynamics]\nstep_s = 0.01\nduration_s = 0.1\nstart = "
             "\"m.hexresult\"\n");
  const CommandResult r = run(
      "hexsolve -q liver.hexmesh m.toml --level 3 -o m.hexresult && hexsolve -q liver.hexmesh d.toml -o d.hexresult");
  EXPECT_EQ(r.exit_code, 3) << r.errors;
  EXPECT_NE(r.errors.find("of a lattice under load"), std::string::npos) << r.errors;
}

TEST_F(Tools, AScanTooSoftForItsLoadIsSaidSo) {
  write_text(*folder / "u.toml", scene);
  const CommandResult r = run(
      "hexsolve liver.hexmesh u.toml --level 3 --set material.liver.young_kpa=0.05 --set 'solve.law=\"neo-hookean\"' "
      "-o s.hexresult --report s.json");
  EXPECT_EQ(r.exit_code, 5) << r.errors;
  EXPECT_NE(r.errors.find("no shape without load: stopped at"), std::string::npos) << r.errors;
  EXPECT_NE(r.errors.find("stable-neo-hookean"), std::string::npos) << r.errors;
  const json report = json::parse(read_text(*folder / "s.json"));
  EXPECT_FALSE(report["converged"]);
  EXPECT_LT(report["load_fraction"].get<double>(), 1);
}

TEST_F(Tools, WhatDoesNotGoWithAScanUnderLoadIsRefused) {
  write_text(*folder / "u.toml", scene);
  const auto errors = [&](const std::string& settings) {
    const CommandResult r = run("hexsolve liver.hexmesh u.toml " + settings + " -o n.hexresult");
    EXPECT_EQ(r.exit_code, 3) << settings << r.errors;
    EXPECT_FALSE(std::filesystem::exists(*folder / "n.hexresult"));
    return r.errors;
  };
  EXPECT_NE(errors("--set 'solve.rotation=\"edges\"'").find("expected that"), std::string::npos);
  EXPECT_NE(errors("--set 'solve.grading=\"scene\"'").find("grading = \"off\""), std::string::npos);
  EXPECT_NE(errors("--level 2:3").find("grading = \"off\""), std::string::npos);
  EXPECT_NE(errors("--set 'solve.islands=\"hold\"'").find("islands = \"error\""), std::string::npos);
  EXPECT_NE(errors("--set gravity.m_s2=[0,9.81,0] --accuracy 1").find("expected solve.level"), std::string::npos);
  EXPECT_NE(errors("--set loaded.contact.0.stiffness_n_mm=1").find("loaded.contact"), std::string::npos);
  CommandResult r = run("hexsolve liver.hexmesh u.toml --set 'solve.reference=\"rest\"' --check");
  EXPECT_EQ(r.exit_code, 0) << r.errors;
  EXPECT_NE(r.errors.find("[loaded] has no effect"), std::string::npos) << r.errors;
  r = run("hexsolve liver.hexmesh u.toml --check && hexsolve liver.hexmesh u.toml --plan");
  EXPECT_EQ(r.exit_code, 0) << r.errors;
  EXPECT_NE(r.output.find("shape without load"), std::string::npos) << r.output;
}

}  // namespace test_unloaded_scans
