// SPDX-License-Identifier: Apache-2.0
// Real files beside the project, with their true volumes.
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <set>
#include <sstream>

#include "hexmesh/scan/phantom.h"
#include "hexmesh/scan/summary.h"
#include "hexmesh/surface/surface_file.h"
#include "support/bodies.h"
#include "support/experiments.h"
#include "support/files.h"
#include "support/scan_files.h"

namespace test_real_scans {

using namespace hexmesh;
using namespace testing_support;

std::filesystem::path data() { return shared_data() / "data"; }

#define SKIP_WITHOUT_DATA() \
  if (!std::filesystem::exists(data())) GTEST_SKIP() << "no shared data beside the project"

/// Voxels by label of the segmentation in a file or folder.
std::map<int, std::size_t> voxels_of(const std::string& path) {
  std::map<int, std::size_t> out;
  for (const ScanSummary& s : summarize({data() / path}))
    for (const SegmentSummary& segment : s.segments) out[segment.segment.label] += segment.voxels;
  return out;
}

TEST(RealScans, EverySegmentHasItsTrueNumberOfVoxels) {
  SKIP_WITHOUT_DATA();
  using Counts = std::map<int, std::size_t>;
  const std::map<std::string, Counts> expected = {
      {"dcmqi/liver.dcm", {{1, 107098}}},
      {"dcmqi/liver_seg.nrrd", {{1, 107098}}},
      {"dcmqi/liver_spine_gapped_seg.nrrd", {{1, 107098}, {5, 12439}}},
      {"dcmqi/liver_spine_seg.nrrd", {{1, 107098}, {2, 12439}}},
      {"dcmqi/sparse-labelmap-noppv.dcm", {{1, 630}}},
      {"dcmqi/sparse-labelmap-ppv5.dcm", {{1, 630}}},
      {"dcmqi/24x38x3/seg/label.seg", {{1, 315}}},
      {"pydicom-data/liver.dcm", {{1, 107098}}},
      {"pydicom-data/liver_expb.dcm", {{1, 107098}}},
      {"derived/dicom-torso-3mm/SEG.dcm",
       {{1, 41692}, {2, 1319}, {3, 9668}, {4, 7134}, {5, 5090}, {6, 4836}, {7, 1839}, {8, 2266}, {9, 1086}}},
      {"derived/liver-medrad-p2.seg.nrrd", {{1, 1252935}, {2, 34598}, {3, 39292}, {4, 36261}, {5, 6900}, {6, 9864}}},
      {"slicerio/Segmentation.seg.nrrd",
       {{1, 8487}, {2, 1216}, {3, 2712}, {4, 3259}, {5, 34450}, {6, 33700}, {7, 154589}}},
      {"slicerio/SegmentationOverlapping.seg.nrrd",  // the sphere has value 1 in the second layer
       {{1, 8487}, {2, 1216}, {3, 2712}, {4, 3259}, {5, 34450}, {6, 33700}, {7, 154589}, {8, 19139}}},
      {"slicerrt/EclipseProstate_Bladder_Union_PTV.seg.nrrd", {{1, 69989}}},
      {"slicerrt/EclipseProstate_Expanded_5_5_5_Bladder.seg.nrrd", {{1, 84024}}},
      {"slicer-adaptive-brush/MRBrainTumor1_tumor/gold.seg.nrrd", {{1, 13502}}},
      {"slicer-adaptive-brush/idc_mri_t1gd_tumor/gold.seg.nrrd", {{1, 65451}}},
      {"slicer-adaptive-brush/idc_pet_tumor/gold.seg.nrrd", {{1, 40079}}},
      {"slicer-adaptive-brush/idc_ct_bone/gold.seg.nrrd", {{1, 481816}}},
      {"pyradiomics/brain1_label.nrrd", {{1, 4137}}},
      {"pyradiomics/breast1_label.nrrd", {{1, 143}}},
      {"pyradiomics/lung2_label.nrrd", {{1, 24644}}},
      {"pyradiomics/prostate_phantom_subvolume-label.nrrd", {{1, 168}, {7, 170}, {8, 2997}, {9, 9088}}},
      {"toolarena-crlm/tests/CRLM-CT-1085_0000_seg_mask.nii.gz", {{1, 7924}}},
      {"med-rad/Brain/Patient2/brain.nii.gz", {{1, 1173912}}},
      {"med-rad/Brain/Patient2/vessels.nii.gz", {{1, 120949}}},
      {"med-rad/Liver/Patient1/liver.nii.gz", {{1, 476477}}},
      {"med-rad/Liver/Patient2/liver.nii.gz", {{1, 1252935}}},
      {"med-rad/Liver/Patient2/nodule2.nii.gz", {{1, 9864}}},
      {"med-rad/Liver/Patient3/liver.nii.gz", {{1, 1597589}}},
      {"totalsegmentator/example_seg_fast/trachea.nii.gz", {}},
      {"totalsegmentator/example_seg_fast/liver.nii.gz", {{1, 39350}}},
      {"totalsegmentator/pulmonary_report/heart.nii.gz", {{1, 198176}}},
      {"broken-derived/crlf_header.nrrd", {{1, 512}}},
      {"pynrrd/BallBinary30x30x30_gz.nrrd", {{257, 14328}}},
  };
  for (const auto& [path, counts] : expected) EXPECT_EQ(voxels_of(path), counts) << path;
  const std::map<std::string, Counts> some = {
      {"totalsegmentator/example_seg.nii.gz", {{5, 38634}, {20, 12993}, {63, 1368}}},
      {"totalsegmentator/example_seg_dicom.nii.gz", {{5, 366708}, {1, 130634}, {63, 4772}}},
      {"totalsegmentator/example_seg_fast_force_split.nii.gz", {{5, 41692}, {20, 59968}, {83, 8917}}},
      {"totalsegmentator/example_seg_mr.nii.gz", {{5, 18480}, {21, 544}}},
      {"spl-abdominal-atlas/seg.nrrd", {{3, 181482}, {9, 204598}, {240, 32383}}},
      {"mricron-data/aal.nii.gz", {{8, 40374}, {51, 25989}}},
      {"mricron-data/brodmann.nii.gz", {{48, 158164}}},
  };
  for (const auto& [path, counts] : some) {
    const Counts found = voxels_of(path);
    for (const auto& [label, voxels] : counts)
      EXPECT_EQ(found.contains(label) ? found.at(label) : 0, voxels) << path << " " << label;
  }
}

/// The liver of a whole body's segmentation, pulled at its thin left end.
LabelVolume pulled_liver() { return read_labels(data() / "totalsegmentator/example_seg_fast/liver.nii.gz"); }

hexsolver::Scene pull_of_liver() {
  const auto at = [](const Vec3& point, const Vec3& by) {
    return hextools::patch("at", point, 10, by, hexsolver::SurfacePoints::faces);
  };
  return with({at({-135.544, -140.319, 121.302}, Vec3::Zero()), at({-95.044, -84.819, 145.302}, Vec3::Zero()),
               at({-107.044, -221.319, 92.802}, Vec3::Zero()), at({65.456, -224.319, 178.302}, {0, -28.284, -28.284})});
}

/// On one of these positions a few nodes have the multigrid's largest eigenvalue, apart from all others.
TEST(RealScans, CondensedCellsOfALiverConvergeAtEveryPosition) {
  SKIP_WITHOUT_DATA();
  const LabelVolume labels = pulled_liver();
  hexsolver::Scene scene = pull_of_liver();
  scene.stiffness = hexsolver::Stiffness::condensed;
  for (const Index3& offset : {Index3{0, 0, 0}, {8, 19, 11}, {30, 1, 4}}) {
    const Lattice lattice = lattice_of(labels, 100, 0.3, {0, offset});
    for (const int level : {3, 2, 1}) {
      const hexsolver::SolveReport report = solve(lattice, scene, level).report;
      EXPECT_TRUE(report.converged) << "level " << level << ": " << report.reason;
    }
  }
}

/// At the first of these positions coarse levels agree by chance: the thin end bends on none of them.
TEST(RealScans, AccuraciesOfALiverAreKeptAtEveryPosition) {
  SKIP_WITHOUT_DATA();
  const LabelVolume labels = pulled_liver();
  hexsolver::Scene scene = pull_of_liver();
  for (const Index3& offset : {Index3{26, 30, 7}, {21, 5, 29}, {17, 26, 13}}) {
    const Lattice lattice = lattice_of(labels, 100, 0.3, {0, offset});
    const std::vector<Vec3> points = material_points(lattice);
    const std::vector<Vec3> exact = displacement_at(solve(lattice, scene, 0).result, points);
    for (const double asked : {1.2, 0.6, 0.4}) {
      hexsolver::Scene accurate = scene;
      accurate.accuracy = asked;
      const hexsolver::Outcome outcome = hexsolver::solve_equilibrium(lattice, accurate, 0);
      const double error = distance(displacement_at(outcome.result, points), exact).mean;
      printf("asked %.2f mm, level %d, true %.3f mm\n", asked, outcome.result.level, error);
      EXPECT_FALSE(outcome.report.accuracy_missed);
      EXPECT_LE(error, 1.2 * asked);
    }
  }
}

TEST(RealScans, DicomEqualsItsSourceVoxelByVoxel) {
  SKIP_WITHOUT_DATA();
  const LabelVolume liver = read_labels(data() / "dcmqi/liver.dcm"),
                    nrrd = read_labels(data() / "dcmqi/liver_seg.nrrd");
  EXPECT_TRUE(same_grid(liver.grid, nrrd.grid));
  EXPECT_EQ(liver.labels, nrrd.labels);
  const auto folder = data() / "derived/dicom-torso-3mm", source = data() / "totalsegmentator";
  const IntensityVolume ct = read_intensity(folder), nifti = read_intensity(source / "example_ct.nii.gz");
  EXPECT_TRUE(same_grid(ct.grid, nifti.grid));
  EXPECT_EQ(ct.values, nifti.values);
  const LabelVolume seg = read_labels(folder);
  const LabelVolume labels = read_labels(source / "example_seg_fast_force_split.nii.gz");
  ASSERT_TRUE(same_grid(seg.grid, labels.grid));
  const std::map<int, int> number = {{5, 1}, {4, 2}, {1, 3}, {2, 4}, {3, 5}, {6, 6}, {52, 7}, {63, 8}, {64, 9}};
  for (std::size_t n = 0; n < labels.labels.size(); ++n) {
    const auto found = number.find(labels.labels[n]);
    ASSERT_EQ(seg.labels[n], found == number.end() ? 0 : found->second) << n;
  }
}

TEST(Scans, All48OrientationsInLpsAndRasGiveTheSameLattice) {
  const TemporaryFolder folder;
  const LabelVolume scan = liver_phantom(9).labels;
  const auto lattice_of = [](const LabelVolume& volume) {
    return build_lattice(volume, {{volume.segments.at(0), material_from_units(3, 0.45, 1060), 0, ""}}, {4, {0, 0, 0}});
  };
  const Lattice expected = lattice_of(scan);
  std::array<int, 3> order = {0, 1, 2};
  do {
    for (int flips = 0; flips < 8; ++flips)
      for (const char* space : {"left-posterior-superior", "right-anterior-superior"}) {
        write_text(folder / "a.nrrd", nrrd_bytes(stored_as(scan, order, flips), space));
        const LabelVolume read = read_labels(folder / "a.nrrd");
        ASSERT_TRUE(same_grid(read.grid, scan.grid));
        ASSERT_EQ(read.labels, scan.labels);
        if (flips % 3 != 0) continue;
        const Lattice lattice = lattice_of(read);
        ASSERT_EQ(lattice.levels.size(), expected.levels.size());
        for (std::size_t l = 0; l < lattice.levels.size(); ++l) {
          ASSERT_EQ(lattice.levels[l].cells, expected.levels[l].cells);
          ASSERT_EQ(lattice.levels[l].element, expected.levels[l].element);
        }
      }
  } while (std::next_permutation(order.begin(), order.end()));
}

TEST(RealScans, FilesOfOnePatientOnDifferentGridsAreJoined) {
  SKIP_WITHOUT_DATA();
  const auto folder = data() / "med-rad/Liver/Patient1";
  Segmentation liver = read_segmentation({folder / "liver.nii.gz"}),
               vein = read_segmentation({folder / "hepaticVein.nii.gz"});
  ASSERT_NE(liver.grid.extent(), vein.grid.extent());
  const Grid grid = extend_over(liver.grid, vein.grid);
  vein.segments[0].segment.name = "vein";
  const Segmentation joined = combine(place_on(liver, grid), place_on(vein, grid));
  const std::vector<std::size_t> counts = count_voxels(joined);
  EXPECT_EQ(counts[0], 476477U);
  EXPECT_TRUE(same_lattice_of_voxels(liver.grid, vein.grid));
  EXPECT_EQ(counts[1], 21479U);
}

TEST(RealScans, EveryOddFileIsReadOrRefusedAsListed) {
  SKIP_WITHOUT_DATA();
  // Lines "read|refused PATH": what `hexscan info` says of each, within half a GB and without hanging.
  std::ifstream list(HEXTOOLS_SOURCE "/tests/verification/odd_files.txt");
  ASSERT_TRUE(list);
  std::size_t walked = 0;
  std::set<std::string> listed;
  for (std::string expected, path; list >> expected >> path; ++walked) {
    listed.insert(path);
    const CommandResult r = shell("ulimit -v 2000000; timeout 20 hexscan info '" + (data() / path).string() + "'");
    EXPECT_EQ(r.exit_code, expected == "read" ? 0 : 3) << path << "\n" << r.errors;
    if (expected == "refused") {
      EXPECT_EQ(std::count(r.errors.begin(), r.errors.end(), '\n'), 1) << r.errors;
      EXPECT_TRUE(r.output.empty()) << path;
    }
  }
  for (const char* folder : {"broken-derived", "pynrrd", "pydicom", "pydicom-data", "transfer-syntaxes", "highdicom",
                             "trimesh", "tinyobjloader"})
    for (const auto& entry : std::filesystem::directory_iterator(data() / folder))
      EXPECT_TRUE(!entry.is_regular_file() || listed.contains(std::filesystem::relative(entry.path(), data()).string()))
          << entry.path();
  EXPECT_GT(walked, 100U);
  int surfaces = 0;
  for (const char* folder : {"trimesh", "tinyobjloader"})
    for (const auto& entry : std::filesystem::directory_iterator(data() / folder)) try {
        const TriangleSurface surface = read_surface(entry.path());
        for (const auto& t : surface.triangles)
          for (const std::int32_t n : t) ASSERT_LT(static_cast<std::size_t>(n), surface.points.size());
        ++surfaces;
      } catch (const Error& e) {
        EXPECT_EQ(e.kind(), ErrorKind::input);
        EXPECT_NE(std::string(e.what()).find(entry.path().filename()), std::string::npos) << e.what();
      }
  EXPECT_GE(surfaces, 14);
  // A series whose gantry is tilted, of uneven distances, is read and named so.
  std::string facts;
  const ScanSummary summary = summarize({data() / "dcm_qa_ct/GE"}).at(0);
  for (const auto& [key, value] : summary.facts) facts += key + ": " + value + "\n";
  EXPECT_NE(facts.find("gantry tilt: 18.5 degrees"), std::string::npos) << facts;
  EXPECT_NE(facts.find("slice distance: 1.081 to 6.999 mm"), std::string::npos) << facts;
}

}  // namespace test_real_scans
