// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <cstring>

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

/// A NIfTI file (NIfTI-1, .nii) of bytes, made by hand: rows of its affine in RAS [mm].
std::string nifti_bytes(const Index3& extent, const std::array<std::array<float, 4>, 3>& affine,
                        const std::string& data) {
  std::string head(352, 0);
  const auto put = [&](std::size_t at, auto value) { std::memcpy(head.data() + at, &value, sizeof value); };
  put(0, std::int32_t{348});
  put(40, std::int16_t{3});
  put(70, std::int16_t{2});  // unsigned bytes
  put(72, std::int16_t{8});
  put(76, 1.0F);
  for (std::size_t d = 0; d < 3; ++d) {
    put(42 + 2 * d, static_cast<std::int16_t>(extent[d]));
    put(80 + 4 * d, std::hypot(affine[0][d], affine[1][d], affine[2][d]));
    for (std::size_t c = 0; c < 4; ++c) put(280 + 16 * d + 4 * c, affine[d][c]);
  }
  for (std::size_t d = 3; d < 7; ++d) put(42 + 2 * d, std::int16_t{1});
  put(108, 352.0F);
  put(112, 1.0F);
  head[123] = 2;              // mm
  put(254, std::int16_t{1});  // the affine holds
  std::memcpy(head.data() + 344, "n+1", 4);
  return head + data;
}

TEST(ImageIo, NiftiPositionsAreTurnedFromRasToLps) {
  // Axes to the left, the front and up, voxels of 2 x 3 x 4 mm; one voxel has a label.
  const Index3 extent = {4, 3, 2};
  std::string data(24, 0);
  data[3 + 4 * (1 + 3 * 1)] = 7;  // voxel 3, 1, 1
  const TemporaryFolder folder;
  write_text(folder / "a.nii", nifti_bytes(extent, {{{-2, 0, 0, 10}, {0, 3, 0, 20}, {0, 0, 4, 30}}}, data));
  const LabelVolume volume = read_labels(folder / "a.nii");
  Vec3 found = Vec3::Zero();
  for (std::size_t n = 0; n < volume.labels.size(); ++n)
    if (volume.labels[n] == 7) {
      const Index3 v = volume.grid.index(n);
      found = volume.grid.position(Vec3(v[0], v[1], v[2]));
    }
  // In RAS 10 - 2 * 3, 20 + 3 * 1, 30 + 4 * 1: right and front change their signs.
  EXPECT_LT((found - Vec3(-4, -23, 34)).norm(), 1e-5) << found.transpose();
}

TEST(ImageIo, ACutNiftiIsRefusedNotFilledWithZeros) {
  const TemporaryFolder folder;
  const LabelVolume volume = liver_phantom(4).labels;
  write_labels(volume, folder / "whole.nii.gz");
  const std::string packed = read_text(folder / "whole.nii.gz");
  write_text(folder / "cut.nii.gz", packed.substr(0, packed.size() / 2));
  EXPECT_NE(message_of(ErrorKind::input, [&] { read_labels(folder / "cut.nii.gz"); }).find("is cut"),
            std::string::npos);
  const std::string whole = shell("gzip -dc '" + folder.path("whole.nii.gz") + "'").output;
  write_text(folder / "whole.nii", whole);
  EXPECT_EQ(read_labels(folder / "whole.nii").labels, read_labels(folder / "whole.nii.gz").labels);
  write_text(folder / "cut.nii", whole.substr(0, 100000));
  EXPECT_NE(message_of(ErrorKind::input, [&] { read_labels(folder / "cut.nii"); })
                .find("is cut: it has 99648 bytes of voxels"),
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
