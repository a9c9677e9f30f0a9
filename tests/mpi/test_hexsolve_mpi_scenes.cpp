// SPDX-License-Identifier: Apache-2.0
#include "mpi/hexsolve_mpi.h"
#include "support/forms.h"

namespace test_hexsolve_mpi_scenes {

using namespace testing_support;

/// Scenes that use what the example does not.
class HexsolveMpiScenes : public HexsolveMpi,
                          public testing::WithParamInterface<std::pair<const char*, const char*>> {};

TEST_P(HexsolveMpiScenes, AreSolvedAsByOne) {
  const auto& [name, scene] = GetParam();
  const std::string toml = std::string(name) + ".toml";
  write_text(*folder / toml, scene);
  for (const int level : whole_or<std::vector<int>>({0, 1}, {1})) {
    SCOPED_TRACE(fmt::format("level {}", level));
    const std::string sharp = fmt::format(
        "liver.hexmesh {} --level {} --set solve.tolerance=1e-10 --set solve.error_estimate=off --force ", toml, level);
    const CommandResult one = run("hexsolve " + sharp + "-o one.hexresult --report one.json");
    ASSERT_EQ(one.exit_code, 0) << one.errors;
    const CommandResult many = run(mpi(whole_or(3, 2)) + sharp + "-o many.hexresult --report many.json");
    ASSERT_EQ(many.exit_code, 0) << many.errors;
    expect_same(result("one.hexresult"), result("many.hexresult"));
    expect_same_reports(report("one.json"), report("many.json"));
  }
}

// The phantom's liver lies within about 190 x 140 x 120 mm around the origin.
INSTANTIATE_TEST_SUITE_P(Scenes, HexsolveMpiScenes,
                         testing::Values(std::pair{"forces", R"(
[solve]
strain = "corotational"
[[fix]]
halfspace = { point_mm = [40, 0, 0], normal = [1, 0, 0] }
[[force]]
newton = [0, 0.2, 0]
halfspace = { point_mm = [-40, 0, 0], normal = [-1, 0, 0] }
[[force]]
pressure_kpa = 0.2
halfspace = { point_mm = [0, 0, 20], normal = [0, 0, 1] }
[[force]]
newton = [0.1, 0, 0.1]
on = "voxels"
halfspace = { point_mm = [-20, 0, 0], normal = [-1, 0, 0] }
[gravity]
m_s2 = [0, 9.81, 0]
)"},
                                         std::pair{"laws", R"(
[solve]
law = "stable-neo-hookean"
[[fix]]
on = "voxels"
halfspace = { point_mm = [40, 0, 0], normal = [1, 0, 0] }
[[displace]]
halfspace = { point_mm = [-40, 0, 0], normal = [-1, 0, 0] }
axes = "xz"
by_mm = [-10, 0, 8]
)"},
                                         std::pair{"small-strain", R"(
[solve]
strain = "cauchy"
volumetric = "full"
[material.tumour]
young_kpa = 900
[[fix]]
on = "nodes"
halfspace = { point_mm = [40, 0, 0], normal = [1, 0, 0] }
[[displace]]
on = "nodes"
halfspace = { point_mm = [-40, 0, 0], normal = [-1, 0, 0] }
by_mm = [0, 0, 10]
)"},
                                         std::pair{"turned", R"(
[solve]
rotation = "edges"
[[fix]]
halfspace = { point_mm = [40, 0, 0], normal = [1, 0, 0] }
[[displace]]
halfspace = { point_mm = [-40, 0, 0], normal = [-1, 0, 0] }
rotate = { axis = [1, 0, 0], degrees = 20, about_mm = [0, 0, 0] }
)"}),
                         [](const auto& scene) {
                           std::string name = scene.param.first;
                           std::erase(name, '-');
                           return name;
                         });

}  // namespace test_hexsolve_mpi_scenes
