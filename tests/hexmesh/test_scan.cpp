// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/LU>

#include "hexmesh/scan/image_io.h"
#include "hexmesh/scan/phantom.h"
#include "support/bodies.h"
#include "support/files.h"

namespace test_scan {

using namespace hexmesh;
using namespace testing_support;

TEST(ImageIo, LabelsNamesAndColoursSurviveANrrd) {
  const TemporaryFolder folder;
  LabelVolume volume = make_volume({5, 4, 3}, {0.8, 0.8, 2.5}, [](const Index3& v) { return v[0] * v[1] % 4; },
                                   Mat3::Identity(), {10, -20, 30});
  volume.segments[1].name = "Vena cava";
  volume.segments[1].color = {0.25, 0.5, 0.75};
  write_labels(volume, folder / "a.nrrd");
  const LabelVolume back = read_labels(folder / "a.nrrd");
  EXPECT_TRUE(same_grid(back.grid, volume.grid));
  EXPECT_EQ(back.labels, volume.labels);
  ASSERT_EQ(back.segments.size(), volume.segments.size());
  EXPECT_EQ(back.segments[1].name, "Vena cava");
  EXPECT_NEAR(back.segments[1].color[2], 0.75, 1e-6);
}

TEST(ImageIo, TheFormatIsToldFromTheContent) {
  const TemporaryFolder folder;
  write_labels(make_volume({2, 2, 2}, {1, 1, 1}, [](const Index3&) { return 1; }), folder / "a.nrrd");
  std::filesystem::rename(folder / "a.nrrd", folder / "without_suffix");
  EXPECT_EQ(read_labels(folder / "without_suffix").labels.size(), 8U);
}

TEST(ImageIo, WhatIsNoImageIsRefusedByName) {
  const TemporaryFolder folder;
  write_text(folder / "a.nrrd", "hello");
  EXPECT_NE(message_of(ErrorKind::input, [&] { read_labels(folder / "a.nrrd"); }).find("unknown format"),
            std::string::npos);
  write_text(folder / "b.nrrd", "NRRD0004\ntype: uint8\ndimension: 3\nsizes: 9 9 9\nencoding: raw\n\nabc");
  EXPECT_NE(message_of(ErrorKind::input, [&] { read_labels(folder / "b.nrrd"); }).find(folder.path("b.nrrd")),
            std::string::npos);
}

TEST(ImageIo, AScanIsNotASegmentation) {
  const TemporaryFolder folder;
  const Phantom phantom = liver_phantom(10);
  write_intensity(phantom.intensity, folder / "ct.nrrd");
  EXPECT_NE(message_of(ErrorKind::input, [&] { read_labels(folder / "ct.nrrd"); }).find("has the label -"),
            std::string::npos);
  EXPECT_EQ(read_intensity(folder / "ct.nrrd").values, phantom.intensity.values);
}

TEST(ImageIo, NiftiPositionsAreTurnedFromRasToLps) {
  const auto data = shared_data() / "data/totalsegmentator/example_seg.nii.gz";
  const auto points = shared_data() / "reference/liver_points.json";
  if (!std::filesystem::exists(data)) GTEST_SKIP() << "no shared data beside the project";
  // A corner node of the liver from the reference set, given in LPS: half of a voxel from a liver voxel's centre.
  const LabelVolume volume = read_labels(data);
  const Vec3 index = volume.grid.continuous_index({56.45633, -222.819, 176.80176});
  int liver = 0;
  for (int a = 0; a < 8; ++a) {
    Index3 v;
    for (int d = 0; d < 3; ++d) {
      EXPECT_NEAR(std::abs(index[d] - std::floor(index[d])), 0.5, 1e-4);
      v[d] = static_cast<int>(std::floor(index[d])) + (a >> d & 1);
    }
    liver += volume.grid.contains(v) && volume.labels[volume.grid.offset(v)] == 5;
  }
  EXPECT_GE(liver, 1);
  EXPECT_LT(liver, 8);
}

TEST(ImageIo, ACutNiftiIsRefusedNotFilledWithZeros) {
  const auto data = shared_data() / "data/totalsegmentator/example_seg.nii.gz";
  if (!std::filesystem::exists(data)) GTEST_SKIP() << "no shared data beside the project";
  const TemporaryFolder folder;
  write_text(folder / "cut.nii.gz", read_text(data).substr(0, 17000));
  EXPECT_NE(message_of(ErrorKind::input, [&] { read_labels(folder / "cut.nii.gz"); }).find("is cut"),
            std::string::npos);
  const std::string whole = shell("gzip -dc '" + data.string() + "'").output;
  write_text(folder / "whole.nii", whole);
  EXPECT_EQ(read_labels(folder / "whole.nii").labels, read_labels(data).labels);
  write_text(folder / "cut.nii", whole.substr(0, 100000));
  EXPECT_NE(message_of(ErrorKind::input, [&] { read_labels(folder / "cut.nii"); })
                .find("is cut: it has 86832 bytes of voxels"),
            std::string::npos);
}

TEST(Phantom, IsTheSameEveryTimeAndAboutTheSizeOfALiver) {
  const Phantom a = liver_phantom(5), b = liver_phantom(5);
  EXPECT_EQ(a.labels.labels, b.labels.labels);
  EXPECT_EQ(a.intensity.values, b.intensity.values);
  Vec3 low = Vec3::Constant(1e9), high = -low;
  for (std::size_t n = 0; n < a.labels.labels.size(); ++n) {
    if (a.labels.labels[n] == 0) continue;
    const Index3 v = a.labels.grid.index(n);
    const Vec3 p = a.labels.grid.position(Vec3(v[0], v[1], v[2]));
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  EXPECT_NEAR((high - low)[0], 200, 10);
  EXPECT_NEAR((high - low)[1], 100, 10);
  EXPECT_NEAR((high - low)[2], 100, 10);
}

TEST(Phantom, VolumesConvergeWithTheSpacing) {
  const auto liver_ml = [](double spacing) {
    const Phantom p = liver_phantom(spacing);
    std::size_t voxels = 0;
    for (const std::size_t n : count_voxels(p.labels)) voxels += n;
    return static_cast<double>(voxels) * spacing * spacing * spacing / 1000;
  };
  EXPECT_NEAR(liver_ml(4), liver_ml(2), 0.01 * liver_ml(2));
  EXPECT_NE(message_of(ErrorKind::usage, [] { liver_phantom(0.1); }).find("0.1 mm"), std::string::npos);
}

}  // namespace test_scan
