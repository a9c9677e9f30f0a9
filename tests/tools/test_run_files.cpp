// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <nlohmann/json.hpp>

#include "tools_fixture.h"

namespace test_run_files {

using namespace testing_support;
namespace fs = std::filesystem;

/// A markup of one point at the phantom's left end.
const std::string point_markup =
    R"({"markups":[{"type":"Fiducial","coordinateSystem":"LPS","controlPoints":[{"position":[98,-18,6]}]}]})";

/// What runs read and write: by all their names, against each other, and by several runs at once.
class RunFiles : public Tools {
protected:
  static void SetUpTestSuite() {
    Tools::SetUpTestSuite();
    write_text(*folder / "materials.toml", "[material.\"*\"]\nyoung_kpa = 100\npoisson = 0.3\n");
    write_text(*folder / "point.mrk.json", point_markup);
    write_text(
        *folder / "marked.toml",
        "[[fix]]\npoint_mm = [-99, -1, -15]\nradius_mm = 10\n[[displace]]\nmarkup = 'point.mrk.json'\nradius_mm = "
        "10\nby_mm = [0, -5, 0]\n");
    write_text(*folder / "again.toml",
               "[solve]\nkind = 'dynamics'\n[dynamics]\nstep_s = 0.02\nduration_s = 0.04\nstart = 'liver.hexresult'\n"
               "[[fix]]\npoint_mm = [-99, -1, -15]\n");
    ASSERT_EQ(run("hexsolve liver.hexmesh liver.toml --level 3 -o liver.hexresult").exit_code, 0);
    ASSERT_EQ(run("hexmesh surface liver.hexmesh --segment tumour -o tumour.stl").exit_code, 0);
  }

  /// Refused as a mistake of usage in one line; the file is as it was, and there is no new one.
  static void expect_kept(const std::string& file, const std::string& command) {
    const std::string before = read_text(*folder / file);
    const auto names = listing();
    const CommandResult r = run(command);
    EXPECT_EQ(r.exit_code, 2) << command << "\n" << r.errors;
    EXPECT_EQ(std::count(r.errors.begin(), r.errors.end(), '\n'), 1) << r.errors;
    EXPECT_TRUE(r.errors.find("input") != std::string::npos) << r.errors;
    EXPECT_TRUE(read_text(*folder / file) == before) << command;
    EXPECT_EQ(listing(), names) << command;
  }

  /// Refused as a mistake of usage that is told in these words; nothing is written.
  static void expect_refused(const std::string& command, const std::string& words) {
    const auto names = listing();
    const CommandResult r = run(command);
    EXPECT_EQ(r.exit_code, 2) << command << "\n" << r.errors;
    EXPECT_NE(r.errors.find(words), std::string::npos) << r.errors;
    EXPECT_EQ(r.output, "") << command;
    EXPECT_EQ(listing(), names) << command;
  }
};

TEST_F(RunFiles, NoOutputReplacesAnInput) {
  for (const auto& [file, command] : std::vector<std::pair<std::string, std::string>>{
           {"liver.nrrd", "hexscan liver.nrrd -o liver.nrrd"},
           {"liver.nrrd", "hexscan --input body=liver.nrrd -o liver.nrrd"},
           {"ct.nrrd", "hexscan liver.nrrd --intensity ct.nrrd --intensity-out ct.nrrd -o new.nrrd"},
           {"liver.nrrd", "hexscan liver.nrrd --intensity ct.nrrd --intensity-out liver.nrrd -o new.nrrd"},
           {"point.mrk.json", "hexscan liver.nrrd --roi-markup point.mrk.json -o point.mrk.json"},
           {"liver.nrrd", "hexmesh build liver.nrrd -o liver.nrrd"},
           {"liver.nrrd", "hexmesh build liver.nrrd -o new --report liver.nrrd"},
           {"materials.toml", "hexmesh build liver.nrrd --materials materials.toml -o materials.toml"},
           {"materials.toml", "hexmesh build liver.nrrd --materials materials.toml -o new --report materials.toml"},
           {"ct.nrrd", "hexmesh build liver.nrrd --intensity ct.nrrd -o ct.nrrd"},
           {"tumour.stl", "hexmesh build liver.nrrd --embed tumour=tumour.stl -o new --report tumour.stl"},
           {"liver.hexmesh", "hexsolve liver.hexmesh --example -o liver.hexmesh"},
           {"liver.hexmesh", "hexsolve liver.hexmesh liver.toml -o liver.hexmesh"},
           {"liver.toml", "hexsolve liver.hexmesh liver.toml -o liver.toml"},
           {"liver.toml", "hexsolve liver.hexmesh liver.toml -o new --report liver.toml"},
           {"liver.hexmesh", "hexsolve liver.hexmesh liver.toml --check --report liver.hexmesh"},
           {"liver.toml", "hexsolve liver.hexmesh liver.toml --plan --report liver.toml"},
           {"point.mrk.json", "hexsolve liver.hexmesh marked.toml --level 3 -o point.mrk.json"},
           {"point.mrk.json", "hexsolve liver.hexmesh marked.toml --check --report point.mrk.json"},
           {"liver.hexresult", "hexsolve liver.hexmesh again.toml --level 3 -o liver.hexresult"},
           {"point.mrk.json",
            "cp point.mrk.json p.csv && hexexport liver.hexresult --probe p.csv --csv p.csv; "
            "code=$?; rm p.csv; exit $code"},
           {"ct.nrrd", "hexexport liver.hexresult --warp ct.nrrd --to ct.nrrd"},
           {"liver.nrrd", "hexexport liver.hexresult --segmentation liver.nrrd --grid liver.nrrd"},
           {"liver.hexresult",
            "cp liver.hexresult r.vtu && hexexport r.vtu --lattice r.vtu; code=$?; cmp r.vtu "
            "liver.hexresult && rm r.vtu; exit $code"},
           {"liver.hexresult",
            "cp liver.hexresult r.png && hexslice volume r.png -o r.png; code=$?; cmp r.png "
            "liver.hexresult && rm r.png; exit $code"},
           {"ct.nrrd",
            "mkdir seen && cp ct.nrrd seen/axial_1.png && hexslice planes liver.hexresult --scan "
            "seen/axial_1.png --axis axial --count 1 -o seen; code=$?; cmp seen/axial_1.png ct.nrrd && "
            "rm -r seen; exit $code"},
           {"liver.hexmesh", "hexbench lattice liver.hexmesh -o liver.hexmesh"},
           {"liver.toml", "hexbench solver liver.hexmesh liver.toml -o liver.toml"},
           {"point.mrk.json", "hexbench effects liver.hexmesh marked.toml -o point.mrk.json"},
           {"liver.hexresult", "hexbench compare liver.hexresult liver.hexresult --exact -o liver.hexresult"},
           {"liver.toml", "hexbench accuracy liver.hexmesh liver.toml --csv liver.toml"}}) {
    std::string forced = command;
    forced.insert(std::min(command.find(';'), command.size()), " --force");
    expect_kept(file, forced);
  }
}

TEST_F(RunFiles, AnInputHasManyNames) {
  ASSERT_EQ(run("ln -s liver.nrrd link.nrrd && ln liver.nrrd hard.nrrd && mkdir deep && ln -s .. deep/up").exit_code,
            0);
  const std::string here = folder->path("");
  for (const std::string& name :
       {std::string("./liver.nrrd"), std::string("deep/../liver.nrrd"), here + "liver.nrrd", std::string("link.nrrd"),
        std::string("hard.nrrd"), std::string("deep/up/liver.nrrd")})
    expect_kept("liver.nrrd", "hexmesh build liver.nrrd -o new --force --report " + name);
  expect_kept("liver.nrrd", "hexmesh build link.nrrd -o liver.nrrd --force");
  // The streams of the shell.
  expect_kept("liver.nrrd", "hexmesh build - -o liver.nrrd --force <liver.nrrd");
  expect_kept("liver.nrrd", "hexmesh build /dev/stdin -o liver.nrrd --force <liver.nrrd");
  expect_kept("liver.nrrd", "hexmesh build liver.nrrd -o - --force 1<>liver.nrrd");
  expect_kept("liver.nrrd", "hexmesh build liver.nrrd -o new --report /dev/stdout --force 1<>liver.nrrd");
}

TEST_F(RunFiles, PartsOfAnInputAreInputs) {
  // The data of a detached header.
  ASSERT_EQ(run("mkdir raw && python3 - <<'END'\n"
                "import os\n"
                "open('raw/a.raw', 'wb').write(bytes([1] * 1000))\n"
                "open('raw/a.nhdr', 'w').write('NRRD0004\\ntype: uchar\\ndimension: 3\\nspace: "
                "left-posterior-superior\\nsizes: 10 10 10\\nspace directions: (4,0,0) (0,4,0) (0,0,4)\\nspace origin: "
                "(0,0,0)\\nencoding: raw\\ndata file: a.raw\\n')\nEND\n")
                .exit_code,
            0);
  ASSERT_EQ(run("hexscan raw/a.nhdr -o b.nrrd").exit_code, 0);
  expect_kept("raw/a.raw", "hexscan raw/a.nhdr -o raw/a.raw --force");
  // A folder of DICOM files, where other files may be replaced.
  ASSERT_EQ(run("mkdir -p dicom/sub && printf '%128s' '' >dicom/sub/IM1 && printf DICM >>dicom/sub/IM1").exit_code, 0);
  expect_kept("dicom/sub/IM1", "hexscan dicom -o dicom/sub/IM1 --force");
  ASSERT_EQ(run("ln dicom/sub/IM1 dicom/im.csv").exit_code, 0);
  expect_kept("dicom/im.csv", "hexexport liver.hexresult --scan dicom --html new.html --csv dicom/im.csv --force");
  write_text(*folder / "dicom/old.nrrd", "of an earlier run");
  EXPECT_EQ(run("hexscan dicom -o dicom/old.nrrd --force").exit_code, 3) << "no whole DICOM file, but no input either";
}

TEST_F(RunFiles, OutputsAreDifferentFiles) {
  expect_refused("hexsolve liver.hexmesh liver.toml --level 3 -o z --report z", "two outputs are both 'z'");
  expect_refused("hexsolve liver.hexmesh liver.toml --level 3 -o z --report ./z", "same file");
  expect_refused("hexscan phantom liver --spacing 8 -o a.nrrd --intensity-out a.nrrd", "two outputs are both 'a.nrrd'");
  expect_refused("hexscan phantom liver --spacing 8 -o ./a.nrrd --intensity-out a.nrrd", "same file");
  expect_refused("hexmesh build liver.nrrd -o z --report absent/../z", "same file");
  ASSERT_EQ(run("touch one && ln one two && ln -s three four").exit_code, 0);
  expect_refused("hexmesh build liver.nrrd -o one --report two --force", "same file");
  expect_refused("hexmesh build liver.nrrd -o three --report four", "same file");
  expect_refused("hexexport liver.hexresult --surface m.vtp --conditions ./m.vtp", "same file");
  for (const char* command :
       {"hexsolve liver.hexmesh liver.toml --level 3 -o - --report -", "hexmesh build liver.nrrd -o - --report -",
        "hexsolve liver.hexmesh liver.toml --level 3 -o /dev/stdout --report -",
        "hexsolve liver.hexmesh again.toml --level 3 --stream --report /dev/stdout",
        "hexexport liver.hexresult --probe 98,-18,6 --csv -", "hexbench paper table1 --json -",
        "hexscan phantom liver --spacing 8 -o - --intensity-out -"})
    expect_refused(command, "two outputs go to standard output");
  expect_refused("hexexport - --scan - --html a.html <liver.hexresult", "standard input is read for two inputs");
  EXPECT_EQ(run("hexmesh build liver.nrrd -q -o /dev/null --report /dev/null").exit_code, 0) << "takes anything";
}

TEST_F(RunFiles, OfTwoRunsAtOnceOneWins) {
  for (int again = 0; again < 3; ++again) {
    const CommandResult r = run(
        "rm -f won.hexmesh; for n in 1 2; do ( hexmesh -q build liver.nrrd -o won.hexmesh --report won.json; echo $? "
        ">code.$n ) & done; wait; cat code.1 code.2; rm won.json");
    EXPECT_TRUE(r.output == "0\n6\n" || r.output == "6\n0\n") << r.output << r.errors;
    EXPECT_NE(r.errors.find("exists, expected a new name or leave to replace it (--force)"), std::string::npos)
        << r.errors;
  }
  EXPECT_EQ(run("hexmesh info won.hexmesh").exit_code, 0);
}

TEST_F(RunFiles, DevicesAndPipesAreWrittenToAndLinksFollowed) {
  const CommandResult r =
      run("mkfifo pipe && { cat pipe >through.hexmesh & hexmesh -q build liver.nrrd -o pipe; wait; } && "
          "hexmesh -q build liver.nrrd -o /dev/null --force && test -c /dev/null && test -p pipe && "
          "mkdir -p far && ln -s far/target.hexmesh near.hexmesh && hexmesh -q build liver.nrrd -o near.hexmesh && "
          "test -h near.hexmesh && hexmesh -q build liver.nrrd -o near.hexmesh --force && test -h near.hexmesh && "
          "hexmesh -q build liver.nrrd -o /dev/stdout >shell.hexmesh && "
          "for file in through far/target shell; do hexmesh info $file.hexmesh --json; done | grep -c '\"sha256\"'");
  EXPECT_EQ(r.exit_code, 0) << r.errors;
  EXPECT_EQ(r.output, "3\n");
  const CommandResult process =
      run("bash -c 'hexsolve -q liver.hexmesh --example -o >(cat >told.toml); sleep 0.5' && "
          "cmp told.toml liver.toml");
  EXPECT_EQ(process.exit_code, 0) << process.errors;
}

TEST_F(RunFiles, AllOutputsAppearOrNone) {
  expect_failure("hexexport liver.hexresult --lattice early.vtu --csv early.csv --inp late.inp", 3, {"--inp"});
  expect_failure("hexexport liver.hexresult --lattice early.vtu --segmentation absent/late.nrrd", 6, {"absent"});
  const auto before = listing();
  EXPECT_EQ(run("hexslice planes liver.hexresult -o made/for/nothing --color displacement --scan liver.toml").exit_code,
            3);
  EXPECT_EQ(run("hexsolve liver.hexmesh liver.toml --level 3 -o early --report /dev/full").exit_code, 6);
  EXPECT_EQ(listing(), before);
}

TEST_F(RunFiles, AScenePipedInIsASceneAndSaysSo) {
  const CommandResult r =
      run("hexsolve -q liver.hexmesh - --level 3 -o piped.hexresult <liver.toml && "
          "bash -c 'hexsolve -q liver.hexmesh <(cat marked.toml) --level 3 -o marked.hexresult' && "
          "hexsolve -q liver.hexmesh marked.toml --level 3 -o plain.hexresult && "
          "hexbench -q compare --exact marked.hexresult plain.hexresult; "
          "cat liver.toml | hexbench -q solver liver.hexmesh - --level 3 --repeats 1; "
          "cat materials.toml | hexmesh -q build liver.nrrd --materials - -o of_pipe.hexmesh && "
          "cat point.mrk.json | hexexport -q liver.hexresult --probe -");
  EXPECT_EQ(r.exit_code, 0) << r.errors;
  EXPECT_NE(r.output.find("standard input:1,"), std::string::npos) << r.output;
  const auto difference = run("hexbench -q compare --exact marked.hexresult plain.hexresult");
  for (const auto& dataset : nlohmann::json::parse(difference.output))
    EXPECT_TRUE(dataset["dataset"] == "/history" || dataset["dataset"] == "/costs") << dataset;
  const std::string sum = run("sha256sum <liver.toml").output.substr(0, 64);
  EXPECT_NE(run("h5dump -d /history piped.hexresult 2>&1 || strings piped.hexresult").output.find(sum + "  -"),
            std::string::npos);

  for (const auto& [command, words] : std::vector<std::pair<std::string, std::string>>{
           {"echo 'strian = 1' | hexsolve liver.hexmesh - -o a", "standard input:1:1"},
           {"echo nothing | hexmesh info -", "'standard input'"},
           {"echo nothing | hexscan - -o a.nrrd", "'standard input'"},
           {"echo x | hexmesh build liver.nrrd --materials - -o a", "standard input:1"}}) {
    const CommandResult failed = run(command);
    EXPECT_NE(failed.errors.find(words), std::string::npos) << failed.errors;
    EXPECT_EQ(failed.errors.find(".hextools-"), std::string::npos) << failed.errors;
    EXPECT_EQ(std::count(failed.errors.begin(), failed.errors.end(), '\n'), 1) << failed.errors;
  }
  const CommandResult info = run("hexscan info --json - <liver.nrrd; hexscan info - <liver.nrrd");
  EXPECT_EQ(info.output.find(".hextools-"), std::string::npos) << info.output;
  EXPECT_NE(info.output.find("\"name\": \"standard input\""), std::string::npos) << info.output;
}

TEST_F(RunFiles, WhatIsNoTextIsRefusedAsASceneOrMaterials) {
  ASSERT_EQ(run("mkdir void && truncate -s 5G huge.toml").exit_code, 0);
  for (const char* file : {"void", "/dev/zero", "huge.toml"}) {
    expect_failure(fmt::format("hexsolve liver.hexmesh {} --check", file), 3, {file});
    expect_failure(fmt::format("hexmesh build liver.nrrd --materials {} -o a", file), 3, {file});
    expect_failure(fmt::format("hexbench solver liver.hexmesh {}", file), 3, {file});
    expect_failure(fmt::format("hexscan liver.nrrd --roi-markup {} -o a.nrrd", file), 3, {file});
    write_text(*folder / "odd.toml", fmt::format("[[fix]]\nmarkup = '{}'\n", file));
    expect_failure("hexsolve liver.hexmesh odd.toml --check", 3, {file});
  }
  for (const char* command : {"hexsolve liver.hexmesh - --check", "hexmesh build liver.nrrd --materials - -o a"}) {
    const CommandResult endless = run(fmt::format("yes 'a = 1' 2>/dev/null | {}", command));
    EXPECT_EQ(endless.exit_code, 3);
    EXPECT_NE(endless.errors.find("standard input has more than"), std::string::npos) << endless.errors;
    EXPECT_EQ(run(fmt::format("{} </dev/zero", command)).exit_code, 3);
  }
  ASSERT_EQ(run("rm -r huge.toml void odd.toml").exit_code, 0);
}

TEST_F(RunFiles, WhatAKilledRunLeftIsClearedByTheNext) {
  const auto before = listing();
  // Stopped where it has made its temporary file and waits for its input.
  const CommandResult r = run(
      "mkfifo slow && { sleep 30 >slow & sleeper=$!; }; hexmesh build slow -o late.hexmesh & pid=$!; for n in $(seq "
      "100); do ls .hextools-* >/dev/null 2>&1 && break; sleep 0.1; done; kill -9 $pid; wait $pid; kill $sleeper; rm "
      "slow; ls -a | grep -c hextools-");
  EXPECT_EQ(r.output, "1\n") << r.errors;
  ASSERT_EQ(run("hexsolve -q liver.hexmesh --example -o next.toml && rm next.toml").exit_code, 0);
  EXPECT_EQ(listing(), before);
  for (const char* signal : {"TERM", "INT", "HUP", "XFSZ", "QUIT"}) {
    // A run that is not ended by it is whole.
    run(fmt::format(
        "true; hexscan -q phantom liver --spacing 1 -o late.nrrd & pid=$!; sleep 0.2; kill -{} $pid; wait $pid; "
        "code=$?; [ $code -ne 0 ] || hexscan info late.nrrd || touch broken; rm -f late.nrrd",
        signal));
    EXPECT_EQ(listing(), before) << signal;
  }
}

TEST_F(RunFiles, PipelinesTakeNamesThatLookLikeOptions) {
  ASSERT_EQ(run("cp liver.nrrd ./--x.nrrd").exit_code, 0);
  const CommandResult r =
      run("'" HEXTOOLS_SOURCE "/pipelines/liver.sh' --scan --x.nrrd --levels 3 --poisson 0.3 -o -y");
  EXPECT_EQ(r.exit_code, 0) << r.errors;
  EXPECT_TRUE(fs::exists(*folder / "-y/summary.txt"));
  EXPECT_EQ(run("'" HEXTOOLS_SOURCE "/pipelines/liver.sh' -o y --scan").exit_code, 2);
}

}  // namespace test_run_files
