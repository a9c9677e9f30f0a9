// SPDX-License-Identifier: Apache-2.0
#include <dcmtk/dcmiod/cielabutil.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "../volume/reorient.h"
#include "dicom.h"
#include "dicom_item.h"
#include "dicom_pixels.h"
#include "volume_header.h"

namespace hexmesh {
namespace {

namespace fs = std::filesystem;

/// "SCHEME^CODE^MEANING" of a code sequence's first item, as 3D Slicer writes it.
std::string triplet(DcmItem* holder, const DcmTagKey& sequence) {
  DcmItem* code = holder ? item_of(*holder, sequence) : nullptr;
  if (!code) return "^^";
  return text_of(*code, DCM_CodingSchemeDesignator) + "^" + text_of(*code, DCM_CodeValue) + "^" +
         text_of(*code, DCM_CodeMeaning);
}

std::string terminology_of(DcmItem& item) {
  DcmItem* type = item_of(item, DCM_SegmentedPropertyTypeCodeSequence);
  DcmItem* region = item_of(item, DCM_AnatomicRegionSequence);
  return "Segmentation category and type - DICOM master list~" +
         triplet(&item, DCM_SegmentedPropertyCategoryCodeSequence) + "~" +
         triplet(&item, DCM_SegmentedPropertyTypeCodeSequence) + "~" +
         triplet(type, DCM_SegmentedPropertyTypeModifierCodeSequence) + "~Anatomic codes - DICOM master list~" +
         triplet(&item, DCM_AnatomicRegionSequence) + "~" + triplet(region, DCM_AnatomicRegionModifierSequence);
}

/// What SegmentSequence says; by segment number.
std::map<int, Segment> segments_of(const fs::path& path, DcmItem& dataset) {
  std::map<int, Segment> out;
  for (unsigned long n = 0; n < count_items(dataset, DCM_SegmentSequence); ++n) {
    DcmItem& item = *item_of(dataset, DCM_SegmentSequence, n);
    const double number = number_of(item, DCM_SegmentNumber, -1);
    if (!(number >= 0 && number <= 65535 && number == std::floor(number)) || out.contains(static_cast<int>(number)))
      refuse(path, "has segment number {}, expected whole numbers from 0 to 65535, each once", number);
    Segment s{static_cast<std::uint16_t>(number), text_of(item, DCM_SegmentLabel), distinct_color(n),
              terminology_of(item)};
    if (s.name.empty()) s.name = fmt::format("segment_{}", number);
    if (const std::vector<double> lab = numbers_of(item, DCM_RecommendedDisplayCIELabValue); lab.size() == 3) {
      // Source: DICOM PS3.3, C.10.7.1.1: 16-bit numbers for L in [0, 100], a and b in [-128, 127].
      double r = 0, g = 0, b = 0;
      IODCIELabUtil::dicomLab2RGB(r, g, b, lab[0], lab[1], lab[2]);
      s.color = {std::clamp(r, 0.0, 1.0), std::clamp(g, 0.0, 1.0), std::clamp(b, 0.0, 1.0)};
    }
    out.emplace(static_cast<int>(number), s);
  }
  if (out.empty()) refuse(path, "names no segment (SegmentSequence), expected at least one");
  return out;
}

/// The frames' grid: sparse frames keep their distance to each other.
Grid grid_of(const fs::path& path, DcmItem& dataset, const std::vector<FramePlane>& planes, Index3 extent,
             const ReadOptions& options) {
  const FramePlane& first = planes[0];
  const Vec3 normal = first.normal();
  std::vector<double> at;
  for (const FramePlane& p : planes) {
    const Vec3 d = p.position - first.position;
    const bool in_line = (d - d.dot(normal) * normal).norm() < 0.1 * std::min(p.dx, p.dy);
    if ((p.row - first.row).norm() + (p.column - first.column).norm() > 1e-3 || std::abs(p.dx / first.dx - 1) > 1e-3 ||
        std::abs(p.dy / first.dy - 1) > 1e-3 || !in_line)
      refuse(path,
             "has frames of different orientation or in-plane position (tiles of a microscope?), expected "
             "parallel slices one above the other");
    at.push_back(d.dot(normal));
  }
  std::sort(at.begin(), at.end());
  at.erase(std::unique(at.begin(), at.end(), [](double a, double b) { return b - a < 1e-3; }), at.end());
  // How far apart slices are is not how thick they are; that serves a single one only.
  double spacing = pixel_measure(dataset, 0, DCM_SpacingBetweenSlices);
  if (at.size() == 1 && spacing == 0) spacing = pixel_measure(dataset, 0, DCM_SliceThickness);
  const auto fits = [&](double s) {
    return s > 0 && std::all_of(at.begin(), at.end(), [&](double a) {
             const double n = (a - at[0]) / s;
             return std::abs(n - std::round(n)) < 0.02 * std::max(1.0, n / static_cast<double>(at.size()));
           });
  };
  double least = 0, greatest = 0;
  for (std::size_t n = 1; n < at.size(); ++n) {
    least = n == 1 ? at[n] - at[n - 1] : std::min(least, at[n] - at[n - 1]);
    greatest = std::max(greatest, at[n] - at[n - 1]);
  }
  if (!fits(spacing) || (least > 0 && spacing > 1.02 * least)) spacing = least;
  if (spacing == 0) {
    spacing = 1;
    options.warn(fmt::format("'{}' has one slice and says nothing of its thickness: taken as 1 mm", path.string()));
  }
  if (!fits(spacing))
    refuse(path, "has slices {:.3f} to {:.3f} mm apart, expected multiples of one distance", least, greatest);
  const double count = std::round((at.back() - at[0]) / spacing) + 1;
  if (!(count < 65536)) refuse(path, "spans {:g} slices, expected fewer than 65536", count);
  if (count > 1) spacing = (at.back() - at[0]) / (count - 1);
  extent[2] = static_cast<std::int32_t>(count);
  Mat3 direction;
  direction << first.row, first.column, normal;
  const Grid grid(extent, Vec3(first.dx, first.dy, spacing), first.position + at[0] * normal, direction);
  check_memory(path, grid.num_voxels() * sizeof(std::uint16_t), options);
  return grid;
}

/// The segment a frame of a BINARY or FRACTIONAL object belongs to.
int segment_of_frame(const fs::path& path, DcmItem& dataset, unsigned long frame,
                     const std::map<int, Segment>& segments) {
  DcmItem* group = frame_group(dataset, frame, DCM_SegmentIdentificationSequence);
  const double number = group ? number_of(*group, DCM_ReferencedSegmentNumber, -1) : -1;
  if (!group && segments.size() == 1) return segments.begin()->first;
  if (number < 0 || number > 65535 || !segments.contains(static_cast<int>(number)))
    refuse(path, "does not say to which of its {} segments frame {} belongs", segments.size(), frame + 1);
  return static_cast<int>(number);
}

/// How an object stores its frames.
struct FrameLayout {
  std::string type;  ///< BINARY, FRACTIONAL or LABELMAP
  int bits = 0;      ///< of a pixel
  std::int32_t rows = 0, columns = 0;
  unsigned long frames = 0;
  std::size_t bytes = 0;  ///< of all pixels

  std::size_t frame_pixels() const { return as_size(rows) * as_size(columns); }
};

FrameLayout layout_of(const fs::path& path, DcmItem& dataset, const ReadOptions& options) {
  const double rows = number_of(dataset, DCM_Rows, 0), columns = number_of(dataset, DCM_Columns, 0);
  const double num_frames = number_of(dataset, DCM_NumberOfFrames, 1), bits = number_of(dataset, DCM_BitsAllocated, 0);
  const std::string type = text_of(dataset, DCM_SegmentationType);
  if (!(rows >= 1 && columns >= 1 && num_frames >= 1 && num_frames < 1e6))
    refuse(path, "has {} rows, {} columns and {} frames, expected at least one of each", rows, columns, num_frames);
  if (!((type == "BINARY" && bits == 1) || (type == "FRACTIONAL" && bits == 8) ||
        (type == "LABELMAP" && (bits == 8 || bits == 16))))
    refuse(path,
           "is of type '{}' with {} bits a pixel, expected BINARY with 1, FRACTIONAL with 8 or LABELMAP with "
           "8 or 16",
           type, bits);
  const auto frames = static_cast<unsigned long>(num_frames);
  if (const unsigned long described = count_items(dataset, DCM_PerFrameFunctionalGroupsSequence); described != frames)
    refuse(path, "has {} frames and describes {} (PerFrameFunctionalGroupsSequence), expected as many", frames,
           described);
  const std::uintmax_t pixels = promised_bytes(
      path, {static_cast<std::int64_t>(rows), static_cast<std::int64_t>(columns), static_cast<std::int64_t>(frames)},
      1);
  const auto bytes =
      static_cast<std::size_t>(bits == 1 ? (pixels + 7) / 8 : pixels * static_cast<std::uintmax_t>(bits / 8));
  check_memory(path, bytes, options);
  return {type, static_cast<int>(bits), static_cast<std::int32_t>(rows), static_cast<std::int32_t>(columns), frames,
          bytes};
}

using VoxelsOfSegments = std::map<int, std::vector<std::size_t>>;  ///< by segment number

/// @param first_voxel  offset of the first voxel of each frame
VoxelsOfSegments voxels_of_label_map(const fs::path& path, DcmItem& dataset, const FrameLayout& layout,
                                     const std::vector<std::uint8_t>& data, const std::map<int, Segment>& segments,
                                     const std::vector<std::size_t>& first_voxel) {
  VoxelsOfSegments voxels;
  const std::size_t frame_pixels = layout.frame_pixels();
  const double padding = number_of(dataset, DCM_PixelPaddingValue, 0);
  for (unsigned long f = 0; f < layout.frames; ++f)
    for (std::size_t n = 0; n < frame_pixels; ++n) {
      const std::size_t p = f * frame_pixels + n;
      const int value = layout.bits == 8 ? data[p] : data[2 * p] + 256 * data[2 * p + 1];
      if (value == padding || value == 0) continue;
      if (!segments.contains(value)) refuse(path, "has pixels of segment {}, which it does not describe", value);
      voxels[value].push_back(first_voxel[f] + n);
    }
  return voxels;
}

/// @param first_voxel  offset of the first voxel of each frame
/// @param fraction     of a FRACTIONAL object: at least this share of a voxel
/// belongs to the segment
VoxelsOfSegments voxels_of_masks(const fs::path& path, DcmItem& dataset, const FrameLayout& layout,
                                 const std::vector<std::uint8_t>& data, const std::map<int, Segment>& segments,
                                 const std::vector<std::size_t>& first_voxel, double fraction) {
  VoxelsOfSegments voxels;
  const std::size_t frame_pixels = layout.frame_pixels();
  const double most = number_of(dataset, DCM_MaximumFractionalValue, 255);
  for (unsigned long f = 0; f < layout.frames; ++f) {
    std::vector<std::size_t>& of_segment = voxels[segment_of_frame(path, dataset, f, segments)];
    for (std::size_t n = 0; n < frame_pixels; ++n) {
      const std::size_t p = f * frame_pixels + n;
      const bool inside =
          layout.bits == 1 ? (data[p / 8] >> (p % 8) & 1) != 0 : data[p] > 0 && data[p] >= fraction * most;
      if (inside) of_segment.push_back(first_voxel[f] + n);
    }
  }
  return voxels;
}

/// In LPS, and on the grid of the scan beside it where it lies on that one's
/// voxels.
Segmentation placed(Segmentation segmentation, const fs::path& path, const ReadOptions& options) {
  segmentation = reorient_to_lps(std::move(segmentation));
  if (options.reference) {
    const Grid reference = Reorientation(*options.reference).grid();
    if (same_lattice_of_voxels(reference, segmentation.grid))
      return place_on(segmentation, extend_over(reference, segmentation.grid));
    options.warn(
        fmt::format("'{}' does not lie on the voxels of the scan "
                    "beside it: its own grid is kept",
                    path.string()));
  }
  return segmentation;
}

}  // namespace

Segmentation read_dicom_segmentation(const DicomFile& file, const ReadOptions& options) {
  const fs::path& path = file.path;
  const std::unique_ptr<DcmFileFormat> loaded = load_dicom(path);
  DcmDataset& dataset = *loaded->getDataset();
  const FrameLayout layout = layout_of(path, dataset, options);

  const std::map<int, Segment> segments = segments_of(path, dataset);
  std::vector<FramePlane> planes;
  for (unsigned long f = 0; f < layout.frames; ++f) planes.push_back(frame_plane(path, dataset, f));
  const Grid own = grid_of(path, dataset, planes, {layout.columns, layout.rows, 1}, options);
  const std::vector<char> unpacked = unpack_pixels(path, *loaded);
  if (unpacked.size() < layout.bytes)
    refuse(path, "is cut: its pixels take {} bytes, expected {}", unpacked.size(), layout.bytes);
  const std::vector<std::uint8_t> data(unpacked.begin(), unpacked.end());
  std::vector<std::size_t> first_voxel;
  for (const FramePlane& plane : planes) {
    const double k = std::round(own.continuous_index(plane.position)[2]);
    first_voxel.push_back(own.offset({0, 0, static_cast<std::int32_t>(k)}));
  }

  const bool is_label_map = layout.type == "LABELMAP";
  VoxelsOfSegments voxels = is_label_map
                                ? voxels_of_label_map(path, dataset, layout, data, segments, first_voxel)
                                : voxels_of_masks(path, dataset, layout, data, segments, first_voxel, options.fraction);
  Segmentation out{own, {}, {}};
  for (const auto& [number, segment] : segments) {
    const bool background = number == 0 || (is_label_map && number == number_of(dataset, DCM_PixelPaddingValue, 0));
    if (!background || voxels.contains(number)) {
      Segment labelled = segment;
      labelled.label = free_label(out, segment.label);
      add_segment(out, labelled, voxels[number]);
    }
  }
  return placed(std::move(out), path, options);
}

}  // namespace hexmesh
