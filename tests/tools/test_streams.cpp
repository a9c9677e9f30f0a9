// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <sstream>

#include "tools_fixture.h"

namespace test_streams {

using namespace testing_support;
namespace fs = std::filesystem;

/// Standard streams that are closed, full or a terminal; names that no text can hold.
class Streams : public Tools {
protected:
  static void SetUpTestSuite() {
    Tools::SetUpTestSuite();
    ASSERT_EQ(run("hexsolve liver.hexmesh liver.toml --level 3 -o liver.hexresult").exit_code, 0);
  }

  static void expect_code(int code, const std::string& command) {
    const CommandResult r = run(command);
    EXPECT_EQ(r.exit_code, code) << command << "\n" << r.errors;
  }
};

TEST_F(Streams, StandardErrorThatCannotBeWrittenToEndsNoRun) {
  for (const char* to : {"2>&-", "2>/dev/full", "2>/dev/null"}) {
    for (const char* command :
         {"hexscan phantom liver --spacing 8 -o new.nrrd", "hexmesh build liver.nrrd -o new.hexmesh",
          "hexsolve liver.hexmesh liver.toml --level 3 --progress always -o new.hexresult",
          "hexexport liver.hexresult --lattice new.vtu", "hexslice volume liver.hexresult --size 64 -o new.png",
          "hexbench compare liver.hexresult liver.hexresult --exact -o new.json"}) {
      const auto before = listing();
      expect_code(0, fmt::format("{} {}", command, to));
      EXPECT_EQ(listing().size(), before.size() + 1) << command;
      run("rm -f new.*");
    }
    expect_code(3, fmt::format("hexmesh build absent.nrrd -o new.hexmesh {}", to));
    expect_code(2, fmt::format("hexmesh biuld {}", to));
    expect_code(4, fmt::format("hexsolve liver.hexmesh liver.toml --set 'fix.0.point_mm=[-149,-1,-15]' -o new {}", to));
  }
  // All three closed: nothing that is opened takes their numbers.
  expect_code(0,
              "hexmesh build liver.nrrd -o new.hexmesh <&- >&- 2>&-; code=$?; hexmesh info new.hexmesh && rm "
              "new.hexmesh && exit $code");
  // A reader that leaves.
  expect_code(0, "{ hexmesh build liver.nrrd -o new.hexmesh; echo $? >code; } 2>&1 | true; exit $(cat code)");
  run("rm new.hexmesh");
}

TEST_F(Streams, StandardOutputThatCannotBeWrittenToIsAnError) {
  for (const char* command : {"hexmesh info liver.hexmesh",
                              "hexmesh info liver.hexmesh --json",
                              "hexmesh check liver.hexmesh",
                              "hexmesh check liver.hexmesh --json",
                              "hexscan info liver.nrrd",
                              "hexscan info liver.nrrd --json",
                              "hexsolve liver.hexmesh --example",
                              "hexsolve liver.hexmesh liver.toml --check",
                              "hexsolve liver.hexmesh liver.toml --plan",
                              "hexsolve liver.hexmesh liver.toml --check --report -",
                              "hexsolve liver.hexmesh liver.toml --level 3 -o -",
                              "hexsolve liver.hexmesh liver.toml --level 3 -o no --report -",
                              "hexexport liver.hexresult --probe 98,-18,6",
                              "hexexport liver.hexresult --csv -",
                              "hexexport liver.hexresult --lattice -",
                              "hexmesh build liver.nrrd -o -",
                              "hexmesh build liver.nrrd -o no --report -",
                              "hexscan phantom liver --spacing 8 -o -",
                              "hexslice volume liver.hexresult --size 64 -o -",
                              "hexbench compare liver.hexresult liver.hexresult --exact",
                              "hexmesh --version",
                              "hexsolve --help",
                              "hexmesh build --help"}) {
    const auto before = listing();
    for (const char* to : {">/dev/full", ">&-"}) {
      const CommandResult r = run(fmt::format("{} {}", command, to));
      EXPECT_EQ(r.exit_code, 6) << command << to << "\n" << r.errors;
      EXPECT_NE(r.errors.find("error: cannot write standard output: "), std::string::npos) << r.errors;
    }
    EXPECT_EQ(listing(), before) << command;
  }
  // The reader of a pipe that leaves is one too.
  expect_code(6, "{ hexmesh info liver.hexmesh --json 2>/dev/null; echo $? >code; } | true; exit $(cat code)");
}

TEST_F(Streams, WhatIsNoTextDoesNotGoToATerminal) {
  if (run("command -v script").exit_code != 0) GTEST_SKIP() << "no script";
  for (const auto& [command, code] :
       std::vector<std::pair<std::string, int>>{{"hexscan phantom liver --spacing 8 -o -", 2},
                                                {"hexmesh build liver.nrrd -o -", 2},
                                                {"hexmesh build liver.nrrd -o /dev/tty", 2},
                                                {"hexsolve liver.hexmesh liver.toml --level 3 -o -", 2},
                                                {"hexexport liver.hexresult --lattice -", 2},
                                                {"hexslice volume liver.hexresult -o -", 2},
                                                {"hexexport liver.hexresult --csv -", 0},
                                                {"hexsolve liver.hexmesh --example", 0}}) {
    const CommandResult r = run(fmt::format("script -qec '{}' /dev/null </dev/null", command));
    EXPECT_EQ(r.exit_code, code) << command << "\n" << r.output;
    EXPECT_EQ(r.output.find("is a terminal") != std::string::npos, code == 2) << r.output;
  }
}

TEST_F(Streams, NamesThatAreNoUtf8AreNamesLikeOthers) {
  const std::string name =
      "l\xe9"
      "b";  // Latin-1
  const CommandResult r = run(fmt::format(
      "cp liver.nrrd {0}.nrrd && cp liver.toml {0}.toml && hexmesh build {0}.nrrd -o {0}.hexmesh --report build.json "
      "&& "
      "hexmesh info {0}.hexmesh --json >info.json && hexmesh check {0}.hexmesh --json >check.json && "
      "hexsolve {0}.hexmesh {0}.toml --level 3 -o {0}.hexresult --report solve.json && "
      "hexsolve {0}.hexmesh {0}.toml --check --report check.json --force && "
      "hexexport {0}.hexresult --report report.json --csv {0}.csv --lattice {0}.vtu --html {0}.html && "
      "hexslice planes {0}.hexresult --axis axial --count 1 -o {0} && hexscan info {0}.nrrd --json >scan.json && "
      "hexbench compare --exact {0}.hexresult {0}.hexresult -o {0}.json",
      name));
  EXPECT_EQ(r.exit_code, 0) << r.errors;
  EXPECT_EQ(r.errors.find('\xe9'), std::string::npos) << "shown as text";
  for (const char* file : {"build.json", "info.json", "check.json", "solve.json", "report.json", "scan.json"})
    EXPECT_TRUE(nlohmann::json::accept(read_text(*folder / file))) << file;
  const auto history = nlohmann::json::parse(read_text(*folder / "info.json"))["history"][0].get<std::string>();
  EXPECT_EQ(history.find("hexmesh build $'l\\xe9b.nrrd'"), 0U) << "the command again, for bash: " << history;
  // A segment of such a name.
  ASSERT_EQ(run("gunzip -c liver.nrrd >/dev/null 2>&1; sed 's/^Segment0_Name:=liver/Segment0_Name:=li\\xe9er/' "
                "liver.nrrd >odd.nrrd && hexmesh build odd.nrrd --material '*:young_kpa=1,poisson=0.3' -o odd.hexmesh "
                "--report odd.json --force")
                .exit_code,
            0);
  EXPECT_TRUE(nlohmann::json::accept(read_text(*folder / "odd.json")));
}

TEST_F(Streams, ControlCharactersFromFilesDoNotReachTheTerminal) {
  const std::string escape = "\x1b[31m";
  ASSERT_EQ(run("sed 's/^Segment0_Name:=liver/Segment0_Name:=\\x1b[31mr/' liver.nrrd >red.nrrd").exit_code, 0);
  const CommandResult r = run(
      "hexscan info red.nrrd; hexscan red.nrrd -o red2.nrrd; hexmesh build red.nrrd --material "
      "'*:young_kpa=1,poisson=0.3' -o red.hexmesh && hexmesh info red.hexmesh; hexmesh surface red.hexmesh --segment "
      "x -o x.stl; hexmesh build \"$(printf 'no\\033[31m')\" -o x; hexsolve red.hexmesh \"$(printf "
      "'no\\033[31m')\" -o x");
  EXPECT_EQ(r.output.find('\x1b'), std::string::npos) << r.output;
  EXPECT_EQ(r.errors.find('\x1b'), std::string::npos) << r.errors;
  EXPECT_NE(r.output.find("\\x1b[31mr"), std::string::npos) << r.output;
  EXPECT_NE(r.errors.find("\\x1b[31m"), std::string::npos) << r.errors;
}

TEST_F(Streams, FilesThatCannotBeOpenedAreNoBugs) {
  const std::string longest(300, 'n');
  ASSERT_EQ(
      run("ln -sf loop loop && mkdir -p folder && ln -sf loop folder/loop && ln -sf /absent folder/dangling").exit_code,
      0);
  for (const std::string& name : {longest, std::string("loop"), std::string("loop/x"), std::string("folder")}) {
    for (const char* command :
         {"hexscan {} -o a.nrrd", "hexscan info {}",
          "hexscan liver.nrrd --intensity {} --intensity-out b.nrrd -o a.nrrd",
          "hexscan liver.nrrd --roi-markup {} -o a.nrrd", "hexmesh build {} -o a", "hexmesh info {}",
          "hexmesh check {}", "hexmesh build liver.nrrd --materials {} -o a",
          "hexmesh build liver.nrrd --embed liver={} -o a", "hexsolve {} liver.toml -o a",
          "hexsolve liver.hexmesh {} -o a", "hexexport {} --lattice a.vtu",
          "hexexport liver.hexresult --html a.html --scan {}", "hexslice planes {} -o pictures",
          "hexslice volume liver.hexresult --scan {} -o a.png", "hexbench compare {} liver.hexresult --exact"}) {
      const CommandResult r = run(fmt::format(fmt::runtime(command), name));
      EXPECT_EQ(r.exit_code, 3) << fmt::format(fmt::runtime(command), name) << "\n" << r.errors;
      EXPECT_NE(r.errors.find("error: "), std::string::npos);
    }
    write_text(*folder / "odd.toml", "[[fix]]\nmarkup = '" + name + "'\n");
    expect_code(3, "hexsolve liver.hexmesh odd.toml --check");
    write_text(*folder / "odd.toml",
               "[solve]\nkind = 'dynamics'\n[dynamics]\nstep_s = 1\nduration_s = 1\nstart = '" + name + "'\n");
    expect_code(3, "hexsolve liver.hexmesh odd.toml --level 3 -o a");
    if (name == "folder") continue;
    for (const char* command :
         {"hexscan phantom liver --spacing 8 -o {}", "hexmesh build liver.nrrd -o {}",
          "hexmesh build liver.nrrd -o a --report {}", "hexsolve liver.hexmesh --example -o {}",
          "hexsolve liver.hexmesh liver.toml --level 3 -o {}", "hexslice planes liver.hexresult -o {}"})
      expect_code(6, fmt::format(fmt::runtime(std::string(command) + " --force"), name));
  }
  EXPECT_EQ(run("hexexport liver.hexresult --probe " + longest).exit_code, 2) << "no point, and no file";
  // Links in a folder of scans that lead nowhere are told and left out.
  const fs::path scans = shared_data() / "dcmqi/ct-3slice";
  if (!fs::exists(scans)) return;
  const CommandResult r = run(fmt::format(
      "cp -r '{}' ct3 && ln -s loop ct3/loop && ln -s /absent ct3/slice && hexscan info ct3", scans.string()));
  EXPECT_EQ(r.exit_code, 0) << r.errors;
  EXPECT_NE(r.errors.find("'ct3/slice' leads to no file"), std::string::npos) << r.errors;
}

TEST_F(Streams, WithoutAPlaceForTemporaryFilesPipesAreErrorsOfOutput) {
  for (const char* command :
       {"hexmesh info - <liver.hexmesh", "hexmesh build liver.nrrd -o - >/dev/null",
        "hexsolve - liver.toml --level 3 -o a2 <liver.hexmesh", "hexscan - -o a2.nrrd <liver.nrrd",
        "hexsolve liver.hexmesh liver.toml --level 3 -o - >/dev/null"}) {
    const CommandResult r = run(std::string("TMPDIR=/absent ") + command);
    EXPECT_EQ(r.exit_code, 6) << command << "\n" << r.errors;
    EXPECT_NE(r.errors.find("TMPDIR"), std::string::npos) << r.errors;
  }
  // Texts need none.
  expect_code(0,
              "TMPDIR=/absent hexmesh info liver.hexmesh && TMPDIR=/absent hexscan info liver.nrrd && "
              "TMPDIR=/absent hexsolve liver.hexmesh liver.toml --check --report -");
  // A full disk is no empty input.
  const CommandResult full = run("bash -c 'ulimit -f 2; hexmesh info -' <liver.hexmesh");
  EXPECT_EQ(full.exit_code, 6) << full.errors;
  EXPECT_NE(full.errors.find("cannot spool standard input"), std::string::npos) << full.errors;
  expect_code(3, "hexmesh info - </dev/null");
  expect_code(3, "hexmesh info - <&-");
}

TEST_F(Streams, AFileThatGetsTooLargeIsOneLineAndLeavesNothing) {
  const auto before = listing();
  for (const char* command : {"hexscan phantom liver --spacing 4 -o full.nrrd",
                              "hexmesh build liver.nrrd -o full.hexmesh",
                              "hexmesh surface liver.hexmesh -o full.stl",
                              "hexmesh surface liver.hexmesh -o full.obj",
                              "hexmesh surface liver.hexmesh -o full.ply",
                              "hexmesh surface liver.hexmesh -o full.off",
                              "hexsolve liver.hexmesh liver.toml --level 1 -o full.hexresult",
                              "hexsolve liver.hexmesh --example -o full.toml",
                              "hexexport liver.hexresult --lattice full.vtu",
                              "hexexport liver.hexresult --lattice full.hdf",
                              "hexexport liver.hexresult --surface full.vtp",
                              "hexexport liver.hexresult --surface full.stl",
                              "hexexport liver.hexresult --conditions full.vtp",
                              "hexexport liver.hexresult --csv full.csv",
                              "hexexport liver.hexresult --html full.html",
                              "hexexport liver.hexresult --segmentation full.nrrd",
                              "hexexport liver.hexresult --segmentation full.nii",
                              "hexexport liver.hexresult --segmentation full.nii.gz",
                              "hexexport liver.hexresult --transform full.h5",
                              "hexexport liver.hexresult --transform full.mha",
                              "hexexport liver.hexresult --transform full.nrrd",
                              "hexslice volume liver.hexresult -o full.png",
                              "hexslice planes liver.hexresult -o full"}) {
    const CommandResult r = run(fmt::format("bash -c \"ulimit -f 1; {} -q\"", command));
    if (r.exit_code == 0 && std::string(command).find("--example") != std::string::npos) {
      run("rm -f full.toml");  // is small
      continue;
    }
    EXPECT_EQ(r.exit_code, 6) << command << "\n" << r.errors;
    // No library says anything: all lines are the tool's, one of them the error.
    const std::string tool = std::string(command).substr(0, std::string(command).find(' '));
    std::istringstream lines(r.errors);
    int errors = 0;
    for (std::string line; std::getline(lines, line);) {
      errors += line.starts_with(tool + ": error: ");
      EXPECT_TRUE(line.starts_with(tool + ": error: ") || line.starts_with(tool + ": warning: ")) << line;
    }
    EXPECT_EQ(errors, 1) << command << "\n" << r.errors;
    EXPECT_EQ(listing(), before) << command;
  }
}

TEST_F(Streams, MaterialsOfTheCommandLineAreChecked) {
  expect_failure("hexmesh build liver.nrrd --material liver:young_kpa=1,young_kpa=2,poisson=0.3 -o a", 2,
                 {"young_kpa is given twice"});
  expect_failure("hexmesh build liver.nrrd --material '*:young_kpa=1,poisson=0.4999999999' -o a", 3,
                 {"poisson is 0.4999999999", "-0.99 to 0.49999"});
  expect_failure("hexsolve liver.hexmesh liver.toml --set material.liver.poisson=0.4999999999 -o a", 3,
                 {"poisson", "-0.99 to 0.49999"});
}

}  // namespace test_streams
