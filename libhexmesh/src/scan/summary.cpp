// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/scan/summary.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "dicom.h"
#include "hexmesh/core/error.h"
#include "hexmesh/geometry/shape_functions.h"
#include "stored_volume.h"

namespace hexmesh {
namespace {

namespace fs = std::filesystem;

/// The box of the voxels from one index to another [mm].
SegmentSummary::Box box_of(const Grid& grid, const Index3& first, const Index3& last) {
  SegmentSummary::Box out{Vec3::Constant(INFINITY), Vec3::Constant(-INFINITY)};
  for (int corner = 0; corner < 8; ++corner) {
    Vec3 index;
    for (int d = 0; d < 3; ++d) index[d] = corner_bit(corner, d) == 1 ? last[d] + 0.5 : first[d] - 0.5;
    const Vec3 position = grid.position(index);
    out = {out.low.cwiseMin(position), out.high.cwiseMax(position)};
  }
  return out;
}

void add_segments(ScanSummary& to, const Segmentation& segmentation) {
  to.grid = segmentation.grid;
  to.layers = segmentation.layers.size();
  constexpr std::size_t num_values = 65536;
  struct Found {
    std::size_t voxels = 0;
    Index3 first, last;
  };
  for (const LayeredSegment& s : segmentation.segments) to.segments.push_back({s.segment, 0, {}});
  for (std::size_t layer = 0; layer < segmentation.layers.size(); ++layer) {
    std::vector<Found> found(num_values);
    const std::vector<std::uint16_t>& values = segmentation.layers[layer];
    for (std::size_t n = 0; n < values.size(); ++n) {
      if (values[n] == 0) continue;
      Found& f = found[values[n]];
      const Index3 v = segmentation.grid.index(n);
      if (f.voxels++ == 0) f.first = f.last = v;
      for (std::size_t d = 0; d < 3; ++d) {
        f.first[d] = std::min(f.first[d], v[d]);
        f.last[d] = std::max(f.last[d], v[d]);
      }
    }
    for (std::size_t s = 0; s < segmentation.segments.size(); ++s) {
      const Found& f = found[segmentation.segments[s].value];
      if (segmentation.segments[s].layer != layer || f.voxels == 0) continue;
      to.segments[s].voxels = f.voxels;
      to.segments[s].box = box_of(segmentation.grid, f.first, f.last);
    }
  }
}

ScanSummary of_volume(const fs::path& path, const ReadOptions& options) {
  const StoredVolume stored = read_stored(path, options);
  ScanSummary out{stored.format, path.string(), {}, stored.grid};
  const bool named = stored.keys.contains("Segment0_ID") || stored.keys.contains("Segment0_Name");
  if (named || looks_like_labels(stored)) {
    add_segments(out, to_segmentation(stored, path, options.names));
  } else if (stored.components == 1) {
    std::visit(
        [&](const auto& values) {
          double low = INFINITY, high = -INFINITY;
          for (const auto v : values) {
            low = std::min(low, static_cast<double>(v));
            high = std::max(high, static_cast<double>(v));
          }
          out.range = {low, high};
        },
        stored.values);
  } else {
    out.facts.emplace_back("values per voxel", fmt::format("{}", stored.components));
  }
  return out;
}

ScanSummary of_series(const DicomSeries& series, const ReadOptions& options) {
  ScanSummary out{fmt::format("DICOM {} series", series.modality), series.uid.empty() ? "no UID" : series.uid, {}, {}};
  out.facts.emplace_back("description", series.description);
  out.facts.emplace_back("files", fmt::format("{}", series.files.size()));
  SliceReport slices;
  const IntensityVolume volume = read_series(series, options, &slices);
  out.grid = volume.grid;
  out.facts.emplace_back("slices", fmt::format("{}", slices.slices));
  if (slices.slices > 1)
    out.facts.emplace_back("slice distance", slices.regular ? fmt::format("{:.4g} mm", slices.greatest_distance)
                                                            : fmt::format("{:.3f} to {:.3f} mm", slices.least_distance,
                                                                          slices.greatest_distance));
  if (slices.tilt_degrees > 0)
    out.facts.emplace_back("gantry tilt", fmt::format("{:.1f} degrees", slices.tilt_degrees));
  const auto [low, high] = std::minmax_element(volume.values.begin(), volume.values.end());
  out.range = {*low, *high};
  return out;
}

}  // namespace

std::vector<ScanSummary> summarize(const std::vector<fs::path>& paths, const ReadOptions& options) {
  if (paths.size() == 1 && !is_dicom(paths.front())) return {of_volume(paths.front(), options)};
  const DicomInput input = gather_dicom(paths, options);
  std::vector<ScanSummary> out;
  // One item that cannot be read leaves the others to be told of; alone, it is an error.
  const std::size_t items = input.images.size() + input.segmentations.size() + input.contours.size();
  const auto add = [&](auto&& make) {
    try {
      out.push_back(make());
    } catch (const Error& e) {
      if (items == 1) throw;
      options.warn(fmt::format("{}: left out", e.what()));
    }
  };
  std::map<std::string, Grid> grids;  // by series
  for (const DicomSeries& series : input.images)
    add([&] {
      ScanSummary summary = of_series(series, options);
      grids.emplace(series.uid, *summary.grid);
      return summary;
    });
  const auto with_reference = [&](const DicomFile& file) {
    ReadOptions placed = options;
    const DicomSeries* series = referenced_series(input, file, options);
    if (!placed.reference && series && grids.contains(series->uid)) placed.reference = grids.at(series->uid);
    return placed;
  };
  for (const DicomFile& file : input.segmentations)
    add([&] {
      ScanSummary summary{"DICOM SEG", file.path.string(), {{"description", file.description}}};
      add_segments(summary, read_dicom_segmentation(file, with_reference(file)));
      return summary;
    });
  for (const DicomFile& file : input.contours)
    add([&] {
      ScanSummary summary{"DICOM RTSTRUCT", file.path.string(), {{"description", file.description}}};
      summary.facts.emplace_back("structures", fmt::format("{}", fmt::join(contour_names(file), ", ")));
      if (const ReadOptions placed = with_reference(file); placed.reference)
        add_segments(summary, read_contours(file, placed));
      else
        options.warn(
            fmt::format("'{}': contours need the scan they were drawn on to become voxels", file.path.string()));
      return summary;
    });
  for (const DicomFile& file : input.others)
    options.warn(fmt::format("'{}' is of modality {} and not used", file.path.string(), file.modality));
  if (out.empty())
    throw Error(ErrorKind::input, fmt::format("'{}' holds neither a scan nor a segmentation", paths.front().string()));
  return out;
}

std::string axis_letters(const Grid& grid) {
  std::string out;
  for (int d = 0; d < 3; ++d) {
    Eigen::Index axis = 0;
    const double along = grid.direction().col(d).cwiseAbs().maxCoeff(&axis);
    const bool positive = grid.direction()(axis, d) > 0;
    const char letter = std::string_view(positive ? "LPS" : "RAI")[axis];
    constexpr double one_degree = 0.99985;
    out += along > one_degree ? letter : static_cast<char>(std::tolower(letter));
  }
  return out;
}

}  // namespace hexmesh
