// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/view/slice.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "hexmesh/lattice/shape.h"

namespace hexmesh {
namespace {

const Vec3 nowhere = Vec3::Constant(std::numeric_limits<double>::quiet_NaN());
constexpr double surroundings_brightness = 0.45;
constexpr double rest_grid_mm = 10;

/// A cell's node positions and their inverse trilinear map.
struct DeformedCell {
  Eigen::Matrix<double, 3, 8> corners;

  /// Local coordinates of x, if the cell holds it; Newton's method from the centre.
  std::optional<Vec3> locate(const Vec3& x) const {
    Vec3 s = Vec3::Constant(0.5);
    for (int iteration = 0; iteration < 12; ++iteration) {
      const Vec3 miss = x - corners * shape_functions(s);
      const Mat3 jacobian = corners * shape_gradients(s);
      if (!(std::abs(jacobian.determinant()) > 1e-12)) return std::nullopt;
      const Vec3 step = jacobian.inverse() * miss;
      s += step;
      if (!(s.lpNorm<Eigen::Infinity>() < 10)) return std::nullopt;
      if (step.lpNorm<Eigen::Infinity>() < 1e-6) break;
    }
    constexpr double tolerance = 1e-4;
    if (s.minCoeff() < -tolerance || s.maxCoeff() > 1 + tolerance) return std::nullopt;
    return s;
  }
};

}  // namespace

/// Where the pixels of a picture are: x = origin + column right + row down.
struct SliceRenderer::Frame {
  int width, height;
  Vec3 origin, right, down;  ///< [mm]; right and down per pixel

  Vec3 at(int column, int row) const { return origin + column * right + row * down; }
  std::size_t number(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(width) + static_cast<std::size_t>(column);
  }
};

SliceRenderer::SliceRenderer(const Result& result, const IntensityVolume* scan, const SliceOptions& options)
    : result_(result), scan_(scan), options_(options), color_of_label_(65536) {
  for (const LatticeSegment& s : result.segments) {
    Rgb color;
    for (std::size_t c = 0; c < 3; ++c)
      color[c] = static_cast<std::uint8_t>(std::lround(255 * std::clamp(s.segment.color[c], 0.0, 1.0)));
    color_of_label_[s.segment.label] = color;
  }
  low_ = high_ = result.nodes.front();
  const auto include = [&](const Vec3& p) {
    low_ = low_.cwiseMin(p);
    high_ = high_.cwiseMax(p);
  };
  // The surface rather than the nodes: those of slivers move without meaning.
  for (std::size_t n = 0; n < result.surface.points.size(); ++n) {
    if (n == 0) low_ = high_ = result.surface.points[0];
    include(result.surface.points[n]);
    include(result.surface.points[n] + result.surface_displacement[n]);
  }
  if (result.surface.points.empty())
    for (std::size_t n = 0; n < result.nodes.size(); ++n) {
      include(result.nodes[n]);
      include(result.nodes[n] + result.displacement[n]);
    }

  if (!scan) return;
  // All of the body is told apart; what is darker or brighter has the outer thirds of the grey range.
  std::vector<float> inside;
  for (std::size_t n = 0; n < result.labels.size(); n += 7) {
    if (result.labels[n] == 0) continue;
    const Index3 v = result.voxels.index(n);
    inside.push_back(static_cast<float>(value_at(*scan_, result.voxels.position(Vec3(v[0], v[1], v[2])))));
  }
  double low = 0, high = 1;
  if (!inside.empty()) {
    std::sort(inside.begin(), inside.end());
    low = inside[inside.size() / 500];
    high = std::max<double>(inside[inside.size() - 1 - inside.size() / 500], low + 1);
  }
  const double level = options.level.value_or((low + high) / 2);
  const double window = options.window.value_or(3 * (high - low));
  black_ = level - window / 2;
  white_ = level + window / 2;
}

std::pair<double, double> SliceRenderer::range(SliceAxis axis) const {
  return {low_[static_cast<int>(axis)], high_[static_cast<int>(axis)]};
}

std::uint16_t SliceRenderer::label_at(const Vec3& rest) const {
  const Vec3 index = result_.voxels.continuous_index(rest);
  Index3 voxel;
  for (int d = 0; d < 3; ++d) voxel[static_cast<std::size_t>(d)] = static_cast<std::int32_t>(std::lround(index[d]));
  return result_.voxels.contains(voxel) ? result_.labels[result_.voxels.offset(voxel)] : std::uint16_t{0};
}

std::uint8_t SliceRenderer::grey(double value) const {
  if (std::isnan(value)) return 0;
  return static_cast<std::uint8_t>(std::lround(255 * std::clamp((value - black_) / (white_ - black_), 0.0, 1.0)));
}

SliceRenderer::Frame SliceRenderer::frame(SliceAxis axis, double position) const {
  const Vec3 low = low_ - Vec3::Constant(options_.margin_mm), high = high_ + Vec3::Constant(options_.margin_mm);
  const int across = static_cast<int>(axis);
  const int right = axis == SliceAxis::sagittal ? 1 : 0;
  const int down = axis == SliceAxis::axial ? 1 : 2;
  const bool head_up = down == 2;
  const double pixel = options_.pixel_mm > 0 ? options_.pixel_mm : (high - low).maxCoeff() / 420;
  Frame f;
  f.width = std::clamp(static_cast<int>((high - low)[right] / pixel), 1, 8192);
  f.height = std::clamp(static_cast<int>((high - low)[down] / pixel), 1, 8192);
  f.right = pixel * Vec3::Unit(right);
  f.down = (head_up ? -pixel : pixel) * Vec3::Unit(down);
  f.origin = low;
  f.origin[across] = position;
  if (head_up) f.origin[down] = high[down];
  return f;
}

std::vector<Vec3> SliceRenderer::rest_positions_before(const Frame& f) const {
  std::vector<Vec3> rest;
  for (int row = 0; row < f.height; ++row)
    for (int column = 0; column < f.width; ++column) rest.push_back(f.at(column, row));
  return rest;
}

std::vector<Vec3> SliceRenderer::rest_positions_after(const Frame& f) const {
  std::vector<Vec3> rest(f.number(0, f.height), nowhere);
  const Vec3 normal = f.right.cross(f.down).normalized();
  const double pixel = f.right.norm();
  for (std::size_t c = 0; c < result_.cells.size(); ++c) {
    DeformedCell cell;
    for (int a = 0; a < num_cell_nodes; ++a) {
      const auto node = static_cast<std::size_t>(result_.cell_nodes[c][static_cast<std::size_t>(a)]);
      cell.corners.col(a) = result_.nodes[node] + result_.displacement[node] - f.origin;
    }
    const Eigen::Matrix<double, 1, 8> height = normal.transpose() * cell.corners;
    if (height.minCoeff() > 0 || height.maxCoeff() < 0) continue;
    const Eigen::Matrix<double, 1, 8> columns = f.right.transpose() * cell.corners / (pixel * pixel);
    const Eigen::Matrix<double, 1, 8> rows = f.down.transpose() * cell.corners / (pixel * pixel);
    const int first_column = std::max(0, static_cast<int>(std::ceil(columns.minCoeff())));
    const int last_column = std::min(f.width - 1, static_cast<int>(std::floor(columns.maxCoeff())));
    const int first_row = std::max(0, static_cast<int>(std::ceil(rows.minCoeff())));
    const int last_row = std::min(f.height - 1, static_cast<int>(std::floor(rows.maxCoeff())));
    for (int row = first_row; row <= last_row; ++row)
      for (int column = first_column; column <= last_column; ++column) {
        const std::optional<Vec3> s = cell.locate(column * f.right + row * f.down);
        if (!s) continue;
        // Cells are axis-aligned boxes of voxels at rest.
        Vec3 index;
        for (int d = 0; d < 3; ++d) {
          const auto e = static_cast<std::size_t>(d);
          index[d] = (result_.cells[c][e] + (*s)[d]) * result_.voxels_per_cell[e] - 0.5;
        }
        const Vec3 x = result_.voxels.position(index);
        // Where deformed cells overlap, material wins over the empty part of a boundary cell.
        Vec3& there = rest[f.number(column, row)];
        if (std::isnan(there[0]) || label_at(there) == 0) there = x;
      }
  }
  // The empty part of boundary cells is not material.
  for (Vec3& x : rest)
    if (!std::isnan(x[0]) && label_at(x) == 0) x = nowhere;
  return rest;
}

Canvas SliceRenderer::draw(const Frame& f, const std::vector<Vec3>& rest) const {
  Canvas canvas(f.width, f.height);
  std::vector<std::uint16_t> labels(rest.size());
  for (std::size_t n = 0; n < rest.size(); ++n)
    labels[n] = std::isnan(rest[n][0]) ? std::uint16_t{0} : label_at(rest[n]);
  for (int row = 0; row < f.height; ++row)
    for (int column = 0; column < f.width; ++column) {
      const std::size_t n = f.number(column, row);
      Rgb& pixel = canvas.at(column, row);
      const Vec3 here = f.at(column, row);
      if (labels[n] != 0 && scan_) {
        pixel.fill(grey(value_at(*scan_, rest[n])));
      } else if (labels[n] != 0) {
        const Vec3 lines = rest[n] / rest_grid_mm;
        const double from_line = (lines - lines.array().round().matrix()).cwiseAbs().minCoeff() * rest_grid_mm;
        const double brightness = from_line < 0.6 ? 0.35 : 0.9;
        const Rgb color = color_of_label_[labels[n]].value_or(Rgb{200, 200, 200});
        for (std::size_t c = 0; c < 3; ++c) pixel[c] = static_cast<std::uint8_t>(brightness * color[c]);
      } else if (scan_ && label_at(here) == 0) {
        pixel.fill(static_cast<std::uint8_t>(surroundings_brightness * grey(value_at(*scan_, here))));
      }
    }
  // Outlines: pixels whose label differs from the one to the right or below.
  for (int row = 0; row + 1 < f.height; ++row)
    for (int column = 0; column + 1 < f.width; ++column) {
      const std::uint16_t a = labels[f.number(column, row)];
      for (const std::uint16_t b : {labels[f.number(column + 1, row)], labels[f.number(column, row + 1)]})
        if (a != b) canvas.at(column, row) = color_of_label_[std::max(a, b)].value_or(Rgb{255, 255, 255});
    }
  return canvas;
}

Canvas SliceRenderer::before_and_after(SliceAxis axis, double position) const {
  const Frame f = frame(axis, position);
  const Canvas before = draw(f, rest_positions_before(f));
  const Canvas after = draw(f, rest_positions_after(f));

  constexpr int header = 22, gap = 6, letters = 16, font = 13;
  Canvas sheet(2 * (f.width + 2 * letters) + gap, f.height + header + 2 * letters, {24, 24, 24});
  constexpr std::array<const char*, 3> names = {"sagittal", "coronal", "axial"};
  constexpr std::array<std::array<const char*, 4>, 3> sides = {
      {{"A", "P", "S", "I"}, {"R", "L", "S", "I"}, {"R", "L", "A", "P"}}};  // left, right, top, bottom
  const auto number = static_cast<std::size_t>(axis);
  int left = 0;
  for (const auto& [picture, caption] : {std::pair{&before, "before"}, std::pair{&after, "deformed"}}) {
    sheet.paste(*picture, left + letters, header + letters);
    sheet.text(fmt::format("{}: {} {} = {:.1f} mm", caption, names[number], "LPS"[number], position), left + letters, 5,
               font);
    const int middle_x = left + letters + f.width / 2, middle_y = header + letters + f.height / 2;
    sheet.text(sides[number][0], left + 3, middle_y - font / 2, font);
    sheet.text(sides[number][1], left + letters + f.width + 3, middle_y - font / 2, font);
    sheet.text(sides[number][2], middle_x - 4, header + 2, font);
    sheet.text(sides[number][3], middle_x - 4, header + letters + f.height + 2, font);
    left += f.width + 2 * letters + gap;
  }
  return sheet;
}

}  // namespace hexmesh
