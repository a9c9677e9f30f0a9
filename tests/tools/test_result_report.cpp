// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "cli/result_report.h"
#include "hexmesh/core/error.h"

namespace test_result_report {

using namespace hextools;

hexmesh::Result result_with(const std::string& report, const std::string& costs = "") {
  hexmesh::Result r{hexmesh::Grid({1, 1, 1}, {1, 1, 1}), {}, {}};
  r.report = report;
  r.costs = costs;
  return r;
}

std::string refusal(const std::string& report, const std::string& costs = "") {
  try {
    report_of(result_with(report, costs));
  } catch (const hexmesh::Error& e) {
    EXPECT_EQ(e.kind(), hexmesh::ErrorKind::input);
    return e.what();
  }
  return "";
}

TEST(ResultReport, ListsAreThereAndNumbersMayBeNull) {
  for (const char* text : {"", "{}"}) {
    const ResultReport said = report_of(result_with(text));
    EXPECT_TRUE(said.converged());
    for (const char* list : {"conditions", "forces", "contacts", "levels", "effects", "warnings"})
      EXPECT_TRUE(said.report.at(list).empty()) << list;
    EXPECT_TRUE(said.costs.is_object());
  }
  const ResultReport said = report_of(result_with(R"({"converged": false, "load_fraction": null, "reason": "slow"})"));
  EXPECT_FALSE(said.converged());
  EXPECT_EQ(said.load_fraction(), 0);
  EXPECT_EQ(said.reason(), "slow");
}

TEST(ResultReport, KeysOfAnotherTypeAreRefusedByName) {
  EXPECT_EQ(refusal(R"({"converged": "yes"})"), "the result's '/report/converged' is \"yes\", expected true or false");
  EXPECT_EQ(refusal(R"({"dropped_cells": -1})"),
            "the result's '/report/dropped_cells' is -1, expected a whole number >= 0");
  EXPECT_EQ(refusal(R"({"conditions": [{"name": "a"}, {"reaction_n": [1, 2]}]})"),
            "the result's '/report/conditions/1/reaction_n' is [1,2], expected three numbers");
  EXPECT_EQ(refusal(R"({"motion": {"rows": [{"time_s": []}]}})"),
            "the result's '/report/motion/rows/0/time_s' is [], expected a number");
  EXPECT_EQ(refusal("{}", R"({"levels": [1, "a"]})"),
            "the result's '/costs/levels' is [1,\"a\"], expected a list of numbers");
  EXPECT_EQ(refusal("[]"), "the result's '/report' is no object");
  EXPECT_NE(refusal(std::string(300000, '[')).find("deeper than 64 levels"), std::string::npos);
}

TEST(ResultReport, ABalanceHasAllItsPartsOrIsRefused) {
  const ResultReport said = report_of(result_with(R"({"balance": {}})"));
  EXPECT_TRUE(said.report.at("balance").at("acting").empty());
  EXPECT_TRUE(said.report.at("balance").at("sum").is_object());
  EXPECT_TRUE(said.report.at("balance").at("about_mm").is_null());
  EXPECT_NE(refusal(R"({"balance": 3})").find("/balance' is 3"), std::string::npos);
  EXPECT_NE(refusal(R"({"balance": {"acting": 3}})").find("/balance/acting' is 3"), std::string::npos);
  EXPECT_NE(refusal(R"({"balance": {"sum": {"force_n": [1]}}})").find("/balance/sum/force_n'"), std::string::npos);
  EXPECT_NE(refusal(R"({"balance": {"about_mm": "here"}})").find("/balance/about_mm'"), std::string::npos);
}

}  // namespace test_result_report
