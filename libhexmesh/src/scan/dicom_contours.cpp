// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "dicom.h"
#include "dicom_item.h"

namespace hexmesh {
namespace {

namespace fs = std::filesystem;

/// A closed contour in continuous voxel indices.
struct Contour {
  std::vector<Eigen::Vector2d> points;
  double slice;  ///< its k
};

std::vector<Contour> contours_of(const DicomFile& file, const std::string& name, DcmItem& roi,
                                 const ReadOptions& options) {
  std::vector<Contour> out;
  std::size_t skipped = 0;
  for (unsigned long n = 0; n < count_items(roi, DCM_ContourSequence); ++n) {
    DcmItem& item = *item_of(roi, DCM_ContourSequence, n);
    const std::string type = text_of(item, DCM_ContourGeometricType);
    const std::vector<double> data = numbers_of(item, DCM_ContourData);
    if (data.size() % 3 != 0 || data.empty())
      refuse(file.path, "has a contour of '{}' with {} numbers, expected three per point", name, data.size());
    if ((type != "CLOSED_PLANAR" && type != "CLOSEDPLANAR_XOR") || data.size() < 9) {
      ++skipped;
      continue;
    }
    Contour contour;
    double low = INFINITY, high = -INFINITY;
    for (std::size_t p = 0; p < data.size(); p += 3) {
      const Vec3 at = options.reference->continuous_index(Vec3(data[p], data[p + 1], data[p + 2]));
      if (!at.allFinite()) refuse(file.path, "has a contour point of '{}' that is not finite", name);
      contour.points.emplace_back(at[0], at[1]);
      low = std::min(low, at[2]);
      high = std::max(high, at[2]);
    }
    if (high - low > 0.5)
      refuse(file.path,
             "has a contour of '{}' that crosses {:.1f} slices of the scan, expected contours that lie "
             "in its slices",
             name, high - low);
    contour.slice = (low + high) / 2;
    out.push_back(std::move(contour));
  }
  if (skipped > 0)
    options.warn(fmt::format(
        "{} contours of '{}' are points, lines or have fewer than three points and enclose nothing", skipped, name));
  return out;
}

/// Flip every pixel whose centre lies inside, so that a contour within another is a hole.
void flip_inside(const Contour& contour, const Index3& extent, std::vector<bool>& inside) {
  const auto& p = contour.points;
  std::vector<double> crossings;
  for (std::int32_t j = 0; j < extent[1]; ++j) {
    crossings.clear();
    for (std::size_t a = 0, b = p.size() - 1; a < p.size(); b = a++)
      if ((p[a][1] > j) != (p[b][1] > j))
        crossings.push_back(p[a][0] + (j - p[a][1]) / (p[b][1] - p[a][1]) * (p[b][0] - p[a][0]));
    std::sort(crossings.begin(), crossings.end());
    for (std::size_t n = 0; n + 1 < crossings.size(); n += 2) {
      const auto pixel = [&](double x) {
        return static_cast<std::int32_t>(std::ceil(std::clamp<double>(x, 0, extent[0])));
      };
      const std::int32_t first = pixel(crossings[n]), last = pixel(crossings[n + 1]);
      for (std::int32_t i = first; i < last; ++i) {
        const std::size_t at = offset_in(extent, {i, j, 0});
        inside[at] = !inside[at];
      }
    }
  }
}

/// Contours that lie in one plane.
struct Plane {
  double slice;  ///< k of the first of them
  std::vector<const Contour*> contours;
};

/// Planes in ascending order; written positions are rounded, so contours of one plane differ by a little.
std::vector<Plane> planes_of(const std::vector<Contour>& contours) {
  std::vector<const Contour*> sorted;
  for (const Contour& c : contours) sorted.push_back(&c);
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const Contour* a, const Contour* b) { return a->slice < b->slice; });
  constexpr double same_plane = 0.25;
  std::vector<Plane> out;
  for (const Contour* c : sorted) {
    if (out.empty() || c->slice - out.back().slice > same_plane) out.push_back({c->slice, {}});
    out.back().contours.push_back(c);
  }
  return out;
}

/// Slices take the contours of the nearest plane that has any, within half of the planes' distance.
/// @param outside  receives the planes beyond the grid's first and last slice
std::vector<std::size_t> fill(const std::vector<Contour>& contours, const Grid& grid, std::size_t& outside) {
  const std::vector<Plane> planes = planes_of(contours);
  std::vector<double> gaps;
  for (std::size_t n = 1; n < planes.size(); ++n) gaps.push_back(planes[n].slice - planes[n - 1].slice);
  std::sort(gaps.begin(), gaps.end());
  const double reach = std::max(gaps.empty() ? 0 : gaps[gaps.size() / 2], 1.0) / 2 + 1e-3;
  const Index3& extent = grid.extent();
  outside = as_size(std::count_if(planes.begin(), planes.end(),
                                  [&](const Plane& p) { return p.slice < -0.5 || p.slice > extent[2] - 0.5; }));
  std::vector<std::size_t> voxels;
  for (std::int32_t k = 0; k < extent[2]; ++k) {
    const auto nearest = std::min_element(planes.begin(), planes.end(), [&](const Plane& a, const Plane& b) {
      return std::abs(a.slice - k) < std::abs(b.slice - k);
    });
    if (nearest == planes.end() || std::abs(nearest->slice - k) >= reach) continue;
    std::vector<bool> inside(strides_in(extent)[2]);
    for (const Contour* c : nearest->contours) flip_inside(*c, extent, inside);
    for (std::size_t n = 0; n < inside.size(); ++n)
      if (inside[n]) voxels.push_back(grid.offset({0, 0, k}) + n);
  }
  return voxels;
}

int roi_number(DcmItem& item, const DcmTagKey& tag) {
  return static_cast<int>(std::clamp(number_of(item, tag, 0), -1e9, 1e9));
}

/// By ROI number.
std::map<int, std::string> names_of(DcmItem& dataset) {
  std::map<int, std::string> out;
  for (unsigned long n = 0; n < count_items(dataset, DCM_StructureSetROISequence); ++n) {
    DcmItem& item = *item_of(dataset, DCM_StructureSetROISequence, n);
    out[roi_number(item, DCM_ROINumber)] = text_of(item, DCM_ROIName);
  }
  return out;
}

}  // namespace

std::vector<std::string> contour_names(const DicomFile& file) {
  const std::unique_ptr<DcmFileFormat> loaded = load_dicom(file.path);
  std::vector<std::string> out;
  for (const auto& [number, name] : names_of(*loaded->getDataset())) out.push_back(name);
  return out;
}

Segmentation read_contours(const DicomFile& file, const ReadOptions& options) {
  const std::unique_ptr<DcmFileFormat> loaded = load_dicom(file.path);
  DcmDataset& dataset = *loaded->getDataset();
  std::map<int, std::string> names = names_of(dataset);
  Segmentation out{*options.reference, {}, {}};
  for (unsigned long n = 0; n < count_items(dataset, DCM_ROIContourSequence); ++n) {
    DcmItem& roi = *item_of(dataset, DCM_ROIContourSequence, n);
    const int number = roi_number(roi, DCM_ReferencedROINumber);
    Segment segment{free_label(out, static_cast<std::uint16_t>(n + 1)), names[number], distinct_color(n), ""};
    if (segment.name.empty()) segment.name = fmt::format("roi_{}", number);
    if (const std::vector<double> rgb = numbers_of(roi, DCM_ROIDisplayColor); rgb.size() == 3)
      for (std::size_t c = 0; c < 3; ++c) segment.color[c] = std::clamp(rgb[c] / 255, 0.0, 1.0);
    const std::vector<Contour> contours = contours_of(file, segment.name, roi, options);
    std::size_t outside = 0;
    add_segment(out, segment, fill(contours, *options.reference, outside));
    if (outside > 0)
      options.warn(fmt::format("'{}': {} planes of contours of '{}' lie beyond the scan and are lost",
                               file.path.string(), outside, segment.name));
  }
  if (out.segments.empty()) refuse(file.path, "has no contours (ROIContourSequence), expected some");
  return out;
}

}  // namespace hexmesh
