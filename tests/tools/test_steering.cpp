// SPDX-License-Identifier: Apache-2.0
#include <cstring>
#include <nlohmann/json.hpp>
#include <sstream>

#include "hexmesh/file/result_file.h"
#include "hexmesh/lattice/embedded_points.h"
#include "tools/tools_fixture.h"

/// hexsolve under commands that come while it solves.
namespace test_steering {

using namespace testing_support;
using hexmesh::Vec3;
using nlohmann::json;

class Steering : public Tools {
protected:
  static void SetUpTestSuite() {
    Tools::SetUpTestSuite();
    write_text(*folder / "held.toml", R"([solve]
kind = "dynamics"
level = 3
[dynamics]
step_s = 0.02
duration_s = 1
[[fix]]
name = "right end"
halfspace = { point_mm = [-65, 0, 0], normal = [-1, 0, 0] }
)");
  }
  static json report(const std::string& name) { return json::parse(read_text(*folder / name)); }
};

/// What a stream has: values of each state.
struct Stream {
  std::size_t count = 0;
  std::vector<double> times;
  std::vector<std::vector<float>> values;
};
Stream read_stream(const std::filesystem::path& path) {
  const std::string bytes = read_text(path);
  Stream out;
  std::istringstream head(bytes);
  std::string word;
  head >> word >> word >> word >> out.count;
  std::size_t at = bytes.find("\n\n") + 2;
  for (const std::size_t size = 8 + 12 * out.count; at + size <= bytes.size(); at += size) {
    out.times.emplace_back();
    std::memcpy(&out.times.back(), bytes.data() + at, 8);
    out.values.emplace_back(3 * out.count);
    std::memcpy(out.values.back().data(), bytes.data() + at + 8, 12 * out.count);
  }
  EXPECT_EQ(at, bytes.size());
  return out;
}

TEST_F(Steering, APointIsPulledWhereAndWhenItIsAskedAndTheSameAgainByTheRecord) {
  const hexmesh::Result rest = [] {
    EXPECT_EQ(run("hexsolve liver.hexmesh held.toml --check -o rest.hexresult").exit_code, 0);
    return hexmesh::read_result(*folder / "rest.hexresult");
  }();
  // The point of the surface that is most to the left, by the stream of the surface at rest.
  ASSERT_EQ(run("hexsolve liver.hexmesh held.toml --set dynamics.duration_s=0.02 --stream > surface.bin").exit_code, 0);
  const std::string surface = read_text(*folder / "surface.bin");
  std::size_t points = 0, triangles = 0;
  ASSERT_EQ(std::sscanf(surface.c_str(), "hexstream 1\npoints %zu\ntriangles %zu\n", &points, &triangles), 2);
  std::vector<float> places(3 * points);
  std::memcpy(places.data(), surface.data() + surface.find("\n\n") + 2 + 12 * triangles + 8, 12 * points);
  std::size_t most = 0;
  for (std::size_t p = 1; p < points; ++p)
    if (places[3 * p] > places[3 * most]) most = p;
  const Vec3 from(places[3 * most], places[3 * most + 1], places[3 * most + 2]), to = from + Vec3(0, -10, -20);

  write_text(*folder / "commands", "# pull\n\nat 0.1 grab " + std::to_string(most) + " " + std::to_string(to[0]) + " " +
                                       std::to_string(to[1]) + " " + std::to_string(to[2]) +
                                       " 8\nat 0.7 release\nat 0.9 end\n");
  const CommandResult r = run(
      "hexsolve liver.hexmesh held.toml --stream=nodes --steer commands --record record -o pulled.hexresult --report "
      "pulled.json > nodes.bin");
  ASSERT_EQ(r.exit_code, 0) << r.errors;
  EXPECT_EQ(r.errors.find("warning"), std::string::npos) << r.errors;
  const Stream stream = read_stream(*folder / "nodes.bin");
  EXPECT_EQ(stream.count, rest.nodes.size());
  ASSERT_EQ(stream.times.size(), 46U);
  const hexmesh::EmbeddedPoints held(hexmesh::locator_of(rest), rest.cell_nodes, {from});
  const auto moved = [&](std::size_t state) {
    const std::vector<double> nodal(stream.values[state].begin(), stream.values[state].end());
    std::vector<Vec3> out;
    held.interpolate(nodal, out);
    return out[0];
  };
  EXPECT_EQ(moved(5), Vec3(0, 0, 0)) << "it is asked for before the step from 0.1 s on";
  EXPECT_GT(moved(6).norm(), 1);
  EXPECT_LT((moved(35) - Vec3(0, -10, -20)).norm(), 0.05 * 22);
  EXPECT_LT(moved(45).norm(), 0.9 * 22) << "it was let go";

  const json summary = report("pulled.json");
  EXPECT_TRUE(summary["converged"]);
  EXPECT_EQ(summary["reason"], "ended as asked at 0.9 of 1 s");
  const json& effects = summary["effects"];
  EXPECT_TRUE(std::any_of(effects.begin(), effects.end(), [](const json& e) { return e["name"] == "grabs"; }));
  const hexmesh::Result kept = hexmesh::read_result(*folder / "pulled.hexresult");
  EXPECT_EQ(kept.times.size(), 46U);
  for (std::size_t n = 0; n < kept.nodes.size(); ++n)
    EXPECT_EQ(static_cast<float>(kept.displacement[n][1]), stream.values.back()[3 * n + 1]);

  ASSERT_EQ(run("hexsolve liver.hexmesh held.toml --threads 2 --stream=nodes --steer record > again.bin").exit_code, 0);
  EXPECT_EQ(read_text(*folder / "again.bin"), read_text(*folder / "nodes.bin"));
}

TEST_F(Steering, WhatIsNoCommandIsToldAndTheMotionGoesOn) {
  const auto commands = [](const std::string& lines) {
    return run("printf '" + lines + "' | hexsolve liver.hexmesh held.toml --steer - -o told.hexresult --force");
  };
  const CommandResult r =
      commands("grab 3 1 1\\nfoo\\ngrab 99999999 1 1 1\\nat 0.1 grab 1 nan 1 1\\ngrab 1.5 0 0 0\\nrelease 7");
  EXPECT_EQ(r.exit_code, 0) << r.errors;
  for (const char* line : {"standard input: 'grab 3 1 1' is no command, expected grab POINT X Y Z [REACH]",
                           "'foo' is no command", "'grab 99999999 1 1 1' is of point 99999999, expected 0 to ",
                           "'at 0.1 grab 1 nan 1 1' has 'nan'", "'grab 1.5 0 0 0' is of point 1.5"})
    EXPECT_NE(r.errors.find(line), std::string::npos) << line << "\n" << r.errors;
  EXPECT_EQ(r.errors.find("release"), r.errors.find("release [POINT]")) << "nothing is held, which is no fault";
  EXPECT_TRUE(std::filesystem::exists(*folder / "told.hexresult"));

  // A motion that nobody can go on with goes on.
  EXPECT_NE(commands("pause\\nat 5 resume").errors.find("is asked of a later time while the motion is paused"),
            std::string::npos);
  EXPECT_NE(commands("pause").errors.find("it ends while the motion is paused"), std::string::npos);
  EXPECT_EQ(commands("pause\\nresume\\nend").exit_code, 0);

  // Lines as other systems and programs write them; of one that is too long no piece is carried out.
  const CommandResult other = commands("\\357\\273\\277pause\\r\nat\t0.1  resume\nresume\r\nend");
  EXPECT_EQ(other.errors.find("is no command"), std::string::npos) << other.errors;
  EXPECT_EQ(other.exit_code, 0);
  const CommandResult longer = commands(std::string(5000, 'x') + " end " + std::string(5000, 'y') + "\nend");
  EXPECT_NE(longer.errors.find("a line of more than 1000 characters, 'xxx"), std::string::npos);
  EXPECT_EQ(longer.errors.find("yyy"), std::string::npos) << longer.errors;
  std::string many;
  for (int n = 0; n < 100; ++n) many += "foo\n";
  const CommandResult told = commands(many + "end");
  EXPECT_NE(told.errors.find("what is wrong from here on is not told"), std::string::npos);
  EXPECT_LT(std::count(told.errors.begin(), told.errors.end(), '\n'), 60);

  // What never ends does not take the memory, and a pipe is waited for.
  EXPECT_EQ(run("yes '# nothing' | hexsolve liver.hexmesh held.toml --set dynamics.duration_s=0.1 --steer - "
                "--max-memory 200 --force -o told.hexresult")
                .exit_code,
            0);
  EXPECT_EQ(run("hexsolve liver.hexmesh held.toml --set dynamics.duration_s=0.1 --steer /dev/zero --max-memory 200 "
                "--force -o told.hexresult")
                .exit_code,
            0);
  EXPECT_EQ(run("mkfifo late.pipe; { sleep 1; echo end > late.pipe; } & sleep 0.2; hexsolve liver.hexmesh held.toml "
                "--steer "
                "late.pipe --record late --force -o told.hexresult && grep -qx 'at 0 end' late")
                .exit_code,
            0);
  expect_failure("hexsolve liver.hexmesh held.toml --steer . -o x.hexresult", 3, {"'.' is a folder"});
  expect_failure("hexsolve liver.hexmesh held.toml --steer '' -o x.hexresult", 2, {"--steer", "is empty"});

  expect_failure("hexsolve liver.hexmesh held.toml --steer nowhere -o x.hexresult", 3, {"no such file 'nowhere'"});
  expect_failure("hexsolve liver.hexmesh liver.toml --steer commands -o x.hexresult", 2,
                 {"--steer goes with a motion"});
  expect_failure("hexsolve liver.hexmesh held.toml --stream=foo", 2, {"--stream is 'foo', expected surface or nodes"});
  expect_failure("hexsolve liver.hexmesh held.toml --record r -o x.hexresult", 2, {"--record", "--steer"});
  expect_failure("hexsolve - held.toml --steer - -o x.hexresult < liver.hexmesh", 2, {"standard input"});
}

TEST_F(Steering, AViewerThatLeavesEndsTheMotionWhichIsKept) {
  const CommandResult r = run(
      "(echo pace 1; sleep 3) | hexsolve liver.hexmesh held.toml --set dynamics.duration_s=50 --steer - --stream=nodes "
      "-o left.hexresult --record left | head -c 20000 > /dev/null; wait");
  EXPECT_NE(r.errors.find("the motion ends there"), std::string::npos) << r.errors;
  EXPECT_TRUE(std::filesystem::exists(*folder / "left.hexresult"));
  EXPECT_TRUE(read_text(*folder / "left").ends_with(" end\n")) << "which a replay does again";
}

}  // namespace test_steering
