// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "hexmesh/scan/image_io.h"
#include "hexmesh/scan/summary.h"
#include "support/bodies.h"
#include "support/files.h"
#include "support/scan_files.h"

namespace test_dicom {

using namespace hexmesh;
using namespace testing_support;

LabelVolume body(const Mat3& direction = Mat3::Identity()) {
  return make_volume({9, 8, 7}, {0.75, 0.75, 2.5},
                     [](const Index3& v) { return v[2] == 3  ? 0
                                                  : v[0] > 5 ? 2
                                                             : v[1] > 2; }, direction, {10, -20, 30});
}

void expect_same(const LabelVolume& read, const LabelVolume& expected) {
  EXPECT_TRUE(same_grid(read.grid, expected.grid, 1e-4));
  EXPECT_EQ(read.labels, expected.labels);
}

std::string warning_of(const std::function<void(const ReadOptions&)>& read) {
  std::string out;
  ReadOptions options;
  options.warn = [&](const std::string& w) { out += w + "\n"; };
  read(options);
  return out;
}

void edit_files(const std::filesystem::path& folder, const std::string& change) {
  for (const auto& file : std::filesystem::directory_iterator(folder)) edit_dicom(file.path(), change);
}

TEST(DicomSeries, SlicesAreOrderedByWhereTheyAre) {
  const TemporaryFolder folder;
  for (const Mat3& direction : {Mat3(Mat3::Identity()), random_rotation(7)}) {
    const LabelVolume volume = body(direction);
    std::filesystem::remove_all(folder / "ct");
    write_ct_series(volume, folder / "ct");
    const IntensityVolume read = read_intensity(folder / "ct");
    const LabelVolume expected = reorient_to_lps(volume);
    ASSERT_TRUE(same_grid(read.grid, expected.grid, 1e-4));
    for (std::size_t n = 0; n < expected.labels.size(); ++n) ASSERT_EQ(read.values[n], expected.labels[n] - 1000);
  }
}

TEST(DicomSeries, SeveralSeriesAreListedAndOneIsChosenByItsUid) {
  const TemporaryFolder folder;
  write_ct_series(body(), folder / "all/a", nullptr, "1.2.3.4");
  write_ct_series(body(), folder / "all/b", nullptr, "1.2.3.5");
  const std::string message = message_of(ErrorKind::input, [&] { read_intensity(folder / "all"); });
  for (const char* part : {"2 series", "--series", "1.2.3.4", "1.2.3.5", "7 files"})
    EXPECT_NE(message.find(part), std::string::npos) << message;
  EXPECT_EQ(read_intensity(folder / "all", {.series = "3.5"}).values.size(), 9U * 8 * 7);
  EXPECT_NE(message_of(ErrorKind::input, [&] { read_intensity(folder / "all", {.series = "9"}); }).find("'9'"),
            std::string::npos);
}

TEST(DicomSeries, AGantryTiltIsTakenOut) {
  // A linear field in the patient, seen by slices that shift along y: it must come out linear in the patient.
  const TemporaryFolder folder;
  LabelVolume volume = make_volume({12, 24, 9}, {1, 1, 2.5}, [](const Index3&) { return 0; });
  const double shift = 0.8;  // per slice [mm]
  for (std::size_t n = 0; n < volume.labels.size(); ++n) {
    const Index3 v = volume.grid.index(n);
    const Vec3 p = volume.grid.position(Vec3(v[0], v[1], v[2])) + Vec3(0, shift * v[2], 0);
    volume.labels[n] = static_cast<std::uint16_t>(1000 + 10 * p[1] + 4 * p[2]);  // whole numbers: 10 * 0.8, 4 * 2.5
  }
  write_ct_series(volume, folder / "ct", [&](int k) { return Vec3(0, shift * k, 0); });
  IntensityVolume read{volume.grid, {}};
  const std::string warning = warning_of([&](const ReadOptions& o) { read = read_intensity(folder / "ct", o); });
  EXPECT_NE(warning.find("gantry tilt 17.7 degrees, distances 2.500 to 2.500 mm"), std::string::npos) << warning;
  EXPECT_GT(read.grid.extent()[1], 24);
  int inside = 0;
  for (std::size_t n = 0; n < read.values.size(); ++n) {
    const Index3 v = read.grid.index(n);
    const Vec3 p = read.grid.position(Vec3(v[0], v[1], v[2]));
    const double above = p[1] - shift * p[2] / 2.5;  // within the slices by a voxel
    if (above < 1 || above > 22 || v[2] < 1 || v[2] > 7) continue;
    ++inside;
    ASSERT_NEAR(read.values[n], 10 * p[1] + 4 * p[2], 0.51) << p.transpose();  // values were cut to whole numbers
  }
  EXPECT_GT(inside, 1000);
}

TEST(DicomSeries, UnevenSlicesAreResampledAndGapsRefused) {
  const TemporaryFolder folder;
  LabelVolume volume = make_volume({6, 6, 9}, {1, 1, 2}, [](const Index3& v) { return 1000 + 10 * v[2]; });
  // Positions 0, 2, 4, 7, 9, ...: the value is 10 per slice.
  write_ct_series(volume, folder / "uneven", [](int k) { return Vec3(0, 0, k >= 3 ? 1 : 0); });
  IntensityVolume read{volume.grid, {}};
  const std::string warning = warning_of([&](const ReadOptions& o) { read = read_intensity(folder / "uneven", o); });
  EXPECT_NE(warning.find("distances 2.000 to 3.000 mm"), std::string::npos) << warning;
  EXPECT_EQ(read.grid.extent()[2], 10);
  // At z = 6, two thirds of the way from 4 (value 20) to 7 (value 30).
  EXPECT_NEAR(read.values[read.grid.offset({3, 3, 3})], 20 + 20.0 / 3, 1e-4);
  write_ct_series(volume, folder / "gap", [](int k) { return Vec3(0, 0, k >= 3 ? 20 : 0); });
  EXPECT_NE(message_of(ErrorKind::input, [&] { read_intensity(folder / "gap"); }).find("2.000 to 22.000 mm"),
            std::string::npos);
  write_ct_series(volume, folder / "twice", [](int k) { return Vec3(0, 0, k == 4 ? 2 : 0); });
  EXPECT_NE(message_of(ErrorKind::input, [&] { read_intensity(folder / "twice"); }).find("same place"),
            std::string::npos);
}

TEST(DicomSeries, PixelsThatAreNotPlainGreyValuesAreRefused) {
  const TemporaryFolder folder;
  for (const auto& [change, part] :
       {std::pair{"HighBit=14", "up to bit 14"}, {"ModalityLUTSequence[0].ModalityLUTType=US", "by a table"}}) {
    std::filesystem::remove_all(folder / "ct");
    write_ct_series(body(), folder / "ct");
    edit_files(folder / "ct", change);
    const std::string message = message_of(ErrorKind::input, [&] { read_intensity(folder / "ct"); });
    EXPECT_NE(message.find(part), std::string::npos) << message;
  }
}

TEST(DicomSegmentation, BinaryFractionalAndLabelMapGiveTheSameVoxels) {
  const TemporaryFolder folder;
  for (const Mat3& direction : {Mat3(Mat3::Identity()), random_rotation(7)}) {
    const LabelVolume volume = body(direction);
    for (const SegType type : {SegType::binary, SegType::fractional, SegType::labelmap}) {
      write_dicom_seg(volume, type, folder / "seg.dcm");
      const LabelVolume read = read_labels(folder / "seg.dcm");
      expect_same(read, reorient_to_lps(volume));
      EXPECT_EQ(read.segments[1].name, "segment_2");
      EXPECT_NE(read.segments[0].terminology.find("~SCT^10200001^segment_1~"), std::string::npos);
    }
  }
}

TEST(DicomSegmentation, TheFractionAskedForDecides) {
  const TemporaryFolder folder;
  const LabelVolume volume = make_volume({4, 4, 4}, {1, 1, 1}, [](const Index3& v) { return v[0] < 2; });
  write_dicom_seg(volume, SegType::fractional, folder / "seg.dcm");  // 200 of 250 inside, 50 outside
  EXPECT_EQ(count_voxels(read_labels(folder / "seg.dcm", {.fraction = 0.8}))[0], 32U);
  EXPECT_EQ(count_voxels(read_labels(folder / "seg.dcm", {.fraction = 0.81}))[0], 0U);
  EXPECT_EQ(count_voxels(read_labels(folder / "seg.dcm", {.fraction = 0.2}))[0], 64U);
}

TEST(DicomSegmentation, ItGoesOntoTheGridOfTheScanBesideIt) {
  const TemporaryFolder folder;
  LabelVolume volume = body();
  for (std::size_t n = 0; n < volume.labels.size(); ++n)
    if (volume.grid.index(n)[2] < 2) volume.labels[n] = 0;  // no frames there
  write_ct_series(volume, folder / "all/ct");
  write_dicom_seg(volume, SegType::binary, folder / "all/seg.dcm");
  EXPECT_EQ(read_labels(folder / "all/seg.dcm").grid.extent()[2], 5);
  expect_same(read_labels(folder / "all"), volume);
}

TEST(DicomSegmentation, TheScanOfAnotherFrameOfReferenceIsNotItsScan) {
  const TemporaryFolder folder;
  LabelVolume volume = body();
  for (std::size_t n = 0; n < volume.labels.size(); ++n)
    if (volume.grid.index(n)[2] < 2) volume.labels[n] = 0;
  write_ct_series(volume, folder / "all/ct");
  edit_files(folder / "all/ct", "FrameOfReferenceUID=1.6");
  write_dicom_seg(volume, SegType::binary, folder / "all/seg.dcm");
  for (const auto& [change, slices] : {std::pair{"FrameOfReferenceUID=1.6", 7}, {"FrameOfReferenceUID=1.7", 5}}) {
    edit_dicom(folder / "all/seg.dcm", change);
    EXPECT_EQ(read_labels(folder / "all").grid.extent()[2], slices) << change;
  }
}

TEST(DicomSegmentation, OneOfSeveralIsChosenByItsSeries) {
  const TemporaryFolder folder;
  std::filesystem::create_directories(folder / "all");
  write_dicom_seg(body(), SegType::binary, folder / "all/a.dcm");
  write_dicom_seg(make_volume({4, 4, 4}, {1, 1, 1}, [](const Index3&) { return 1; }), SegType::binary,
                  folder / "all/b.dcm");
  edit_dicom(folder / "all/b.dcm", "SeriesInstanceUID=1.2.9");
  EXPECT_EQ(read_labels(folder / "all", {.series = "2.9"}).labels.size(), 64U);
  const std::string message = message_of(ErrorKind::input, [&] { read_labels(folder / "all", {.series = "8"}); });
  EXPECT_NE(message.find("no series ends in '8', expected one of: 1.2.4 (SEG), 1.2.9 (SEG)"), std::string::npos)
      << message;
}

TEST(DicomSegmentation, NamesAreTurnedIntoUtf8) {
  const TemporaryFolder folder;
  write_dicom_seg(body(), SegType::binary, folder / "seg.dcm");
  for (const auto& [set, name] : {std::pair{"SpecificCharacterSet=ISO_IR 192", "L\xc3\xa4sion"},
                                  {"SpecificCharacterSet=ISO_IR 100", "L\xe4sion"}}) {
    edit_dicom(folder / "seg.dcm", set);
    edit_dicom(folder / "seg.dcm", std::string("SegmentSequence[0].SegmentLabel=") + name);
    EXPECT_EQ(read_labels(folder / "seg.dcm").segments[0].name, "L\xc3\xa4sion") << set;
  }
}

TEST(DicomSegmentation, AScanIsNotTakenForOne) {
  const TemporaryFolder folder;
  write_ct_series(body(), folder / "ct");
  EXPECT_NE(message_of(ErrorKind::input, [&] { read_labels(folder / "ct"); }).find("modality CT"), std::string::npos);
  write_dicom_seg(body(), SegType::binary, folder / "seg.dcm");
  EXPECT_NE(message_of(ErrorKind::input, [&] { read_intensity(folder / "seg.dcm"); }).find("modality SEG"),
            std::string::npos);
}

TEST(DicomContours, AreFilledOnTheScanTheyWereDrawnOn) {
  const TemporaryFolder folder;
  const LabelVolume volume = body(random_rotation(2));
  write_ct_series(volume, folder / "all/ct");
  write_rtstruct(volume.grid, {2, 1, 2}, {6, 4, 5}, folder / "all/rt.dcm");
  const LabelVolume read = read_labels(folder / "all");
  ASSERT_EQ(read.segments.size(), 1U);
  EXPECT_EQ(read.segments[0].name, "GTV");
  EXPECT_NEAR(read.segments[0].color[2], 0.2, 1e-12);
  LabelVolume expected = volume;
  for (std::size_t n = 0; n < expected.labels.size(); ++n) {
    const Index3 v = expected.grid.index(n);
    expected.labels[n] = v[0] >= 2 && v[0] <= 6 && v[1] >= 1 && v[1] <= 4 && v[2] >= 2 && v[2] <= 5;
  }
  expect_same(read, reorient_to_lps(expected));
  edit_dicom(folder / "all/rt.dcm", "ROIContourSequence[0].ContourSequence[*].ContourGeometricType=CLOSEDPLANAR_XOR");
  EXPECT_EQ(read_labels(folder / "all").labels, read.labels);
  edit_files(folder / "all/ct", "FrameOfReferenceUID=1.6");
  edit_dicom(folder / "all/rt.dcm", "ReferencedFrameOfReferenceSequence[0].FrameOfReferenceUID=1.7");
  EXPECT_NE(message_of(ErrorKind::input, [&] { read_labels(folder / "all"); }).find("without the scan"),
            std::string::npos);
  EXPECT_NE(message_of(ErrorKind::input, [&] { read_labels(folder / "all/rt.dcm"); }).find("without the scan"),
            std::string::npos);
}

TEST(DicomSummary, NamesTiltAndDistances) {
  const TemporaryFolder folder;
  write_ct_series(make_volume({6, 6, 9}, {1, 1, 2}, [](const Index3&) { return 1; }), folder / "ct",
                  [](int k) { return Vec3(0, 0.5 * k, k > 4 ? 1 : 0); });
  const ScanSummary summary = summarize({folder / "ct"}).at(0);
  EXPECT_EQ(summary.format, "DICOM CT series");
  std::string facts;
  for (const auto& [key, value] : summary.facts) facts += key + ": " + value + "\n";
  EXPECT_NE(facts.find("slice distance: 2.000 to 3.000 mm"), std::string::npos) << facts;
  EXPECT_NE(facts.find("gantry tilt: 13.2 degrees"), std::string::npos) << facts;
}

}  // namespace test_dicom
