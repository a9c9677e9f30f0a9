// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tools_fixture.h"

namespace test_sliding {

using namespace testing_support;
using nlohmann::json;

class Sliding : public Tools {};

constexpr const char* scene =
    "[[fix]]\nname = \"left\"\nhalfspace = { point_mm = [60, 0, 0], normal = [1, 0, 0] }\n"
    "[gravity]\nm_s2 = [0, 9.81, 0]\n[[contact]]\nname = \"capsule\"\nbetween = [\"tumour\", \"liver\"]\n";

/// From the scan to pictures: the tumour rests in the liver, with its weight.
TEST_F(Sliding, ATumourRestsInItsLiver) {
  write_text(*folder / "slide.toml", scene);
  const CommandResult made = run("hexmesh build liver.nrrd --slide tumour liver -o slide.hexmesh --report slide.json");
  ASSERT_EQ(made.exit_code, 0) << made.errors;
  EXPECT_NE(made.errors.find("share their place"), std::string::npos) << made.errors;
  const json built = json::parse(read_text(*folder / "slide.json"));
  EXPECT_EQ(built["sliding"], (json::array({json::array({"tumour", "liver"})})));
  EXPECT_GT(built["levels"][1]["split_cells"], 0);
  double weight = 0;
  for (const json& s : built["segments"])
    if (s["name"] == "tumour") weight = s["mass_g"].get<double>() * 1e-3 * 9.81;
  ASSERT_EQ(run("hexmesh check slide.hexmesh").exit_code, 0);
  const CommandResult r =
      run("hexsolve slide.hexmesh slide.toml --level 2 -o slide.hexresult --report solved.json && "
          "hexexport slide.hexresult --lattice slide.vtu --surface slide.vtp --warp ct.nrrd --to moved.nrrd && "
          "hexslice planes slide.hexresult --scan ct.nrrd --axis axial --at 0 --lattice --scene -o slide");
  ASSERT_EQ(r.exit_code, 0) << r.errors;
  const json contact = json::parse(read_text(*folder / "solved.json"))["contacts"][0];
  EXPECT_EQ(contact["between"], (json::array({"tumour", "liver"})));
  EXPECT_NEAR(contact["force_n"][1].get<double>(), -weight, 1e-5 * weight);
  EXPECT_LT(contact["deepest_mm"], 0.01);
  EXPECT_EQ(r.errors.find("do not settle"), std::string::npos) << r.errors;
}

TEST_F(Sliding, WhatCannotSlideIsSaid) {
  write_text(*folder / "slide.toml", scene);
  expect_failure("hexsolve liver.hexmesh slide.toml --level 2 -o none.hexresult", 3,
                 {"slide.toml:6", "'tumour' and 'liver'", "hexmesh build --slide tumour liver"});
  expect_failure("hexmesh build liver.nrrd --slide tumour tumour -o none.hexmesh", 2, {"--slide", "tumour"});
  expect_failure("hexmesh build liver.nrrd --slide tumour spleen -o none.hexmesh", 3, {"spleen", "expected one of"});
  EXPECT_FALSE(std::filesystem::exists(*folder / "none.hexmesh"));
  write_text(*folder / "ball.toml", std::string(scene) + "by_mm = [0, 1, 0]\n");
  expect_failure("hexsolve liver.hexmesh ball.toml --level 2 -o none.hexresult", 3, {"by_mm"});
}

}  // namespace test_sliding
