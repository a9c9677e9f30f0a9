// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "hexmesh/core/error.h"
#include "hexmesh/scan/label_table.h"
#include "hexmesh/scan/summary.h"
#include "support/files.h"

namespace test_label_table {

using namespace hexmesh;
using namespace testing_support;

LabelTable table_of(const TemporaryFolder& folder, const std::string& text) {
  write_text(folder / "table", text);
  return read_label_table(folder / "table");
}

TEST(LabelTable, FormatsOfOtherProgramsSayTheSame) {
  const TemporaryFolder folder;
  const LabelTable slicer = table_of(folder, "# Color table file\n0 Background 0 0 0 0\n5 liver 221 130 101 255\n");
  const LabelTable free_surfer =
      table_of(folder, "#No. Label Name:     R   G   B   A\r\n\r\n5   liver    221 130 101 0  # the organ\r\n");
  const LabelTable snap = table_of(folder,
                                   "################\n# ITK-SnAP Label Description File\n"
                                   "    0     0    0    0        0  0  0    \"Clear Label\"\n"
                                   "    5   221  130  101        1  1  1    \"liver\"\n");
  for (const LabelTable& table : {slicer, free_surfer, snap}) {
    ASSERT_EQ(table.size(), 1U);
    EXPECT_EQ(table.at(5).name, "liver");
    EXPECT_NEAR(table.at(5).color[0], 221 / 255.0, 1e-12);
    EXPECT_NEAR(table.at(5).color[2], 101 / 255.0, 1e-12);
  }
  EXPECT_EQ(table_of(folder, "7 left lobe of it 1 2 3 255").at(7).name, "left lobe of it");
  EXPECT_EQ(table_of(folder, "7 1 2 3 1 1 1 \"a # in it\"").at(7).name, "a # in it");
  EXPECT_EQ(table_of(folder,
                     "\xef\xbb\xbf"
                     "7 name#1 1 2 3 255")
                .at(7)
                .name,
            "name#1");
}

TEST(LabelTable, WhatIsNoneIsRefusedWithItsLine) {
  const TemporaryFolder folder;
  for (const char* text : {"5 liver 221 130", "liver 5 221 130 101 255", "5 liver 221 130 301 255", "5 1 2 3 \"liver",
                           "5 liver -1 0 0 255", "1 \"\" 1 1 1 1"}) {
    try {
      table_of(folder, std::string("# first line\n") + text);
      ADD_FAILURE() << text;
    } catch (const Error& e) {
      EXPECT_EQ(e.kind(), ErrorKind::input);
      EXPECT_NE(std::string(e.what()).find("line 2"), std::string::npos) << e.what();
    }
  }
  EXPECT_THROW(table_of(folder, "# nothing\n"), Error);
  EXPECT_THROW(table_of(folder, "7 a 1 1 1 1\n7 b 1 1 1 1\n"), Error) << "twice";
}

TEST(LabelTable, NamesWhatAFileLeavesUnnamedAndTheSummaryTellsItsBox) {
  const TemporaryFolder folder;
  LabelVolume volume{Grid({6, 5, 4}, {1, 2, 3}, {10, 20, 30}), std::vector<std::uint16_t>(120), {{5, "", {}, ""}}};
  for (const Index3& v : {Index3{1, 2, 0}, Index3{3, 2, 1}}) volume.labels[volume.grid.offset(v)] = 5;
  write_labels(volume, folder / "labels.nii.gz");
  ReadOptions options;
  options.names[5] = {"liver", {0.5, 0.25, 1}};
  const std::vector<ScanSummary> summary = summarize({folder / "labels.nii.gz"}, options);
  ASSERT_EQ(summary.size(), 1U);
  ASSERT_EQ(summary[0].segments.size(), 1U);
  const SegmentSummary& liver = summary[0].segments[0];
  EXPECT_EQ(liver.segment.name, "liver");
  EXPECT_EQ(liver.segment.color[2], 1);
  EXPECT_EQ(liver.voxels, 2U);
  ASSERT_TRUE(liver.box);
  EXPECT_LT((liver.box->low - Vec3(10.5, 23, 28.5)).norm(), 1e-4);
  EXPECT_LT((liver.box->high - Vec3(13.5, 25, 34.5)).norm(), 1e-4);
  EXPECT_EQ(read_labels(folder / "labels.nii.gz", options).segments[0].name, "liver");
}

}  // namespace test_label_table
