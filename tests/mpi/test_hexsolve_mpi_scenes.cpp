// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/file/lattice_file.h"
#include "hexmesh/file/surface_target.h"
#include "hexmesh/surface/surface_file.h"
#include "mpi/hexsolve_mpi.h"
#include "support/bodies.h"
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
                                         std::pair{"bending", R"(
[solve]
stiffness = "incompatible"
supports = "soft"
[[fix]]
halfspace = { point_mm = [40, 0, 0], normal = [1, 0, 0] }
[gravity]
m_s2 = [0, 3, 5]
)"},
                                         std::pair{"condensed", R"(
[solve]
stiffness = "condensed"
supports = "soft"
[[fix]]
halfspace = { point_mm = [40, 0, 0], normal = [1, 0, 0] }
[[force]]
newton = [0, 0.2, 0]
point_mm = [-80, 0, 0]
radius_mm = 30
max_distance_mm = 60
[gravity]
m_s2 = [0, 3, 5]
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

/// A block with two fissures one voxel wide, across it and oblique, with specks in them: cells and nodes stand several
/// at one index on all levels, and processes share some of them.
TEST_F(HexsolveMpi, SplitCellsAreSolvedAsByOne) {
  const auto label = [](const hexmesh::Index3& v) -> std::uint16_t {
    if (v[0] == 11 && v[1] == 15 && v[2] == 5) return 1;
    return (v[0] == 11 && v[1] > 4) || (v[0] + v[2] == 24 && v[1] < 15) ? 0 : 1;
  };
  hexmesh::LabelVolume volume = make_volume({28, 20, 17}, Vec3(4, 4, 4), label);
  const hexmesh::Lattice lattice = hexmesh::build_lattice(
      volume, {{volume.segments[0], hexmesh::material_from_units(10, 0.45, 1000), 0, "given"}}, {4, {1, 0, 2}});
  for (int l = 1; l < 3; ++l) ASSERT_FALSE(lattice.level(l).split.owners.empty());
  hexmesh::write_lattice(lattice, *folder / "split.hexmesh");
  write_text(*folder / "split.toml", fmt::format(R"([[fix]]
halfspace = {{ point_mm = [{0}, 0, 0], normal = [-1, 0, 0] }}
[[displace]]
halfspace = {{ point_mm = [{1}, 0, 0], normal = [1, 0, 0] }}
by_mm = [0, 0, 25]
[gravity]
m_s2 = [0, 2, 0]
)",
                                                 lattice.corner()[0] + 10, lattice.corner()[0] + 110));
  for (const int level : whole_or<std::vector<int>>({0, 1, 2, 3}, {1, 3}))
    for (const char* cells : {"strain=corotational", "strain=auto", "stiffness=condensed"}) {
      SCOPED_TRACE(fmt::format("level {}, {}", level, cells));
      const std::string sharp = fmt::format(
          "split.hexmesh split.toml --level {} --set solve.{} --set solve.tolerance=1e-10 --force ", level, cells);
      const CommandResult one = run("hexsolve " + sharp + "-o one.hexresult --report one.json");
      ASSERT_EQ(one.exit_code, 0) << one.errors;
      for (const int processes : whole_or<std::vector<int>>({1, 2, 3, 4}, {3})) {
        SCOPED_TRACE(fmt::format("{} processes", processes));
        const CommandResult many = run(mpi(processes) + sharp + "-o many.hexresult --report many.json");
        ASSERT_EQ(many.exit_code, 0) << many.errors;
        expect_same(result("one.hexresult"), result("many.hexresult"));
        expect_same_reports(report("one.json"), report("many.json"));
        EXPECT_NEAR(report("many.json")["linear_iterations"].get<int>(),
                    report("one.json")["linear_iterations"].get<int>(), 1);
      }
    }
  // And by PETSc's own preconditioner.
  const std::string sharp =
      "split.hexmesh split.toml --level 1 --set solve.strain=corotational --set solve.tolerance=1e-10 --force ";
  ASSERT_EQ(run("hexsolve " + sharp + "-o one.hexresult").exit_code, 0);
  const CommandResult many = run(mpi(2) + sharp + "-o many.hexresult -- -pc_type gamg -pc_gamg_agg_nsmooths 1");
  ASSERT_EQ(many.exit_code, 0) << many.errors;
  expect_same(result("one.hexresult"), result("many.hexresult"));
}

/// More processes than cells: some have none to decide about, whether they rotate or what they condense to.
TEST_F(HexsolveMpi, ProcessesMayHaveNoCells) {
  const hexmesh::Lattice lattice = one_material({8, 4, 4}, Vec3(5, 5, 5), [](const hexmesh::Index3&) { return true; });
  hexmesh::write_lattice(lattice, *folder / "few.hexmesh");
  write_text(*folder / "few.toml", fmt::format("[[fix]]\nhalfspace = {{ point_mm = [{}, 0, 0], normal = [-1, 0, 0] }}\n"
                                               "[gravity]\nm_s2 = [0, 9.81, 0]\n",
                                               lattice.corner()[0] + 4));
  for (const char* cells : {"strain=auto", "stiffness=condensed"}) {
    SCOPED_TRACE(cells);
    const std::string sharp =
        fmt::format("few.hexmesh few.toml --level 1 --set solve.{} --set solve.tolerance=1e-10 --force ", cells);
    const CommandResult one = run("hexsolve " + sharp + "-o one.hexresult");
    ASSERT_EQ(one.exit_code, 0) << one.errors;
    const CommandResult many = run(mpi(3) + sharp + "-o many.hexresult");
    ASSERT_EQ(many.exit_code, 0) << many.errors;
    expect_same(result("one.hexresult"), result("many.hexresult"));
  }
}

/// A body that nothing else holds, on a target with a piece of something else.
TEST_F(HexsolveMpi, TargetsAreMetAsByOne) {
  const CommandResult made = run(
      "hexsolve liver.hexmesh liver.toml --level 1 -o truth.hexresult && hexexport truth.hexresult --surface now.ply");
  ASSERT_EQ(made.exit_code, 0) << made.errors;
  hexmesh::TriangleSurface now = hexmesh::read_surface(*folder / "now.ply");  // and of the tumours inside
  hexmesh::TriangleSurface piece = now;
  for (Vec3& p : piece.points) p = 0.1 * p + Vec3(0, 150, 0);
  append(now, piece);
  hexmesh::write_surface_target(now, *folder / "now.hexsurface");
  write_text(*folder / "mark.mrk.json",
             R"({"markups": [{"type": "Fiducial", "coordinateSystem": "LPS", "controlPoints": [
    {"position": [-60, 0, 0]}]}]})");
  write_text(*folder / "match.toml", R"([solve]
law = "neo-hookean"
[[match]]
surface = "now.hexsurface"
segment = "liver"
trust_mm = 0.2
[[match]]
from = "mark.mrk.json"
to = "mark.mrk.json"
)");
  const std::string fit = "liver.hexmesh match.toml --level 1 --set solve.error_estimate=off ";
  const CommandResult one = run("hexsolve " + fit + "-o one.fit.hexresult --report one.fit.json");
  ASSERT_EQ(one.exit_code, 0) << one.errors;
  const CommandResult many = run(mpi(3) + fit + "-o many.fit.hexresult --report many.fit.json");
  ASSERT_EQ(many.exit_code, 0) << many.errors;
  const Result a = result("one.fit.hexresult"), b = result("many.fit.hexresult");
  ASSERT_EQ(a.displacement.size(), b.displacement.size());
  double apart = 0, size = 0;
  for (std::size_t n = 0; n < a.displacement.size(); ++n) {
    apart += (a.displacement[n] - b.displacement[n]).norm();
    size += a.displacement[n].norm();
  }
  EXPECT_LT(apart, 5e-4 * size) << "rounds leave a thousandth open";
  const json in_one = report("one.fit.json"), in_many = report("many.fit.json");
  EXPECT_EQ(in_one["pose"], in_many["pose"]);
  ASSERT_EQ(in_many["matches"].size(), 2U);
  for (std::size_t n = 0; n < 2; ++n) {
    const json &x = in_one["matches"][n], &y = in_many["matches"][n];
    EXPECT_EQ(x["points"], y["points"]);
    EXPECT_NEAR(x["distance"]["mean_mm"].get<double>(), y["distance"]["mean_mm"].get<double>(), 0.01);
    EXPECT_NEAR(x["left_out"].get<double>(), y["left_out"].get<double>(), 0.002);
    for (int d = 0; d < 3; ++d) EXPECT_NEAR(x["force_n"][d].get<double>(), y["force_n"][d].get<double>(), 0.02);
  }
  EXPECT_GT(in_many["matches"][0]["left_out"], 0.001);
}

}  // namespace test_hexsolve_mpi_scenes
