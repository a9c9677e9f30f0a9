// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "dicom.h"
#include "dicom_item.h"
#include "dicom_pixels.h"
#include "volume_header.h"

namespace hexmesh {
namespace {

namespace fs = std::filesystem;

/// One slice: a frame of a file.
struct Slice {
  fs::path file;
  std::size_t frame = 0, num_frames = 1;
  FramePlane plane;
  Index3 extent;  ///< columns, rows, 1
  double slope = 1, intercept = 0;
  double thickness = 0;  ///< 0: not said
};

std::vector<Slice> slices_of(const fs::path& path, const ReadOptions& options) {
  const std::unique_ptr<DcmFileFormat> file = load_dicom(path);
  DcmDataset& dataset = *file->getDataset();
  const double rows = number_of(dataset, DCM_Rows, 0), columns = number_of(dataset, DCM_Columns, 0);
  const double frames = number_of(dataset, DCM_NumberOfFrames, 1), bits = number_of(dataset, DCM_BitsAllocated, 0);
  if (number_of(dataset, DCM_SamplesPerPixel, 1) != 1) refuse(path, "is a colour image, expected grey values");
  if (dataset.tagExists(DCM_ModalityLUTSequence))
    refuse(path, "turns its pixels into grey values by a table (ModalityLUTSequence), expected slope and intercept");
  if (!(rows >= 1 && columns >= 1 && frames >= 1 && bits >= 8 && bits <= 64))
    refuse(path, "has {} rows, {} columns, {} frames and {} bits a pixel, expected an image", rows, columns, frames,
           bits);
  const std::uintmax_t promised = promised_bytes(
      path, {static_cast<std::int64_t>(rows), static_cast<std::int64_t>(columns), static_cast<std::int64_t>(frames)},
      static_cast<std::size_t>(bits) / 8);
  check_memory(path, promised, options);
  const bool compressed = DcmXfer(dataset.getOriginalXfer()).isEncapsulated() ||
                          dataset.getOriginalXfer() == EXS_DeflatedLittleEndianExplicit;
  constexpr std::uintmax_t empty_jpeg_2000 = 10000;
  check_plausible(path, promised, compressed ? empty_jpeg_2000 : 1);
  std::vector<Slice> out;
  for (std::size_t f = 0; f < static_cast<std::size_t>(frames); ++f) {
    Slice s{path,
            f,
            static_cast<std::size_t>(frames),
            frame_plane(path, dataset, f),
            {static_cast<std::int32_t>(columns), static_cast<std::int32_t>(rows), 1}};
    DcmItem* transformation = frame_group(dataset, f, DCM_PixelValueTransformationSequence);
    DcmItem& rescale = transformation ? *transformation : dataset;
    s.slope = number_of(rescale, DCM_RescaleSlope, 1);
    s.intercept = number_of(rescale, DCM_RescaleIntercept, 0);
    s.thickness = pixel_measure(dataset, f, DCM_SpacingBetweenSlices);
    if (s.thickness == 0) s.thickness = pixel_measure(dataset, f, DCM_SliceThickness);
    if (!std::isfinite(s.slope * s.intercept)) refuse(path, "has a rescale slope or intercept that is not finite");
    out.push_back(std::move(s));
  }
  return out;
}

template <class T>
void rescale(const char* from, const Slice& s, std::vector<float>& to) {
  for (std::size_t n = 0; n < to.size(); ++n) {
    T raw;
    std::memcpy(&raw, from + n * sizeof(T), sizeof(T));
    to[n] = static_cast<float>(s.slope * static_cast<double>(raw) + s.intercept);
  }
}

/// Decodes a file's pixels once, whatever its transfer syntax, and hands out its frames.
class PixelFile {
public:
  explicit PixelFile(const fs::path& path) : path_(path), pixels_(decode_pixels(path)) {}

  std::vector<float> frame(const Slice& s) const {
    std::vector<float> out(strides_in(s.extent)[2]);
    const std::size_t bytes = out.size() * pixels_.bits / 8;
    if (pixels_.bytes.size() < bytes * s.num_frames)
      refuse(path_, "is cut: its pixels take {} bytes, expected {}", pixels_.bytes.size(), bytes * s.num_frames);
    const char* from = pixels_.bytes.data() + bytes * s.frame;
    switch ((pixels_.is_signed ? 1000 : 0) + pixels_.bits) {
      case 8:
        rescale<std::uint8_t>(from, s, out);
        break;
      case 1008:
        rescale<std::int8_t>(from, s, out);
        break;
      case 16:
        rescale<std::uint16_t>(from, s, out);
        break;
      case 1016:
        rescale<std::int16_t>(from, s, out);
        break;
      case 32:
        rescale<std::uint32_t>(from, s, out);
        break;
      case 1032:
        rescale<std::int32_t>(from, s, out);
        break;
      default:
        refuse(path_, "has pixels of {} bits, expected 8, 16 or 32", pixels_.bits);
    }
    return out;
  }

private:
  fs::path path_;
  DicomPixels pixels_;
};

/// Slices of one orientation and size, along their normal.
struct Stack {
  std::vector<Slice> slices;
  std::vector<double> at;  ///< along the normal, from the first [mm]
  SliceReport report;
  double spacing = 0;  ///< of the regular grid [mm]
};

bool are_parallel(const Slice& a, const Slice& b) {
  constexpr double nearly = 2e-3;
  return a.extent == b.extent && (a.plane.row - b.plane.row).norm() < nearly &&
         (a.plane.column - b.plane.column).norm() < nearly && std::abs(a.plane.dx / b.plane.dx - 1) < nearly &&
         std::abs(a.plane.dy / b.plane.dy - 1) < nearly;
}

Stack stack_of(const DicomSeries& series, const ReadOptions& options) {
  // Scouts share a series with its slices now and then: the largest group of one orientation and size counts.
  std::vector<std::vector<Slice>> groups;
  for (const fs::path& path : series.files)
    for (Slice& s : slices_of(path, options)) {
      const auto group = std::find_if(groups.begin(), groups.end(),
                                      [&](const std::vector<Slice>& g) { return are_parallel(g.front(), s); });
      (group != groups.end() ? *group : groups.emplace_back()).push_back(std::move(s));
    }
  const auto largest =
      std::max_element(groups.begin(), groups.end(), [](const auto& a, const auto& b) { return a.size() < b.size(); });
  std::size_t left_out = 0;
  for (const auto& group : groups) left_out += &group == &*largest ? 0 : group.size();
  if (left_out >= largest->size())
    refuse(series.files.front(),
           "and its series hold slices of {} orientations and sizes, none of which is most of "
           "them, expected parallel slices of one size",
           groups.size());
  if (left_out > 0)
    options.warn(
        fmt::format("{} slices of the series have another orientation or size than the other {} and are left out",
                    left_out, largest->size()));

  Stack out{std::move(*largest), {}, {}};
  const Vec3 normal = out.slices[0].plane.normal();
  std::sort(out.slices.begin(), out.slices.end(), [&](const Slice& a, const Slice& b) {
    return a.plane.position.dot(normal) < b.plane.position.dot(normal);
  });
  const FramePlane& first = out.slices.front().plane;
  for (const Slice& s : out.slices) out.at.push_back((s.plane.position - first.position).dot(normal));
  out.report.slices = out.slices.size();
  if (out.slices.size() == 1) {
    out.spacing = out.slices[0].thickness;
    if (out.spacing == 0) {
      out.spacing = 1;
      options.warn("the series has one slice and says nothing of its thickness: taken as 1 mm");
    }
    return out;
  }
  std::vector<double> gaps;
  for (std::size_t n = 1; n < out.at.size(); ++n) gaps.push_back(out.at[n] - out.at[n - 1]);
  const auto [least, greatest] = std::minmax_element(gaps.begin(), gaps.end());
  out.report.least_distance = *least;
  out.report.greatest_distance = *greatest;
  constexpr double same_place = 1e-3;
  if (*least < same_place)
    refuse(out.slices[least - gaps.begin()].file,
           "lies at the same place as another slice of its series (several time points or phases?), expected one "
           "slice per place");
  std::vector<double> sorted = gaps;
  std::nth_element(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2), sorted.end());
  const double median = sorted[sorted.size() / 2];
  constexpr double widest_gap = 3;
  if (*greatest > widest_gap * median)
    refuse(out.slices.front().file,
           "and its series have slices {:.3f} to {:.3f} mm apart, most of them {:.3f} mm: too "
           "many are missing, expected no gap above {} times that",
           *least, *greatest, median, widest_gap);
  const auto drift = [&](std::size_t n) {  // beside the line through the first slice, along the normal
    return (out.slices[n].plane.position - first.position - out.at[n] * normal).norm();
  };
  double greatest_drift = 0;
  for (std::size_t n = 0; n < out.slices.size(); ++n) greatest_drift = std::max(greatest_drift, drift(n));
  out.report.tilt_degrees = std::atan2(drift(out.slices.size() - 1), out.at.back()) * 180 / std::numbers::pi;
  constexpr double even = 0.02, straight = 0.1;
  const bool is_even = *greatest - *least <= even * median + 2e-3;
  const bool is_straight = greatest_drift <= straight * std::min(first.dx, first.dy);
  out.report.regular = is_even && is_straight;
  out.spacing = is_even ? out.at.back() / static_cast<double>(gaps.size()) : median;
  if (is_straight) out.report.tilt_degrees = 0;
  return out;
}

/// The grid that holds all slices; that of the stack itself where it is regular.
Grid grid_of(const Stack& stack, const ReadOptions& options) {
  const Slice& first = stack.slices.front();
  const FramePlane& p = first.plane;
  Mat3 direction;
  direction << p.row, p.column, p.normal();
  Vec3 low = Vec3::Zero(), high(first.extent[0] - 1, first.extent[1] - 1, 0);
  high[2] = std::round(stack.at.back() / stack.spacing);
  if (!stack.report.regular) {
    for (const Slice& s : stack.slices) {
      const Vec3 shift = s.plane.position - p.position;
      const double x = shift.dot(p.row) / p.dx, y = shift.dot(p.column) / p.dy;
      low[0] = std::min(low[0], std::floor(x));
      low[1] = std::min(low[1], std::floor(y));
      high[0] = std::max(high[0], std::ceil(x) + first.extent[0] - 1);
      high[1] = std::max(high[1], std::ceil(y) + first.extent[1] - 1);
    }
    options.warn(fmt::format(
        "the {} slices are resampled onto a regular grid of {:.4g} mm: gantry tilt {:.1f} degrees, distances {:.3f} to "
        "{:.3f} mm",
        stack.slices.size(), stack.spacing, stack.report.tilt_degrees, stack.report.least_distance,
        stack.report.greatest_distance));
  }
  const Vec3 extent = high - low + Vec3::Ones();
  if (!(extent.maxCoeff() < 65536))
    refuse(first.file, "and its series span {:g} x {:g} x {:g} voxels", extent[0], extent[1], extent[2]);
  const Grid grid({static_cast<std::int32_t>(extent[0]), static_cast<std::int32_t>(extent[1]),
                   static_cast<std::int32_t>(extent[2])},
                  Vec3(p.dx, p.dy, stack.spacing),
                  p.position + direction * low.cwiseProduct(Vec3(p.dx, p.dy, stack.spacing)), direction);
  check_memory(first.file, grid.num_voxels() * sizeof(float), options);
  return grid;
}

/// Bilinear in a slice; NaN outside it.
double in_slice(const Slice& s, const std::vector<float>& values, const Vec3& position) {
  const Vec3 d = position - s.plane.position;
  double x = d.dot(s.plane.row) / s.plane.dx, y = d.dot(s.plane.column) / s.plane.dy;
  const int nx = s.extent[0], ny = s.extent[1];
  if (!(x >= -0.5 && y >= -0.5 && x <= nx - 0.5 && y <= ny - 0.5)) return std::numeric_limits<double>::quiet_NaN();
  x = std::clamp(x, 0.0, nx - 1.0);
  y = std::clamp(y, 0.0, ny - 1.0);
  const int i = std::min(static_cast<int>(x), std::max(nx - 2, 0)),
            j = std::min(static_cast<int>(y), std::max(ny - 2, 0));
  const int i1 = std::min(i + 1, nx - 1), j1 = std::min(j + 1, ny - 1);
  const auto at = [&](int a, int b) { return static_cast<double>(values[offset_in(s.extent, {a, b, 0})]); };
  const double u = x - i, v = y - j;
  return (1 - v) * ((1 - u) * at(i, j) + u * at(i1, j)) + v * ((1 - u) * at(i, j1) + u * at(i1, j1));
}

/// Linear between the two slices around each voxel, in the patient, so that tilt and gaps come out right.
std::vector<float> resample(const Stack& stack, const std::vector<std::vector<float>>& pixels, const Grid& grid) {
  float lowest = pixels[0][0];
  for (const auto& slice : pixels) lowest = std::min(lowest, *std::min_element(slice.begin(), slice.end()));
  std::vector<float> out(grid.num_voxels(), lowest);
  const Index3& extent = grid.extent();
  for (std::int32_t k = 0; k < extent[2]; ++k) {
    const double at = std::min(k * stack.spacing, stack.at.back());
    const auto above = std::upper_bound(stack.at.begin() + 1, stack.at.end() - 1, at);
    const auto upper = static_cast<std::size_t>(above - stack.at.begin()), lower = upper - 1;
    const double t = (at - stack.at[lower]) / (stack.at[upper] - stack.at[lower]);
    for (std::int32_t j = 0; j < extent[1]; ++j)
      for (std::int32_t i = 0; i < extent[0]; ++i) {
        const Vec3 p = grid.center({i, j, k});
        const double a = in_slice(stack.slices[lower], pixels[lower], p);
        const double b = in_slice(stack.slices[upper], pixels[upper], p);
        const double value = std::isnan(a)   ? (t > 0.5 ? b : a)
                             : std::isnan(b) ? (t <= 0.5 ? a : b)
                                             : (1 - t) * a + t * b;
        if (!std::isnan(value)) out[grid.offset({i, j, k})] = static_cast<float>(value);
      }
  }
  return out;
}

}  // namespace

Grid series_grid(const DicomSeries& series, const ReadOptions& options) {
  return grid_of(stack_of(series, options), options);
}

IntensityVolume read_series(const DicomSeries& series, const ReadOptions& options, SliceReport* report) {
  const Stack stack = stack_of(series, options);
  if (report) *report = stack.report;
  IntensityVolume out{grid_of(stack, options), {}};
  std::vector<std::vector<float>> pixels;
  std::map<fs::path, PixelFile> files;  // of several frames
  for (const Slice& s : stack.slices) {
    if (s.num_frames == 1) {
      pixels.push_back(PixelFile(s.file).frame(s));
    } else {
      pixels.push_back(files.try_emplace(s.file, s.file).first->second.frame(s));
    }
  }
  if (!stack.report.regular) {
    out.values = resample(stack, pixels, out.grid);
    return out;
  }
  out.values.reserve(out.grid.num_voxels());
  for (const auto& slice : pixels) out.values.insert(out.values.end(), slice.begin(), slice.end());
  return out;
}

}  // namespace hexmesh
