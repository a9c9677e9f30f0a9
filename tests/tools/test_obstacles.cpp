// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tools_fixture.h"

namespace test_obstacles {

using namespace testing_support;
using nlohmann::json;

class Obstacles : public Tools {};

constexpr const char* held = "[[fix]]\nname = \"right\"\nhalfspace = { point_mm = [-65, 0, 0], normal = [-1, 0, 0] }\n";

/// A box is what its triangles enclose, wherever it is.
TEST_F(Obstacles, ABoxIsItsSurface) {
  std::string off = "OFF\n8 12 0\n";
  for (int c = 0; c < 8; ++c)
    off += std::string(c & 1 ? "60 " : "20 ") + (c & 2 ? "-85 " : "-115 ") + (c & 4 ? "20\n" : "-20\n");
  for (const char* face : {"0 2 3 1", "4 5 7 6", "0 1 5 4", "2 6 7 3", "0 4 6 2", "1 3 7 5"}) {
    const std::string f = face;
    off += std::string("3 ") + f[0] + " " + f[2] + " " + f[4] + "\n3 " + f[0] + " " + f[4] + " " + f[6] + "\n";
  }
  write_text(*folder / "plate.off", off);
  const CommandResult made = run("hexscan surface plate.off -o plate.hexsurface");
  ASSERT_EQ(made.exit_code, 0) << made.errors;
  EXPECT_NE(made.errors.find("12 triangles around 48 mL"), std::string::npos) << made.errors;
  std::vector<json> forces;
  for (const char* shape :
       {"box = { center_mm = [40, -100, 0], size_mm = [40, 30, 40] }", "surface = \"plate.hexsurface\""}) {
    write_text(*folder / "press.toml", std::string(held) + "[[contact]]\nby_mm = [0, 50, 0]\n" + shape + "\n");
    const CommandResult r =
        run("hexsolve liver.hexmesh press.toml --level 2 -o press.hexresult --report press.json --force");
    ASSERT_EQ(r.exit_code, 0) << r.errors;
    const json contact = json::parse(read_text(*folder / "press.json"))["contacts"][0];
    EXPECT_GT(contact["points"], 2);
    EXPECT_LT(contact["deepest_mm"], 0.25);  // a hundredth of how far it is pushed in
    forces.push_back(contact["force_n"]);
  }
  for (std::size_t d = 0; d < 3; ++d)
    EXPECT_NEAR(forces[0][d].get<double>(), forces[1][d].get<double>(), 1e-6 * std::abs(forces[0][1].get<double>()));
}

TEST_F(Obstacles, OpenSurfacesAreRefused) {
  write_text(*folder / "open.off", "OFF\n4 3 0\n0 0 0\n9 0 0\n0 9 0\n0 0 9\n3 0 2 1\n3 0 1 3\n3 0 3 2\n");
  expect_failure("hexscan surface open.off -o open.hexsurface", 3,
                 {"open.off", "3 edges", "expected a closed surface"});
  EXPECT_FALSE(std::filesystem::exists(*folder / "open.hexsurface"));
}

/// Of every shape; slices show them too.
TEST_F(Obstacles, AreExportedInTheirShapes) {
  write_text(
      *folder / "shapes.toml",
      std::string(held) +
          "[[contact]]\nname = \"a\"\ncapsule = { from_mm = [-45, -140, 0], to_mm = [-45, -100, 0], radius_mm = 9 }\n"
          "[[contact]]\nname = \"b\"\ncylinder = { from_mm = [0, -140, 0], to_mm = [0, -110, 9], radius_mm = 9 }\n"
          "rotate = { axis = [0, 0, 1], degrees = 10, about_mm = [0, -120, 0] }\n"
          "[[contact]]\nname = \"c\"\nbox = { center_mm = [60, -120, 0], size_mm = [20, 20, 20] }\n");
  const CommandResult r =
      run("hexsolve liver.hexmesh shapes.toml --level 2 -o shapes.hexresult && "
          "hexexport shapes.hexresult --obstacles shapes.vtp && "
          "hexslice planes shapes.hexresult --scan ct.nrrd --axis axial --at 0 --scene -o shapes");
  ASSERT_EQ(r.exit_code, 0) << r.errors;
  const std::string text = read_text(*folder / "shapes.vtp");
  EXPECT_NE(text.find("Name=\"obstacle\""), std::string::npos);
}

/// What nothing but a table carries lies on it with its weight.
TEST_F(Obstacles, CarryABody) {
  write_text(
      *folder / "table.toml",
      "[material.liver]\nyoung_kpa = 40\n[[contact]]\nname = \"table\"\nplane = { point_mm = [0, 60, 0], normal = "
      "[0, -1, 0] }\n[gravity]\nm_s2 = [0, 9.81, 0]\n");
  const CommandResult check = run("hexsolve liver.hexmesh table.toml --level 2 --check");
  EXPECT_NE(check.output.find("nothing but obstacles holds"), std::string::npos) << check.output;
  const CommandResult r = run("hexsolve liver.hexmesh table.toml --level 2 -o table.hexresult --report table.json");
  ASSERT_EQ(r.exit_code, 0) << r.errors;
  const json report = json::parse(read_text(*folder / "table.json"));
  const double weight = report["forces"][0]["total_n"][1];
  EXPECT_NEAR(report["contacts"][0]["force_n"][1].get<double>(), -weight, 1e-5 * weight);
  EXPECT_LT(report["contacts"][0]["deepest_mm"], 0.01);
}

}  // namespace test_obstacles
