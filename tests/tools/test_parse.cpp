// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <cstdint>

#include "cli/parse.h"
#include "hexmesh/core/error.h"

namespace test_parse {

using namespace hextools;

TEST(Split, GivesOnePartMoreThanSeparators) {
  EXPECT_EQ(split("a,b", ','), (std::vector<std::string>{"a", "b"}));
  EXPECT_EQ(split("0.8/0.3/0.2", '/'), (std::vector<std::string>{"0.8", "0.3", "0.2"}));
  EXPECT_EQ(split("", ','), std::vector<std::string>{""});
  EXPECT_EQ(split(",a,", ','), (std::vector<std::string>{"", "a", ""}));
}

TEST(SplitList, LeavesOutWhatFollowsTheLastSeparator) {
  EXPECT_EQ(split_list("a,b,", ','), (std::vector<std::string>{"a", "b"}));
  EXPECT_EQ(split_list("a,,", ','), (std::vector<std::string>{"a", ""}));
  EXPECT_TRUE(split_list("", ',').empty());
}

TEST(ParseNumber, TakesTheWholeText) {
  EXPECT_EQ(parse_number<double>("-1.5e-3"), -1.5e-3);
  EXPECT_EQ(parse_number<double>("+2"), 2.0);
  EXPECT_EQ(parse_number<double>(" 3\t"), 3.0);
  EXPECT_EQ(parse_number<double>("0.1"), 0.1);
  EXPECT_EQ(parse_number<std::size_t>("500"), 500U);
  for (const char* text : {"", " ", "+", "-", "+-1", "++1", "1 2", "1,", "3mm", "five", "1e999", "0x10"})
    EXPECT_FALSE(parse_number<double>(text)) << "'" << text << "'";
  for (const char* text : {"-1", "1.5", "1e3", "99999999999999999999"})
    EXPECT_FALSE(parse_number<std::uint64_t>(text)) << "'" << text << "'";
}

TEST(ParseNumbers, TakesAsManyFiniteOnesAsAsked) {
  EXPECT_EQ(parse_numbers<3>("1,-2,3e1"), (std::array{1.0, -2.0, 30.0}));
  EXPECT_EQ(parse_numbers<3>("1, +2, 3"), (std::array{1.0, 2.0, 3.0}));
  for (const char* text : {"", "1,2", "1,2,3,4", "1,2,", "1,2,3,", "1;2;3", "1,2,inf", "1,nan,3", "1,2,x"})
    EXPECT_FALSE(parse_numbers<3>(text)) << "'" << text << "'";
}

TEST(KeyAndValue, SplitsAtTheFirstEqualsSign) {
  using Pair = std::pair<std::string, std::string>;
  EXPECT_EQ(key_and_value("young_kpa=3"), Pair("young_kpa", "3"));
  EXPECT_EQ(key_and_value("a=b=c"), Pair("a", "b=c"));
  EXPECT_EQ(key_and_value("a="), Pair("a", ""));
  EXPECT_EQ(key_and_value("a"), Pair("a", ""));
  EXPECT_EQ(key_and_value(""), Pair("", ""));
}

TEST(ParsePair, NamesTheOptionTheTextAndWhatWasExpected) {
  EXPECT_EQ(parse_pair("--input", "liver=a.stl", "NAME=FILE").second, "a.stl");
  for (const std::string text : {"", "=", "liver", "liver=", "=a.stl"}) {
    try {
      parse_pair("--input", text, "NAME=FILE");
      ADD_FAILURE() << "'" << text << "'";
    } catch (const hexmesh::Error& e) {
      EXPECT_EQ(e.kind(), hexmesh::ErrorKind::usage);
      EXPECT_EQ(e.what(), "--input '" + text + "', expected NAME=FILE");
    }
  }
}

}  // namespace test_parse
