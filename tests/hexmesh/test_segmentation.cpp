// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cstring>

#include "hexmesh/scan/image_io.h"
#include "hexmesh/scan/summary.h"
#include "hexmesh/volume/region.h"
#include "support/bodies.h"
#include "support/files.h"
#include "support/scan_files.h"

namespace test_segmentation {

using namespace hexmesh;
using namespace testing_support;

LabelVolume blob() {
  return make_volume({4, 5, 6}, {1, 2, 3}, [](const Index3& v) { return (v[0] + 2 * v[1] + 5 * v[2]) % 3; });
}

/// Two blocks that share voxels; the second is named last.
Segmentation overlapping() {
  Segmentation out{Grid({4, 4, 4}, {1, 1, 1}), {}, {}};
  std::vector<std::size_t> low, left;
  for (std::size_t n = 0; n < 64; ++n) {
    if (out.grid.index(n)[2] < 2) low.push_back(n);
    if (out.grid.index(n)[0] < 2) left.push_back(n);
  }
  add_segment(out, {1, "low"}, low);
  add_segment(out, {2, "left"}, left);
  return out;
}

std::vector<std::string> warnings_of(const std::function<void(const ReadOptions&)>& read) {
  std::vector<std::string> out;
  ReadOptions options;
  options.warn = [&](const std::string& w) { out.push_back(w); };
  read(options);
  return out;
}

TEST(Segmentation, SelectsByLabelNameAndTerminologyCodeAndRenames) {
  Segmentation s = to_segmentation(blob());
  s.segments[1].segment.name = "Vena cava";
  s.segments[1].segment.terminology = "list~SCT^123037004^Anatomical Structure~SCT^64131007^IVC~^^~~^^~^^";
  const std::size_t voxels = count_voxels(s)[1];
  for (const char* what : {"2", "vena CAVA", "SCT:64131007"}) {
    const Segmentation kept = select_segments(s, {{what, "vein"}});
    ASSERT_EQ(kept.segments.size(), 1U) << what;
    EXPECT_EQ(kept.segments[0].segment.name, "vein");
    EXPECT_EQ(count_voxels(kept)[0], voxels);
  }
  EXPECT_EQ(message_of(ErrorKind::input,
                       [&] {
                         select_segments(s, {{"spleen", ""}});
                       }),
            "unknown segment 'spleen', expected one of: 1=segment_1, 2=Vena cava");
  EXPECT_NE(message_of(ErrorKind::usage,
                       [&] {
                         select_segments(s, {{"2", ""}, {"vena cava", ""}});
                       })
                .find("twice"),
            std::string::npos);
}

TEST(Segmentation, SegmentsThatOverlapKeepTheirVoxels) {
  const Segmentation s = overlapping();
  EXPECT_EQ(s.layers.size(), 2U);
  EXPECT_EQ(count_voxels(s), (std::vector<std::size_t>{32, 32}));
}

TEST(Segmentation, TheLaterOneWinsUnlessPrioritySaysOtherwise) {
  std::vector<Overlap> overlaps;
  EXPECT_EQ(count_voxels(flatten(overlapping(), {}, overlaps)), (std::vector<std::size_t>{16, 32}));
  ASSERT_EQ(overlaps.size(), 1U);
  EXPECT_EQ(overlaps[0].winner, "left");
  EXPECT_EQ(overlaps[0].loser, "low");
  EXPECT_EQ(overlaps[0].voxels, 16U);
  EXPECT_EQ(count_voxels(flatten(overlapping(), {"low"}, overlaps)), (std::vector<std::size_t>{32, 16}));
  EXPECT_EQ(count_voxels(flatten(overlapping(), {"left", "low"}, overlaps)), (std::vector<std::size_t>{16, 32}));
  EXPECT_NE(message_of(ErrorKind::input, [&] { flatten(overlapping(), {"spleen"}, overlaps); }).find("'spleen'"),
            std::string::npos);
}

TEST(Segmentation, CombiningRenumbersTakenLabelsAndJoinsSegmentsOfOneName) {
  Segmentation liver = to_segmentation(make_volume({4, 4, 4}, {1, 1, 1}, [](const Index3& v) { return v[0] < 2; }));
  Segmentation tumour = to_segmentation(make_volume({4, 4, 4}, {1, 1, 1}, [](const Index3& v) { return v[0] == 3; }));
  liver.segments[0].segment.name = "liver";
  tumour.segments[0].segment.name = "tumour";
  std::vector<Overlap> overlaps;
  const LabelVolume two = flatten(combine(liver, tumour), {}, overlaps);
  ASSERT_EQ(two.segments.size(), 2U);
  EXPECT_EQ(two.segments[1].label, 2);
  EXPECT_EQ(count_voxels(two), (std::vector<std::size_t>{32, 16}));
  tumour.segments[0].segment.name = "Liver";
  EXPECT_EQ(count_voxels(flatten(combine(liver, tumour), {}, overlaps)), (std::vector<std::size_t>{48}));
}

TEST(Segmentation, SegmentsOfOneNameInOneFileStayApart) {
  Segmentation two = to_segmentation(blob());
  two.segments[0].segment.name = two.segments[1].segment.name = "Lesion";
  EXPECT_EQ(join({two}, {}, [](const std::string& w) { ADD_FAILURE() << w; }).segments.size(), 2U);
  std::vector<Overlap> overlaps;
  EXPECT_EQ(flatten(join({two}, {}, [](const std::string&) {}), {}, overlaps).segments.size(), 2U);
}

TEST(Segmentation, JoiningSaysWhatItTakesTogetherAndWhatDoesNotCoincide) {
  const Segmentation a = to_segmentation(make_volume({4, 4, 4}, {1, 1, 1}, [](const Index3&) { return 1; }));
  const Segmentation b = to_segmentation(
      make_volume({4, 4, 4}, {1, 1, 1}, [](const Index3&) { return 1; }, Mat3::Identity(), {0.5, 0, 6}));
  std::string said;
  const Segmentation joined = join({a, b}, {}, [&](const std::string& w) { said += w + "\n"; });
  EXPECT_NE(said.find("'segment_1' is in several inputs"), std::string::npos) << said;
  EXPECT_NE(said.find("nearest voxel"), std::string::npos) << said;
  EXPECT_EQ(joined.grid.spacing(), a.grid.spacing());
  EXPECT_EQ(count_voxels(joined)[0], 64U);
}

TEST(Segmentation, GridsThatContinueEachOtherJoinWithoutResampling) {
  const Mat3 direction = random_rotation(3);
  const Grid base({4, 5, 6}, {0.8, 0.8, 2.5}, {1, 2, 3}, direction);
  const Grid other({3, 3, 3}, {0.8, 0.8, 2.5}, base.position(Vec3(-2, 3, 5)), direction);
  EXPECT_TRUE(same_lattice_of_voxels(base, other));
  const Grid both = extend_over(base, other);
  EXPECT_EQ(both.extent(), (Index3{6, 6, 8}));
  EXPECT_LT((both.position(Vec3(2, 0, 0)) - base.origin()).norm(), 1e-9);
  Segmentation s{other, {std::vector<std::uint16_t>(27, 1)}, {{{1, "a"}, 0, 1}}};
  EXPECT_EQ(count_voxels(place_on(s, both)), (std::vector<std::size_t>{27}));
  EXPECT_FALSE(
      same_lattice_of_voxels(base, Grid({3, 3, 3}, {0.8, 0.8, 2.5}, base.position(Vec3(0.5, 0, 0)), direction)));
}

TEST(Segmentation, GreyValuesArePlacedOnAnotherGridByTheirPosition) {
  // A linear field is reproduced between voxel centres.
  const Grid from({9, 9, 9}, {1, 1, 1}, {-4, -4, -4}), to({5, 5, 5}, {0.7, 0.7, 0.7}, {-1.3, -1.4, -1.5});
  IntensityVolume field{from, {}};
  const auto value = [](const Vec3& p) { return 3 * p[0] - 2 * p[1] + p[2]; };
  for (std::size_t n = 0; n < from.num_voxels(); ++n) {
    const Index3 v = from.index(n);
    field.values.push_back(static_cast<float>(value(from.position(Vec3(v[0], v[1], v[2])))));
  }
  const IntensityVolume placed = place_on(field, to);
  for (std::size_t n = 0; n < to.num_voxels(); ++n) {
    const Index3 v = to.index(n);
    EXPECT_NEAR(placed.values[n], value(to.position(Vec3(v[0], v[1], v[2]))), 1e-5);
  }
}

TEST(Region, AZoneOfInterestCutsTheGridAndWhatLiesOutside) {
  const LabelVolume all = make_volume({10, 10, 10}, {1, 1, 2}, [](const Index3&) { return 1; });
  const LabelVolume cut = crop_to_box(all, box_between({1.5, 2.5, 3}, {5.5, 7.5, 9}));
  EXPECT_EQ(cut.grid.extent(), (Index3{4, 5, 3}));
  EXPECT_EQ(cut.grid.position(Vec3::Zero()), Vec3(2, 3, 4));
  // A turned box: voxels of the grid beside it become background.
  Box turned = box_between({-3, -3, -3}, {3, 3, 3});
  turned.center = {5, 5, 10};
  const double s = std::sqrt(0.5);
  Mat3 eighth;
  eighth << s, -s, 0, s, s, 0, 0, 0, 1;
  turned.to_box = turned.to_box * eighth;
  const LabelVolume lozenge = crop_to_box(all, turned);
  for (std::size_t n = 0; n < lozenge.labels.size(); ++n) {
    const Index3 v = lozenge.grid.index(n);
    EXPECT_EQ(lozenge.labels[n] != 0, turned.contains(lozenge.grid.position(Vec3(v[0], v[1], v[2]))));
  }
  EXPECT_NE(message_of(ErrorKind::geometry,
                       [&] {
                         crop_to_box(all, box_between({50, 0, 0}, {60, 1, 1}));
                       })
                .find("(55.0, 0.5, 0.5)"),
            std::string::npos);
}

TEST(Region, AMarginIsKeptAroundTheSegments) {
  const LabelVolume dot =
      make_volume({20, 20, 20}, {1, 1, 2}, [](const Index3& v) { return v[0] == 9 && v[1] == 9 && v[2] == 1; });
  const LabelVolume cut = crop_to_segments(dot, 3);
  EXPECT_EQ(cut.grid.extent(), (Index3{7, 7, 4}));  // 3 voxels beside it; 2 above it, but only 1 below
  EXPECT_EQ(count_voxels(cut), (std::vector<std::size_t>{1}));
}

TEST(Formats, NrrdNiftiMetaImageAndVtiGiveTheSameVolume) {
  const TemporaryFolder folder;
  const LabelVolume volume = make_volume({5, 4, 3}, {0.8, 0.7, 2.5}, [](const Index3& v) { return v[0] * v[1] % 4; },
                                         random_rotation(4), {10, -20, 30});
  const LabelVolume expected = reorient_to_lps(volume);
  write_text(folder / "a.nrrd", nrrd_bytes(volume));
  write_text(folder / "b.nrrd", nrrd_bytes(volume, "right-anterior-superior"));
  write_text(folder / "c.nii", nifti_bytes(volume));
  write_text(folder / "d.mha", meta_bytes(volume));
  write_text(folder / "e.vti", vti_bytes(volume));
  for (const char* name : {"a.nrrd", "b.nrrd", "c.nii", "d.mha", "e.vti"}) {
    const LabelVolume read = read_labels(folder / name);
    EXPECT_TRUE(same_grid(read.grid, expected.grid)) << name;
    EXPECT_EQ(read.labels, expected.labels) << name;
    EXPECT_TRUE(same_grid(read_intensity(folder / name).grid, expected.grid)) << name;
  }
}

TEST(Formats, All48OrientationsInLpsAndInRasGiveTheSameVolume) {
  const TemporaryFolder folder;
  const LabelVolume volume = blob();
  std::array<int, 3> order = {0, 1, 2};
  do {
    for (int flips = 0; flips < 8; ++flips) {
      const LabelVolume stored = stored_as(volume, order, flips);
      for (const char* space : {"left-posterior-superior", "right-anterior-superior", "LPS", "RAS"}) {
        write_text(folder / "a.nrrd", nrrd_bytes(stored, space));
        const LabelVolume read = read_labels(folder / "a.nrrd");
        ASSERT_TRUE(same_grid(read.grid, volume.grid)) << space;
        ASSERT_EQ(read.labels, volume.labels) << space;
      }
      write_text(folder / "a.nii", nifti_bytes(stored));
      const LabelVolume read = read_labels(folder / "a.nii");
      ASSERT_TRUE(same_grid(read.grid, volume.grid));
      ASSERT_EQ(read.labels, volume.labels);
    }
  } while (std::next_permutation(order.begin(), order.end()));
}

TEST(Formats, NiftiTakesTheSformThenTheQformThenTheVoxelSizes) {
  const TemporaryFolder folder;
  const LabelVolume volume =
      make_volume({3, 4, 5}, {1, 2, 3}, [](const Index3& v) { return v[0]; }, Mat3::Identity(), {7, 8, 9});
  std::string bytes = nifti_bytes(volume);
  const auto set = [&](std::size_t offset, auto value) { std::memcpy(bytes.data() + offset, &value, sizeof value); };
  set(252, std::int16_t{1});  // a qform elsewhere: a half turn about z, so that its voxels lie as the sform's do in LPS
  set(264, 1.0F);
  set(268, -107.0F);
  set(272, -8.0F);
  set(276, 9.0F);
  write_text(folder / "a.nii", bytes);
  std::vector<std::string> warnings = warnings_of(
      [&](const ReadOptions& o) { EXPECT_EQ(read_labels(folder / "a.nii", o).grid.origin(), Vec3(7, 8, 9)); });
  ASSERT_EQ(warnings.size(), 1U);
  EXPECT_NE(warnings[0].find("up to 100 mm apart, the sform is used"), std::string::npos) << warnings[0];
  set(254, std::int16_t{0});
  write_text(folder / "a.nii", bytes);
  EXPECT_EQ(read_labels(folder / "a.nii").grid.origin(), Vec3(107, 8, 9));
  set(252, std::int16_t{0});
  write_text(folder / "a.nii", bytes);
  warnings = warnings_of(
      [&](const ReadOptions& o) { EXPECT_EQ(read_labels(folder / "a.nii", o).grid.spacing(), Vec3(1, 2, 3)); });
  ASSERT_EQ(warnings.size(), 1U);
  EXPECT_NE(warnings[0].find("neither sform nor qform"), std::string::npos);
}

TEST(Formats, NiftiInMetresAndOfEitherByteOrderIsRead) {
  const TemporaryFolder folder;
  const LabelVolume volume = make_volume({3, 4, 5}, {1, 2, 3}, [](const Index3& v) { return v[0] + v[2]; });
  LabelVolume metres = volume;
  metres.grid = Grid(volume.grid.extent(), volume.grid.spacing() / 1000, Vec3::Zero());
  std::string bytes = nifti_bytes(metres);
  bytes[123] = 1;
  write_text(folder / "a.nii", bytes);
  EXPECT_TRUE(same_grid(read_labels(folder / "a.nii").grid, reorient_to_lps(volume).grid));
  // Other byte order: each number of the header and the voxels reversed.
  bytes = nifti_bytes(volume);
  const auto reverse = [&](std::size_t from, std::size_t to, std::size_t size) {
    for (std::size_t at = from; at < to; at += size)
      std::reverse(bytes.begin() + static_cast<std::ptrdiff_t>(at),
                   bytes.begin() + static_cast<std::ptrdiff_t>(at + size));
  };
  reverse(0, 4, 4);
  reverse(40, 56, 2);
  reverse(70, 74, 2);
  reverse(76, 120, 4);
  reverse(252, 256, 2);
  reverse(256, 328, 4);
  reverse(352, bytes.size(), 2);
  write_text(folder / "b.nii", bytes);
  EXPECT_EQ(read_labels(folder / "b.nii").labels, reorient_to_lps(volume).labels);
}

TEST(Formats, NiftiValuesAreRescaled) {
  const TemporaryFolder folder;
  const LabelVolume volume = make_volume({3, 4, 5}, {1, 2, 3}, [](const Index3& v) { return v[0]; });
  std::string bytes = nifti_bytes(volume);
  const float slope = 2, intercept = -1000;
  std::memcpy(bytes.data() + 112, &slope, 4);
  std::memcpy(bytes.data() + 116, &intercept, 4);
  write_text(folder / "a.nii", bytes);
  const IntensityVolume read = read_intensity(folder / "a.nii");
  const LabelVolume expected = reorient_to_lps(volume);
  for (std::size_t n = 0; n < expected.labels.size(); ++n) ASSERT_EQ(read.values[n], 2 * expected.labels[n] - 1000);
}

TEST(Formats, LengthsAndSpacesThatAreNotOursAreRefused) {
  const TemporaryFolder folder;
  std::string bytes = nrrd_bytes(blob());
  write_text(folder / "um.nrrd", std::string(bytes).insert(bytes.find("kinds"), "space units: \"um\" \"um\" \"um\"\n"));
  EXPECT_NE(message_of(ErrorKind::input, [&] { read_labels(folder / "um.nrrd"); }).find("'um'"), std::string::npos);
  write_text(folder / "left.nrrd", nrrd_bytes(blob(), "3D-left-handed"));
  EXPECT_NE(message_of(ErrorKind::input, [&] { read_labels(folder / "left.nrrd"); }).find("left-handed"),
            std::string::npos);
  // What no piece covers would be whatever the memory held.
  std::string vti = vti_bytes(blob());
  const std::size_t piece = vti.find("Piece Extent=\"0 3 0 4 0 5");
  ASSERT_NE(piece, std::string::npos);
  vti.replace(piece, 24, "Piece Extent=\"0 3 0 4 0 2");
  write_text(folder / "part.vti", vti);
  EXPECT_NE(message_of(ErrorKind::input, [&] { read_labels(folder / "part.vti"); }).find("expected the whole"),
            std::string::npos);
}

TEST(Formats, NiftisQuaternionIsARotation) {
  const TemporaryFolder folder;
  const Eigen::Quaterniond q(0.8, 0.3, -0.4, std::sqrt(1 - 0.64 - 0.09 - 0.16));
  Mat3 ras = q.toRotationMatrix();
  ras.col(2) *= -1;  // qfac = -1
  const Mat3 lps = Vec3(-1, -1, 1).asDiagonal() * ras;
  const LabelVolume volume =
      make_volume({3, 4, 5}, {1, 2, 3}, [](const Index3& v) { return v[0] + v[2]; }, lps, {7, 8, 9});
  std::string bytes = nifti_bytes(volume);
  const auto set = [&](std::size_t offset, auto value) { std::memcpy(bytes.data() + offset, &value, sizeof value); };
  set(252, std::int16_t{1});
  set(254, std::int16_t{0});
  set(76, -1.0F);
  for (const auto& [offset, value] :
       {std::pair{256, q.x()}, {260, q.y()}, {264, q.z()}, {268, -7.0}, {272, -8.0}, {276, 9.0}})
    set(static_cast<std::size_t>(offset), static_cast<float>(value));
  write_text(folder / "a.nii", bytes);
  const LabelVolume read = read_labels(folder / "a.nii"), expected = reorient_to_lps(volume);
  EXPECT_TRUE(same_grid(read.grid, expected.grid));
  EXPECT_EQ(read.labels, expected.labels);
}

TEST(Formats, DetachedDataStaysInsideTheHeadersFolder) {
  const TemporaryFolder folder;
  std::filesystem::create_directory(folder / "inner");
  const std::string header = "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 2 2 2\nencoding: raw\ndata file: ";
  write_text(folder / "secret.raw", std::string(8, '\1'));
  write_text(folder / "inner/data.raw", std::string(8, '\1'));
  write_text(folder / "inner/good.nhdr", header + "data.raw\n");
  EXPECT_EQ(read_labels(folder / "inner/good.nhdr").labels, std::vector<std::uint16_t>(8, 1));
  for (const char* name : {"../secret.raw", "/etc/hostname", "%03d.raw 1 2 1", "LIST"}) {
    write_text(folder / "inner/bad.nhdr", header + name + "\n");
    EXPECT_NE(message_of(ErrorKind::input, [&] { read_labels(folder / "inner/bad.nhdr"); }).find(name),
              std::string::npos);
  }
}

TEST(Formats, MoreThanTheMemoryAllowedIsRefused) {
  const TemporaryFolder folder;
  write_text(folder / "a.nrrd", nrrd_bytes(blob()));
  EXPECT_NE(
      message_of(ErrorKind::input, [&] { read_labels(folder / "a.nrrd", {.max_memory = 100}); }).find("--max-memory"),
      std::string::npos);
}

TEST(Formats, AnAtlasOfManyLabelsIsNoGreyScan) {
  // 343 labels up to 4100 in blocks of 6 voxels, and as many values that differ from voxel to voxel.
  const auto block = [](const Index3& v) { return v[0] / 6 + 7 * (v[1] / 6) + 49 * (v[2] / 6); };
  const TemporaryFolder folder;
  write_text(folder / "atlas.nrrd",
             nrrd_bytes(make_volume({42, 42, 42}, {1, 1, 1}, [&](const Index3& v) { return 12 * block(v) + 1; })));
  write_text(folder / "grey.nrrd", nrrd_bytes(make_volume({42, 42, 42}, {1, 1, 1}, [&](const Index3& v) {
               return 12 * ((v[0] * 7919 + v[1] * 104729 + v[2] * 1299709) % 343) + 1;
             })));
  EXPECT_EQ(summarize({folder / "atlas.nrrd"})[0].segments.size(), 343U);
  EXPECT_EQ(summarize({folder / "grey.nrrd"})[0].segments.size(), 0U);
  // A scan with a wide rim of one value, as padding or air is.
  write_text(folder / "padded.nrrd", nrrd_bytes(make_volume({42, 42, 42}, {1, 1, 1}, [](const Index3& v) {
               const bool is_inside = std::min({v[0], v[1], v[2]}) > 14 && std::max({v[0], v[1], v[2]}) < 28;
               return is_inside ? 900 + (v[0] * 7919 + v[1] * 104729 + v[2] * 1299709) % 400 : 24;
             })));
  EXPECT_EQ(summarize({folder / "padded.nrrd"})[0].segments.size(), 0U);
}

TEST(Formats, SlicersOneVoxelImageIsAnEmptySegmentation) {
  const TemporaryFolder folder;
  write_text(
      folder / "a.seg.nrrd",
      "NRRD0004\ntype: uint8\ndimension: 3\nspace: left-posterior-superior\nsizes: 1 1 1\nspace directions: (1,0,0) "
      "(0,1,0) (0,0,1)\nencoding: raw\nspace origin: (0,0,0)\nSegment0_ID:=Segment_1\nSegment0_Name:=liver\n\n" +
          std::string(1, '\0'));
  EXPECT_NE(message_of(ErrorKind::input, [&] { read_labels(folder / "a.seg.nrrd"); }).find("without content"),
            std::string::npos);
}

TEST(Formats, TerminologySurvivesANrrd) {
  const TemporaryFolder folder;
  LabelVolume volume = blob();
  volume.segments[0].terminology = "list~SCT^123037004^Anatomical Structure~SCT^10200004^Liver~^^~list~^^~^^";
  write_labels(volume, folder / "a.nrrd");
  EXPECT_EQ(read_labels(folder / "a.nrrd").segments[0].terminology, volume.segments[0].terminology);
  EXPECT_EQ(select_segments(read_segmentation({folder / "a.nrrd"}), {{"SCT:10200004", "liver"}}).segments.size(), 1U);
}

TEST(Summary, TellsLabelsFromGreyValues) {
  const TemporaryFolder folder;
  const LabelVolume labels = make_volume({12, 12, 12}, {1, 1, 1}, [](const Index3& v) { return v[0] < 6 ? 1 : 2; });
  LabelVolume noise = make_volume({12, 12, 12}, {1, 1, 1},
                                  [](const Index3& v) { return 1 + (37 * v[0] + 11 * v[1] + 5 * v[2]) % 101; });
  write_text(folder / "labels.nrrd", nrrd_bytes(labels));
  write_text(folder / "noise.nrrd", nrrd_bytes(noise));
  const ScanSummary a = summarize({folder / "labels.nrrd"})[0], b = summarize({folder / "noise.nrrd"})[0];
  EXPECT_EQ(a.segments.size(), 2U);
  EXPECT_FALSE(a.range.has_value());
  EXPECT_TRUE(b.segments.empty());
  EXPECT_EQ(b.range->second, 101);
}

TEST(Summary, AxesAreNamedByWhereTheyPoint) {
  Mat3 d;
  d << 0, -1, 0, -1, 0, 0, 0, 0, 1;
  EXPECT_EQ(axis_letters(Grid({2, 2, 2}, {1, 1, 1}, Vec3::Zero(), d)), "ARS");
  EXPECT_EQ(axis_letters(Grid({2, 2, 2}, {1, 1, 1})), "LPS");
}

}  // namespace test_segmentation
