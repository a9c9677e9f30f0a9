// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "cli/csv.h"

namespace test_csv {

using namespace hextools;

TEST(CsvField, IsQuotedOnlyWhereItMustBe) {
  EXPECT_EQ(csv_field("right end"), "right end");
  EXPECT_EQ(csv_field("98,-18,6"), "\"98,-18,6\"");
  EXPECT_EQ(csv_field("say \"a\""), "\"say \"\"a\"\"\"");
}

TEST(CsvField, IsNoFormulaForASpreadsheet) {
  EXPECT_EQ(csv_field("=cmd|' /C calc'!A0"), "\"'=cmd|' /C calc'!A0\"");
  for (const char* text : {"=1+1", "+cmd", "-cmd", "@SUM(A1)", "\t=1", "-1+cmd|x", "-1,2,=3"})
    EXPECT_EQ(csv_field(text), "\"'" + std::string(text) + "\"");
  EXPECT_EQ(csv_quoted("=1"), "\"'=1\"");
  EXPECT_EQ(csv_field("-12.5"), "-12.5") << "a number";
  EXPECT_EQ(csv_field("-12.5,3,+4"), "\"-12.5,3,+4\"") << "a point";
}

}  // namespace test_csv
