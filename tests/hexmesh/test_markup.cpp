// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "hexmesh/file/markup_file.h"
#include "support/files.h"

namespace test_markup {

using namespace hexmesh;
using namespace testing_support;

TEST(Markup, RasPointsAreTurnedToLps) {
  const TemporaryFolder folder;
  write_text(folder / "a.mrk.json",
             R"({"markups":[{"type":"Fiducial","coordinateSystem":"RAS","controlPoints":[{"position":[1,2,3]}]}]})");
  EXPECT_EQ(read_markup(folder / "a.mrk.json").points.at(0), Vec3(-1, -2, 3));
}

TEST(Markup, AnRoiBecomesABox) {
  const TemporaryFolder folder;
  write_text(folder / "roi.mrk.json",
             R"({"markups":[{"type":"ROI","coordinateSystem":"LPS","center":[10,20,30],"size":[2,4,6],
                 "objectToBase":[0,1,0,-1,0,0,0,0,1]}]})");
  const Box box = *read_markup(folder / "roi.mrk.json").box;
  // The object's x axis, of half length 1, is patient -y.
  EXPECT_LT((box.to_box * (Vec3(10, 19, 30) - box.center) - Vec3(1, 0, 0)).norm(), 1e-12);
}

TEST(Markup, PointsOfElastixAreAllThere) {
  const TemporaryFolder folder;
  const auto points_of = [&](const std::string& text) {
    write_text(folder / "a.txt", text);
    return read_markup(folder / "a.txt").points;
  };
  EXPECT_EQ(points_of("point\n2\n1 2 3\n-4.5 5 6e1\n"), (std::vector{Vec3(1, 2, 3), Vec3(-4.5, 5, 60)}));
  for (const char* bad : {"index\n1\n1 2 3\n", "point\n2\n1 2 3\n", "point\n1\n1 2 3\n4 5 6\n", "point\n0\n", "",
                          "point\n-1\n1 2 3\n", "point\n1\n1 2 nan\n", "point\n1\n1 2 1e20\n"})
    EXPECT_NE(message_of(ErrorKind::input, [&] { points_of(bad); }).find("a.txt"), std::string::npos) << bad;
}

TEST(Markup, WhatIsNoMarkupIsNamed) {
  const TemporaryFolder folder;
  write_text(folder / "a.mrk.json", "{\"markups\":[]}");
  EXPECT_NE(message_of(ErrorKind::input, [&] { read_markup(folder / "a.mrk.json"); }).find(folder.path("a.mrk.json")),
            std::string::npos);
  EXPECT_NE(message_of(ErrorKind::input, [&] { read_markup(folder / "none.mrk.json"); }).find("none.mrk.json"),
            std::string::npos);
}

TEST(Markup, AnRoiMayBeTurned) {
  const TemporaryFolder folder;
  write_text(folder / "roi.mrk.json",
             R"({"markups":[{"type":"ROI","coordinateSystem":"LPS","center":[10,20,30],"size":[20,120,60],
                 "orientation":[0,-1,0,1,0,0,0,0,1]}]})");
  const Box box = *read_markup(folder / "roi.mrk.json").box;  // its x axis is patient y
  EXPECT_TRUE(box.contains({69, 20, 30}));
  EXPECT_FALSE(box.contains({10, 31, 30}));
  write_text(
      folder / "bad.mrk.json",
      R"({"markups":[{"type":"ROI","center":[10,20,30],"size":[20,120,60],"orientation":[2,0,0,0,1,0,0,0,1]}]})");
  EXPECT_NE(message_of(ErrorKind::input, [&] { read_markup(folder / "bad.mrk.json"); }).find("no rotation"),
            std::string::npos);
}

TEST(Markup, OldFiducialListsAreRasUnlessTheySayOtherwise) {
  const TemporaryFolder folder;
  write_text(folder / "a.fcsv",
             "# Markups fiducial file version = 4.4\n# columns = id,x,y,z,ow\nF_0,1,2.5,-3,0\nF_1,4,5,6,0\n");
  const Markup ras = read_markup(folder / "a.fcsv");
  ASSERT_EQ(ras.points.size(), 2U);
  EXPECT_EQ(ras.points[0], Vec3(-1, -2.5, -3));
  write_text(folder / "b.fcsv", "# CoordinateSystem = LPS\nF_0,1,2.5,-3,0\n");
  EXPECT_EQ(read_markup(folder / "b.fcsv").points.at(0), Vec3(1, 2.5, -3));
  write_text(folder / "c.fcsv", "F_0,1,two,-3,0\n");
  EXPECT_NE(message_of(ErrorKind::input, [&] { read_markup(folder / "c.fcsv"); }).find("F_0,1,two"), std::string::npos);
}

TEST(Markup, AMarginEnlargesABoxOnEverySide) {
  const Box box = enlarged(box_between({0, 0, 0}, {10, 20, 30}), 5);
  EXPECT_TRUE(box.contains({-5, -5, -5}));
  EXPECT_TRUE(box.contains({15, 25, 35}));
  EXPECT_FALSE(box.contains({15.1, 10, 10}));
  EXPECT_FALSE(box.contains({5, 10, -5.1}));
}

TEST(Markup, WhatIsDeepHugeOrFarAwayIsRefused) {
  const TemporaryFolder folder;
  const auto refused = [&](const std::string& text) {
    write_text(folder / "a.mrk.json", text);
    const std::string message = message_of(ErrorKind::input, [&] { read_markup(folder / "a.mrk.json"); });
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
    return message;
  };
  const std::string deep(300000, '[');
  EXPECT_NE(refused(deep).find("deeper than 64 levels"), std::string::npos);
  EXPECT_NE(refused(R"({"markups":[{"type":"Line","x":)" + deep + std::string(300000, ']') + "}]}").find("deeper"),
            std::string::npos);
  std::string many = "[";
  for (int n = 0; n < 3000000; ++n) many += "0,";
  EXPECT_NE(refused(many + "0]").find("more than 2097152 values"), std::string::npos);
  EXPECT_NE(
      refused(R"({"markups":[{"type":"Line","controlPoints":[{"position":[1,1e300,2]}]}]})").find("(1, 1e+300, 2)"),
      std::string::npos);
  EXPECT_NE(refused(R"({"markups":[{"type":"ROI","center":[1,2,3],"size":[1e-300,1,1]}]})").find("positive size"),
            std::string::npos);
  EXPECT_EQ(message_of(ErrorKind::input, [] { read_markup("/dev/zero"); }), "'/dev/zero' is no file, expected one");
}

}  // namespace test_markup
