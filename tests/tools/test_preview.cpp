// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "hexmesh/file/result_file.h"
#include "hexmesh/view/canvas.h"
#include "tools_fixture.h"

namespace test_preview {

using hexmesh::Vec3;
using namespace testing_support;

TEST_F(Tools, WordsThatAreNotKnownAreNamedWithWhatWasMeant) {
  expect_failure("hexmesh biuld liver.nrrd", 2, {"'biuld' is no subcommand of hexmesh, did you mean 'build'?"});
  expect_failure("hexmesh --verion", 2, {"'--verion' is no option of hexmesh, did you mean '--version'?"});
  expect_failure("hexmesh build liver.nrrd --cellsize 3 -o x", 2, {"of hexmesh build, did you mean '--cell-size'?"});
  // Values are no such words, whatever they look like.
  expect_failure("hexslice --threads 2 plaens r", 2, {"'plaens' is no subcommand of hexslice, did you mean 'planes'?"});
  expect_failure("hexmesh build liver.nrrd -o --x.hexmesh --levels zz", 2, {"zz"});
  expect_failure("hexmesh build liver.nrrd --material 'liver:tissue=' -o x", 2, {"tissue has no name"});
}

TEST_F(Tools, ASceneIsShownBeforeItIsSolved) {
  write_text(*folder / "ball.toml",
             "[[fix]]\nname = \"right\"\nhalfspace = { point_mm = [-80, 0, 0], normal = [-1, 0, 0] }\n"
             "[[displace]]\nname = \"left\"\npoint_mm = [99, -19, 7]\nradius_mm = 12\nby_mm = [0, 0, -30]\n"
             "[[contact]]\nname = \"ball\"\nsphere = { center_mm = [-45, -75, 0], radius_mm = 25 }\n"
             "by_mm = [0, 6, 0]\nstiffness_n_mm = 0.1\n");
  const CommandResult r = run(
      "hexsolve liver.hexmesh ball.toml --level 1 --check -o scene.hexresult && hexexport scene.hexresult --conditions "
      "scene.vtp && hexslice planes scene.hexresult --scan ct.nrrd --scene --axis sagittal --at -45 -o scene && "
      "hexslice planes scene.hexresult --scan ct.nrrd --scene --axis coronal --at -19 -o scene/coronal");
  ASSERT_EQ(r.exit_code, 0) << r.errors;
  const hexmesh::Result scene = hexmesh::read_result(*folder / "scene.hexresult");
  ASSERT_EQ(scene.conditions.size(), 2U);
  EXPECT_EQ(scene.conditions[1].displacement.at(0), Vec3(0, 0, -30)) << "where it is to go";
  for (const Vec3& u : scene.displacement) ASSERT_EQ(u, Vec3(0, 0, 0));
  const auto count = [](const hexmesh::Canvas& picture, const hexmesh::Rgb& color) {
    int n = 0;
    for (int y = 0; y < picture.height(); ++y)
      for (int x = 0; x < picture.width(); ++x) n += picture.at(x, y) == color;
    return n;
  };
  const hexmesh::Canvas across = hexmesh::read_png(*folder / "scene/sagittal_1.png");
  const hexmesh::Canvas along = hexmesh::read_png(*folder / "scene/coronal/coronal_1.png");
  EXPECT_GT(count(across, {230, 60, 230}), 100) << "the ball, violet";
  EXPECT_GT(count(along, {60, 140, 255}), 50) << "what is held, blue";
  EXPECT_GT(count(along, {255, 80, 40}), 50) << "what is moved, red";
  EXPECT_EQ(run("hexsolve liver.hexmesh ball.toml --plan -o plan.hexresult").exit_code, 2);
  const CommandResult moved = run("hexexport scene.hexresult --csv moved.csv");
  EXPECT_EQ(moved.exit_code, 2) << "there is no displacement";
  EXPECT_NE(moved.errors.find("not solved"), std::string::npos) << moved.errors;
  // Points that are held are blue where nothing else moves them either.
  write_text(*folder / "held.toml",
             "[[fix]]\nname = \"right\"\nhalfspace = { point_mm = [-80, 0, 0], normal = [-1, 0, 0] }\n"
             "[gravity]\nm_s2 = [0, 0, -0.01]\n");
  ASSERT_EQ(
      run("hexsolve -q liver.hexmesh held.toml --level 1 -o held.hexresult && hexslice planes held.hexresult --scene "
          "--axis coronal --at -19 -o scene/held")
          .exit_code,
      0);
  const hexmesh::Canvas held = hexmesh::read_png(*folder / "scene/held/coronal_1.png");
  EXPECT_GT(count(held, {60, 140, 255}), 50);
  EXPECT_EQ(count(held, {255, 80, 40}), 0);
}

}  // namespace test_preview
