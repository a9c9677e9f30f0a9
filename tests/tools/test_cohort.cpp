// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "support/files.h"

namespace test_cohort {

using namespace testing_support;
using nlohmann::json;

const std::string cohort = "'" HEXTOOLS_SOURCE "/pipelines/cohort.sh' ";

/// Two phantoms, one that is cut off in the middle, and one without anything in it.
class Cohort : public testing::Test {
protected:
  void SetUp() override {
    if (shell("command -v snakemake").exit_code != 0) GTEST_SKIP() << "no snakemake";
    const CommandResult r = run(
        "mkdir scans && hexscan phantom liver --spacing 10 -o scans/a.seg.nrrd && "
        "hexscan phantom cylinder --spacing 6 -o scans/b-2.nrrd && head -c 900 scans/a.seg.nrrd >scans/cut.nrrd && "
        "printf '[material.\"*\"]\\nyoung_kpa = 100\\npoisson = 0.3\\n' >materials.toml && "
        "printf '[[fix]]\\nhalfspace = { point_mm = [0, 0, 20], normal = [0, 0, 1] }\\n[[displace]]\\nhalfspace = { "
        "point_mm = [0, 0, -20], normal = [0, 0, -1] }\\nby_mm = [5, 0, 0]\\n' >scene.toml");
    ASSERT_EQ(r.exit_code, 0) << r.errors;
  }

  CommandResult run(const std::string& words) const { return shell("cd '" + folder.path("") + "' || exit; " + words); }
  json summary() const { return json::parse(read_text(folder / "out/summary.json")); }

  /// Files with the times at which they were written.
  std::map<std::string, std::filesystem::file_time_type> written() const {
    std::map<std::string, std::filesystem::file_time_type> out;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder / "out"))
      if (entry.is_regular_file() && entry.path().string().find("/sub-") != std::string::npos)
        out[entry.path().string()] = entry.last_write_time();
    return out;
  }

  const std::string command = cohort + "scans -o out --scene scene.toml --materials materials.toml ";
  TemporaryFolder folder;
};

TEST_F(Cohort, ACaseThatFailsIsToldAndStopsNoOther) {
  const CommandResult r = run(command);
  EXPECT_EQ(r.exit_code, 1) << r.errors;
  const json rows = summary();
  ASSERT_EQ(rows.size(), 3U);
  EXPECT_EQ(rows[0]["participant_id"], "sub-a");
  EXPECT_EQ(rows[1]["participant_id"], "sub-b2");
  for (std::size_t n = 0; n < 2; ++n) {
    const std::string name = rows[n]["participant_id"], stem = "out/" + name + "/" + name;
    EXPECT_EQ(rows[n]["status"], "solved") << rows[n]["flags"];
    EXPECT_GT(rows[n]["volume_ml"].get<double>(), 100);
    for (const char* output : {"_dseg.nrrd", "_desc-lattice_mesh.hexmesh", "_desc-pull_result.hexresult",
                               "_desc-pull_report.html", "_desc-pull_view-oblique.png", "_desc-pull_view-axial.png"})
      EXPECT_TRUE(std::filesystem::exists(folder / (stem + output))) << stem << output;
    for (const char* sidecar :
         {"_dseg.json", "_desc-lattice_mesh.json", "_desc-pull_result.json", "_desc-pull_report.json"}) {
      const json content = json::parse(read_text(folder / (stem + sidecar)));
      EXPECT_TRUE(content.contains("Description") && content.contains("Sources") && content.contains("GeneratedBy"));
    }
  }
  EXPECT_EQ(rows[2]["status"], "failed");
  EXPECT_NE(rows[2]["flags"].get<std::string>().find("labels: hexscan: error: "), std::string::npos)
      << rows[2]["flags"];
  EXPECT_EQ(json::parse(read_text(folder / "out/dataset_description.json"))["DatasetType"], "derivative");
  const std::string page = read_text(folder / "out/summary.html");
  EXPECT_NE(page.find("3 cases, 2 solved, 1 failed"), std::string::npos);
  EXPECT_NE(page.find("sub-a_desc-pull_view-oblique.png"), std::string::npos);

  // A segment by its name, for all that do not say.
  EXPECT_EQ(run(cohort + "scans -o livers --segment liver --scene scene.toml --materials materials.toml").exit_code, 1);
  EXPECT_EQ(json::parse(read_text(folder / "livers/summary.json"))[0]["status"], "solved");

  // Again: nothing of what was done is done again.
  const auto before = written();
  EXPECT_EQ(run(command).exit_code, 1);
  for (const auto& [file, time] : written())
    if (file.find("cut") == std::string::npos) {
      EXPECT_EQ(before.at(file), time) << file;
    }
}

TEST_F(Cohort, WhatChangesIsDoneAgainAndWhatFailsThenIsToldSo) {
  ASSERT_EQ(run("rm scans/cut.nrrd").exit_code, 0);
  ASSERT_EQ(run(command).exit_code, 0);
  const auto first = written();
  const std::string result = folder.path("out/sub-a/sub-a_desc-pull_result.hexresult"),
                    labels = folder.path("out/sub-a/sub-a_dseg.nrrd");
  // Another scene under the same name, and a level that is number zero.
  ASSERT_EQ(run("sed -i 's/5, 0, 0/4, 0, 0/' scene.toml").exit_code, 0);
  ASSERT_EQ(run(command + "--level 0").exit_code, 0);
  EXPECT_EQ(first.at(labels), written().at(labels));
  EXPECT_NE(first.at(result), written().at(result));
  EXPECT_EQ(summary()[0]["level"], 0);
  // A scan that was cut off since: its old results do not count, and stay away.
  ASSERT_EQ(run("head -c 900 scans/a.seg.nrrd >cut && mv cut scans/a.seg.nrrd").exit_code, 0);
  for (int again = 0; again < 2; ++again) {
    EXPECT_EQ(run(command + "--level 0").exit_code, 1);
    EXPECT_EQ(summary()[0]["status"], "failed");
    EXPECT_NE(summary()[0]["flags"].get<std::string>().find("labels: hexscan: error: "), std::string::npos);
    EXPECT_EQ(summary()[1]["status"], "solved");
  }
  // What is no case's fault is not hidden.
  const CommandResult r = run(command + "-- --no-such-option");
  EXPECT_EQ(r.exit_code, 4);
  EXPECT_NE(r.errors.find("no-such-option"), std::string::npos) << r.errors;
}

TEST_F(Cohort, KilledItGoesOnWhereItWas) {
  ASSERT_EQ(run("setsid " + command +
                ">log 2>&1 & pid=$!; for n in $(seq 600); do ls out/sub-*/*.hexmesh >found 2>found && break; sleep "
                "0.1; done; "
                "kill -9 -$pid; wait $pid; test -n \"$(ls out/sub-*/*.hexmesh)\"")
                .exit_code,
            0);
  const auto before = written();
  EXPECT_FALSE(std::filesystem::exists(folder / "out/summary.json"));
  const CommandResult again = run(command);
  ASSERT_EQ(again.exit_code, 1) << again.errors;
  EXPECT_EQ(summary()[0]["status"], "solved");
  EXPECT_EQ(summary()[1]["status"], "solved");
  // The labels of a lattice that was there, or begun, were finished.
  const auto after = written();
  std::size_t kept = 0;
  for (const auto& [file, time] : before)
    if (const std::size_t end = file.find("_desc-lattice_mesh.hexmesh"); end != std::string::npos) {
      const std::string labels = file.substr(0, end) + "_dseg.nrrd";
      EXPECT_EQ(before.at(labels), after.at(labels)) << labels;
      ++kept;
    }
  EXPECT_GT(kept, 0U);
}

TEST_F(Cohort, OneRunInAFolderAtATime) {
  const CommandResult r =
      run("mkdir out; { exec 9>out/.cohort.lock; flock 9; exec sleep 60; } & holder=$!; sleep 0.5; " + command +
          "; code=$?; kill $holder; exit $code");
  EXPECT_EQ(r.exit_code, 4);
  EXPECT_NE(r.errors.find("another run is at work in"), std::string::npos) << r.errors;
  EXPECT_FALSE(std::filesystem::exists(folder / "out/summary.json"));
}

TEST_F(Cohort, RowsThatCannotBeStopNoOther) {
  write_text(folder / "rows.tsv",
             "participant_id\tsegmentation\tscene\nx_1\tscans/b-2.nrrd\tscene.toml\nx1\tscans/b-2.nrrd\tscene.toml\n"
             "none\t\t\ngone\tscans/gone.nrrd\t\nplain\tscans/b-2.nrrd\tno.toml\n");
  EXPECT_EQ(run(cohort + "rows.tsv -o 'out put[1]' --materials materials.toml").exit_code, 1);
  const json rows = json::parse(read_text(folder / "out put[1]/summary.json"));
  ASSERT_EQ(rows.size(), 5U);
  EXPECT_EQ(rows[0]["status"], "solved") << rows[0]["flags"];
  for (const auto& [row, words] : {std::pair{1, "another case is called 'x1'"}, std::pair{2, "no segmentation"},
                                   std::pair{3, "no such file"}, std::pair{4, "no such file"}}) {
    const json& failed = rows[static_cast<std::size_t>(row)];
    EXPECT_EQ(failed["status"], "failed");
    EXPECT_NE(failed["flags"].get<std::string>().find(words), std::string::npos) << failed["flags"];
  }
}

TEST_F(Cohort, TablesAreChecked) {
  write_text(folder / "empty.tsv", "participant_id\tsegmentation\n");
  EXPECT_NE(run(cohort + "empty.tsv -o out").errors.find("holds no cases"), std::string::npos);
  write_text(folder / "columns.tsv", "participant_id\tfile\n1\tscans/a.seg.nrrd\n");
  EXPECT_NE(run(cohort + "columns.tsv -o out").errors.find("expected participant_id, segmentation"), std::string::npos);
  EXPECT_EQ(run(cohort + "scans -o out --level two").exit_code, 3);
  EXPECT_EQ(run(cohort + "absent -o out").exit_code, 3);
  EXPECT_EQ(run(cohort + "scans --colour -o out").exit_code, 2);
}

}  // namespace test_cohort
