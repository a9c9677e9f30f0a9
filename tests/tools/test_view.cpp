// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "hexmesh/file/result_file.h"
#include "hexmesh/view/canvas.h"
#include "tools/tools_fixture.h"

/// hexview in a window that nobody sees.
namespace test_view {

using namespace testing_support;

class View : public Tools {
protected:
  static void SetUpTestSuite() {
    Tools::SetUpTestSuite();
    // One screen for all tests, of whichever number is free; it writes the number when it can be used.
    ASSERT_EQ(run("{ timeout 600 Xvfb -displayfd 1 -nolisten tcp -screen 0 1280x1024x24 > display 2> display.log & "
                  "echo $! > screen; for n in $(seq 600); do [ -s display ] && exit 0; sleep 0.1; done; exit 1; }")
                  .exit_code,
              0)
        << read_text(*folder / "display.log");
    write_text(*folder / "held.toml", R"([solve]
level = 3
[[fix]]
name = "right end"
halfspace = { point_mm = [-65, 0, 0], normal = [-1, 0, 0] }
)");
  }
  static void TearDownTestSuite() {
    run("kill $(cat screen)");
    Tools::TearDownTestSuite();
  }
  static CommandResult view(const std::string& arguments) {
    return run("DISPLAY=:$(cat display) timeout 120 hexview " + arguments);
  }
  static hexmesh::Canvas picture(const std::string& name) { return hexmesh::read_png(*folder / name); }
};

/// The box of the body's pixels from some x on: left, upper, right, lower.
std::array<int, 4> box_of_body(const hexmesh::Canvas& picture, int from_x = 0) {
  std::array<int, 4> box = {picture.width(), picture.height(), 0, 0};
  for (int y = 0; y < picture.height(); ++y)
    for (int x = from_x; x < picture.width(); ++x) {
      const hexmesh::Rgb c = picture.at(x, y);
      if (c[0] < c[2] + 40 || c[0] < c[1] + 40) continue;  // reddish, as the liver is
      box = {std::min(box[0], x), std::min(box[1], y), std::max(box[2], x), std::max(box[3], y)};
    }
  return box;
}

TEST_F(View, WhatIsGrabbedIsPulledAndClosingKeepsTheMotion) {
  // The point that is farthest to the left of the patient is on the right of the picture.
  ASSERT_EQ(run("hexsolve liver.hexmesh held.toml --check -o rest.hexresult").exit_code, 0);
  ASSERT_EQ(run("hexexport rest.hexresult --surface rest.vtp").exit_code, 0);
  const CommandResult found = run(
      "hexsolve liver.hexmesh held.toml --set solve.kind=dynamics --set dynamics.step_s=0.02 --set "
      "dynamics.duration_s=0.02 --stream | python3 -c 'import sys, struct\nf = sys.stdin.buffer\nf.readline()\np, t = "
      "(int(f.readline().split()[1]) for n in range(2))\nf.readline(), f.readline(), f.read(12 * t), f.read(8)\nx = "
      "struct.unpack(\"<%df\" % (3 * p), f.read(12 * p))[::3]\nprint(x.index(max(x)))'");
  ASSERT_EQ(found.exit_code, 0) << found.errors;
  const std::string point = found.output.substr(0, found.output.find('\n'));
  write_text(*folder / "script", "at 0.1 picture rest.png\nat 0.1 press " + point +
                                     "\nat 0.1 drag -30 -150\nat 1 picture pulled.png\nat 1 key s\nat 1.1 key c\n"
                                     "at 1.1 picture slices.png\nat 1.2 lift\nat 1.6 picture free.png\nat 1.6 close\n");
  const CommandResult r = view("liver.hexmesh held.toml --script script --record record -o kept.hexresult");
  ASSERT_EQ(r.exit_code, 0) << r.errors;

  const std::array<int, 4> rest = box_of_body(picture("rest.png")), pulled = box_of_body(picture("pulled.png"));
  EXPECT_GT(rest[2] - rest[0], 300) << "the body fills the window";
  const auto left_end = [&](const std::string& name) {
    return box_of_body(picture(name), rest[2] - (rest[2] - rest[0]) / 4);
  };
  EXPECT_GT(left_end("pulled.png")[1], left_end("rest.png")[1] + 40) << "the left end is pulled down";
  EXPECT_NEAR(pulled[0], rest[0], 10) << "the right end is held";
  EXPECT_NE(read_text(*folder / "slices.png"), read_text(*folder / "pulled.png"));

  const std::string record = read_text(*folder / "record");
  EXPECT_NE(record.find(" grab "), std::string::npos) << record;
  EXPECT_NE(record.find(" release"), std::string::npos) << record;
  EXPECT_NE(record.find(" end\n"), std::string::npos) << record;
  const hexmesh::Result kept = hexmesh::read_result(*folder / "kept.hexresult");
  EXPECT_GT(kept.times.size(), 10U);
  EXPECT_GE(kept.times.back(), 1.6);
  EXPECT_NE(kept.report.find("ended as asked"), std::string::npos);
  double largest = 0;
  for (std::size_t n = 0; n < kept.times.size(); ++n)
    for (const hexmesh::Vec3& u : hexmesh::read_step(*folder / "kept.hexresult", kept, n).displacement)
      largest = std::max(largest, u.norm());
  EXPECT_GT(largest, 20) << "150 pixels are some 40 mm";

  // The result again, with its steps.
  write_text(*folder / "again",
             "at 0 picture first.png\nat 1 picture last.png\nkey s\nkey c\npicture colours.png\nclose\n");
  const CommandResult again = view("kept.hexresult --scan ct.nrrd --script again");
  ASSERT_EQ(again.exit_code, 0) << again.errors;
  EXPECT_GT(left_end("last.png")[1], left_end("first.png")[1] + 40);
}

TEST_F(View, WhatIsWrongIsOneLine) {
  const auto refused = [](const std::string& arguments, int code, const std::string& words) {
    const CommandResult r = view(arguments);
    EXPECT_EQ(r.exit_code, code) << r.errors;
    EXPECT_NE(r.errors.find(words), std::string::npos) << r.errors;
    EXPECT_EQ(std::count(r.errors.begin(), r.errors.end(), '\n'), 1) << r.errors;
  };
  write_text(*folder / "bad", "at 1 press\n");
  write_text(*folder / "unknown", "close\nfoo\n");
  write_text(*folder / "back", "at 2 key s\nat 1 close\n");
  write_text(*folder / "taken", "picture ct.nrrd\n");
  const std::string live = "liver.hexmesh held.toml ";
  refused(live + "--script bad", 3, "bad:1: 'at 1 press', expected 1 words behind 'press'");
  refused(live + "--script unknown", 3, "unknown:2: 'foo', expected one of close, drag");
  refused(live + "--script back", 3, "back:2: 'at 1 close', expected times that do not fall");
  refused(live + "--script taken", 2, "picture 'ct.nrrd' of the script, expected a name that ends in .png");
  refused(live + "-o liver.hexmesh", 2, "output 'liver.hexmesh' is also an input");
  refused(live + "-o liver.nrrd", 6, "'liver.nrrd' exists");
  refused(live + "--color nothing", 2, "no field 'nothing'");
  refused("liver.hexmesh", 3, "expected a 'hexmesh result'");
  refused("- held.toml", 2, "the lattice or the scene is -");
  refused("liver.hexmesh nowhere.toml", 3, "no such file 'nowhere.toml'");
  const CommandResult blind = run("env -u DISPLAY hexview liver.hexmesh held.toml");
  EXPECT_EQ(blind.exit_code, 6);
  EXPECT_NE(blind.errors.find("DISPLAY is not set"), std::string::npos) << blind.errors;
}

}  // namespace test_view
