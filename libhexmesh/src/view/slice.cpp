// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/view/slice.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>

#include "color_map.h"
#include "hexmesh/core/error.h"

namespace hexmesh {
namespace {

constexpr double surroundings_brightness = 0.45;
constexpr double rest_grid_mm = 10;
constexpr double field_opacity = 0.6;
constexpr int arrow_distance = 22;  // [pixels]
constexpr double most_pixels = 8192;
constexpr int header = 22, gap = 6, letters = 22, font = 13, footer = 18, legend_width = 104;
constexpr Rgb yellow = {255, 230, 60}, orange = {200, 80, 0}, lattice_color = {110, 170, 255};

Rgb paper_of(const SliceOptions& o) { return o.white ? Rgb{255, 255, 255} : Rgb{24, 24, 24}; }
Rgb ink_of(const SliceOptions& o) { return o.white ? Rgb{0, 0, 0} : Rgb{255, 255, 255}; }
Rgb nothing_of(bool white) { return white ? Rgb{255, 255, 255} : Rgb{0, 0, 0}; }

/// The frame's layout; see SliceRenderer::frame.
int width_of(const Grid& frame) { return frame.extent()[0]; }
int height_of(const Grid& frame) { return frame.extent()[1]; }

std::size_t number_of(const Grid& frame, int column, int row) { return frame.offset({column, row, 0}); }

Vec3 pixel_center(const Grid& frame, int column, int row) { return frame.position(Vec3(column, row, 0)); }

/// The largest of 1, 2, 5, 10, ... mm that is at most `limit`.
double round_length(double limit) {
  const double power = std::pow(10, std::floor(std::log10(limit)));
  for (const double digit : {5.0, 2.0})
    if (digit * power <= limit) return digit * power;
  return power;
}

void add_scale_bar(const Grid& frame, int left, int top, Rgb ink, Canvas& sheet) {
  const double pixel = frame.spacing()[0];
  const double length = round_length(width_of(frame) * pixel / 4);
  const int right = left + static_cast<int>(length / pixel);
  for (int y = top + 7; y < top + 10; ++y) sheet.line(left, y, right, y, ink);
  sheet.line(left, top + 4, left, top + 12, ink);
  sheet.line(right, top + 4, right, top + 12, ink);
  sheet.text(length < 1 ? fmt::format("{:g} um", 1000 * length) : fmt::format("{:g} mm", length), right + 6, top + 2,
             font, ink);
}

}  // namespace

std::string orientation_letters(const Vec3& direction) {
  constexpr std::array<std::array<char, 2>, 3> names = {{{'R', 'L'}, {'A', 'P'}, {'I', 'S'}}};  // towards -, +
  std::array<std::size_t, 3> order = {0, 1, 2};
  const Vec3 d = direction.normalized();
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return std::abs(d[a]) > std::abs(d[b]); });
  std::string out;
  for (const std::size_t axis : order) {
    const double part = d[axis];
    if (out.empty() || std::abs(part) > 0.26) out += names[axis][part > 0 ? 1 : 0];  // sin 15 degrees
  }
  return out;
}

SlicePlane plane_across(SliceAxis axis, double position) {
  const auto across = static_cast<Eigen::Index>(axis);
  SlicePlane plane;
  plane.name = axis == SliceAxis::axial ? "axial" : axis == SliceAxis::coronal ? "coronal" : "sagittal";
  plane.point = position * Vec3::Unit(across);
  plane.right = axis == SliceAxis::sagittal ? Vec3::UnitY() : Vec3::UnitX();
  plane.down = axis == SliceAxis::axial ? Vec3(Vec3::UnitY()) : Vec3(-Vec3::UnitZ());
  return plane;
}

SlicePlane oblique_plane(const Vec3& point, const Vec3& normal) {
  Eigen::Index nearest = 0;
  normal.cwiseAbs().maxCoeff(&nearest);
  const SlicePlane like = plane_across(static_cast<SliceAxis>(nearest), 0);
  Vec3 view = normal.normalized();
  if (view.dot(like.right.cross(like.down)) < 0) view = -view;
  SlicePlane plane{"oblique", point, {}, {}};
  plane.down = (like.down - like.down.dot(view) * view).normalized();
  plane.right = plane.down.cross(view);
  return plane;
}

Result magnified(Result result, double factor) {
  std::vector<std::vector<Vec3>*> fields = {&result.displacement, &result.surface_displacement};
  for (ConditionPoints& c : result.conditions) fields.push_back(&c.displacement);
  for (std::vector<Vec3>* field : fields)
    for (Vec3& u : *field) u *= factor;
  return result;
}

std::string unit_of_field(const std::string& name) {
  static const std::map<std::string, std::string> units = {
      {"displacement", "mm"},  {"strain_energy_density", "N/mm^2"}, {"von_mises_stress", "MPa"},
      {"pressure", "MPa"},     {"smoothed_pressure", "MPa"},        {"rotation_degrees", "degrees"},
      {"young_modulus", "MPa"}};
  const auto unit = units.find(name);
  return unit == units.end() ? "" : unit->second;
}

SliceRenderer::SliceRenderer(const Result& result, const IntensityVolume* scan, const SliceOptions& options)
    : result_(result),
      scan_(scan),
      options_(options),
      locator_(result.voxels, result.voxels_per_cell, result.cells),
      color_of_label_(65536),
      has_material_(65536),
      bounds_(options.bounds.value_or(bounds_of(result))) {
  for (const LatticeSegment& s : result.segments) {
    color_of_label_[s.segment.label] = to_rgb(s.segment.color);
    has_material_[s.segment.label] = s.material.has_value();
  }

  if (options.color_by == "displacement") {
    field_low_ = field_high_ = 0;
    for (const Vec3& u : result.surface_displacement.empty() ? result.displacement : result.surface_displacement)
      field_high_ = std::max(field_high_, u.norm() / options.magnified);
    field_high_ = options.color_max.value_or(field_high_);
  } else if (!options.color_by.empty()) {
    const auto field = result.cell_fields.find(options.color_by);
    if (field == result.cell_fields.end()) {
      std::vector<std::string> names = {"displacement"};
      for (const auto& [name, values] : result.cell_fields) names.push_back(name);
      throw Error(ErrorKind::usage, fmt::format("no field '{}' in the result, expected one of: {}", options.color_by,
                                                fmt::join(names, ", ")));
    }
    field_ = &field->second;
    std::vector<double> sorted = *field_;
    std::sort(sorted.begin(), sorted.end());
    field_low_ = sorted[sorted.size() / 100];
    field_high_ = sorted[sorted.size() - 1 - sorted.size() / 100];
    clipped_low_ = sorted.front() < field_low_;
    clipped_high_ = sorted.back() > field_high_;
  }
  if (!(field_high_ > field_low_)) field_high_ = field_low_ + 1;

  for (const SliceAxis axis : {SliceAxis::axial, SliceAxis::coronal, SliceAxis::sagittal})
    frame(plane_across(axis, 0));  // throws where pixels are too small
  if (scan) window_ = grey_window(result, *scan, options.level, options.window);
}

std::pair<double, double> SliceRenderer::range(const Vec3& direction) const {
  std::pair<double, double> out = {INFINITY, -INFINITY};
  for (int corner = 0; corner < 8; ++corner) {
    Vec3 p;
    for (int d = 0; d < 3; ++d) p[d] = corner_bit(corner, d) == 1 ? bounds_.high[d] : bounds_.low[d];
    out = {std::min(out.first, p.dot(direction)), std::max(out.second, p.dot(direction))};
  }
  return out;
}

/// One layer of voxels, the picture's pixels: columns along the first axis, rows along the second.
Grid SliceRenderer::frame(const SlicePlane& plane) const {
  const auto [left, right] = range(plane.right);
  const auto [top, bottom] = range(plane.down);
  const double margin = options_.margin_mm;
  const Vec3 size(right - left + 2 * margin, bottom - top + 2 * margin, 0);
  const double pixel = options_.pixel_mm > 0 ? options_.pixel_mm : size.maxCoeff() / options_.size;
  Mat3 axes;
  axes << plane.right, plane.down, plane.right.cross(plane.down);
  const Vec3 origin = axes * Vec3(left - margin, top - margin, plane.point.dot(axes.col(2)));
  if (!(size.maxCoeff() / pixel <= most_pixels))
    throw Error(ErrorKind::usage,
                fmt::format("pixels of {:g} mm make pictures of {:.0f} pixels a side, expected at most "
                            "{:.0f}, or pixels of {:.2g} mm",
                            pixel, size.maxCoeff() / pixel, most_pixels, size.maxCoeff() / most_pixels));
  return Grid({std::max(1, static_cast<int>(size[0] / pixel)), std::max(1, static_cast<int>(size[1] / pixel)), 1},
              Vec3::Constant(pixel), origin, axes);
}

std::uint8_t SliceRenderer::grey(double value) const {
  if (std::isnan(value)) return 0;
  return static_cast<std::uint8_t>(std::lround(255 * window_.brightness(value)));
}

std::int32_t SliceRenderer::cell_at(const Vec3& rest) const {
  const Vec3 index = result_.voxels.continuous_index(rest);
  return locator_.cell_of_voxel({static_cast<std::int32_t>(std::lround(index[0])),
                                 static_cast<std::int32_t>(std::lround(index[1])),
                                 static_cast<std::int32_t>(std::lround(index[2]))});
}

std::uint8_t SliceRenderer::faded(std::uint8_t grey) const {
  const double full = options_.white ? 255 : 0;
  return static_cast<std::uint8_t>(full + surroundings_brightness * (grey - full));
}

double SliceRenderer::color_value(const Vec3& rest, const Vec3& displacement) const {
  if (!field_) return displacement.norm() / options_.magnified;
  const std::int32_t cell = cell_at(rest);
  return cell < 0 ? field_low_ : (*field_)[cell];
}

Canvas SliceRenderer::paint(const Grid& f, const DisplacementField& field, bool deformed) const {
  const int width = width_of(f), height = height_of(f);
  Canvas canvas(width, height, nothing_of(options_.white));
  Eigen::Index across = 0;
  f.direction().col(2).cwiseAbs().maxCoeff(&across);
  std::vector<std::uint16_t> labels(f.num_voxels());
  std::vector<std::int32_t> cells(f.num_voxels(), -1);
  for (int row = 0; row < height; ++row)
    for (int column = 0; column < width; ++column) {
      const std::size_t n = number_of(f, column, row);
      Rgb& pixel = canvas.at(column, row);
      const Vec3 here = pixel_center(f, column, row);
      const Vec3 step = field.values[n].cast<double>();
      const bool is_material = !std::isnan(step[0]);
      const Vec3 rest = deformed && is_material ? Vec3(here + step) : here;
      const std::uint16_t label_here = label_at(result_.voxels, result_.labels, here);
      labels[n] = !deformed     ? label_here
                  : is_material ? label_at(result_.voxels, result_.labels, rest)
                                : std::uint16_t{0};
      if (is_material) cells[n] = cell_at(rest);
      const bool left_by_the_body = deformed && !is_material && has_material_[label_here] && cell_at(here) >= 0;
      if (labels[n] != 0 && scan_) {
        pixel.fill(grey(value_at(*scan_, rest)));
      } else if (labels[n] != 0) {
        // Lines of the two axes that run most within the plane; across the third there would be whole planes of them.
        const Vec3 lines = rest / rest_grid_mm;
        Vec3 from_line = (lines - lines.array().round().matrix()).cwiseAbs() * rest_grid_mm;
        from_line[across] = rest_grid_mm;
        const double brightness = from_line.minCoeff() < 0.6 ? 0.35 : 0.9;
        const bool is_base = !options_.color_by.empty();  // of another colour's meaning
        const Rgb color = is_base ? Rgb{150, 150, 150} : color_of_label_[labels[n]].value_or(Rgb{200, 200, 200});
        for (std::size_t c = 0; c < 3; ++c) pixel[c] = static_cast<std::uint8_t>(brightness * color[c]);
      } else if (const double around = scan_ ? value_at(*scan_, here) : NAN; !std::isnan(around) && !left_by_the_body) {
        pixel.fill(faded(grey(around)));
      }
      if (is_material && !options_.color_by.empty()) {
        const Rgb color = viridis((color_value(rest, step) - field_low_) / (field_high_ - field_low_));
        for (std::size_t c = 0; c < 3; ++c)
          pixel[c] = static_cast<std::uint8_t>(field_opacity * color[c] + (1 - field_opacity) * pixel[c]);
      }
    }
  // Borders: pixels that differ from the one to the right or below.
  const auto differs = [&](const auto& what, int column, int row) {
    const auto& here = what[number_of(f, column, row)];
    return here != what[number_of(f, column + 1, row)] || here != what[number_of(f, column, row + 1)];
  };
  for (int row = 0; row + 1 < height; ++row)
    for (int column = 0; column + 1 < width; ++column) {
      if (options_.lattice && differs(cells, column, row)) canvas.at(column, row) = lattice_color;
      if (options_.outlines && differs(labels, column, row)) {
        const std::uint16_t label = std::max({labels[number_of(f, column, row)], labels[number_of(f, column + 1, row)],
                                              labels[number_of(f, column, row + 1)]});
        canvas.at(column, row) = color_of_label_[label].value_or(ink_of(options_));
      }
    }
  if (options_.arrows) add_arrows(f, field, deformed, canvas);
  if (options_.scene) add_scene(f, deformed, canvas);
  return canvas;
}

void SliceRenderer::add_arrows(const Grid& f, const DisplacementField& field, bool deformed, Canvas& canvas) const {
  const Rgb color = options_.white ? orange : yellow;
  for (int row = arrow_distance / 2; row < height_of(f); row += arrow_distance)
    for (int column = arrow_distance / 2; column < width_of(f); column += arrow_distance) {
      const Vec3 step = field.values[number_of(f, column, row)].cast<double>();
      if (std::isnan(step[0])) continue;
      // The field leads to the rest shape in the deformed picture, and from it in the other.
      const Vec3 pixels = f.direction().transpose() * step / f.spacing()[0];
      const int other_column = column + static_cast<int>(std::lround(pixels[0]));
      const int other_row = row + static_cast<int>(std::lround(pixels[1]));
      if (deformed)
        canvas.arrow(other_column, other_row, column, row, color);
      else
        canvas.arrow(column, row, other_column, other_row, color);
    }
}

void SliceRenderer::add_legend(Canvas& sheet, int left, int top, int height) const {
  constexpr int bar = 14;
  for (int y = 0; y < height; ++y) {
    const Rgb color = viridis(1 - static_cast<double>(y) / std::max(1, height - 1));
    for (int x = 0; x < bar; ++x) sheet.at(left + x, top + y) = color;
  }
  constexpr int ticks = 4;
  const Rgb ink = ink_of(options_);
  const double of_unit = shown_unit().second;
  for (int n = 0; n <= ticks; ++n) {
    const int y = top + (height - 1) * n / ticks;
    const double value = of_unit * (field_high_ + (field_low_ - field_high_) * n / ticks);
    sheet.line(left + bar, y, left + bar + 3, y, ink);
    const char* beyond = n == 0 && clipped_high_ ? ">= " : n == ticks && clipped_low_ ? "<= " : "";
    sheet.text(fmt::format("{}{:.3g}", beyond, value), left + bar + 6,
               std::min(std::max(y - font / 2, top), std::max(top, top + height - font)), font, ink);
  }
}

std::pair<std::string, double> SliceRenderer::shown_unit() const {
  const std::string unit = unit_of_field(options_.color_by);
  if (unit == "MPa" && std::max(std::abs(field_low_), std::abs(field_high_)) < 0.1) return {"kPa", 1e3};
  return {unit, 1};
}

Canvas SliceRenderer::draw(const SlicePlane& plane, const std::string& note) const {
  const Grid f = frame(plane);
  struct Picture {
    Canvas canvas;
    const char* caption;
  };
  std::vector<Picture> pictures;
  if (options_.before) pictures.push_back({paint(f, displacement_from_rest(result_, f), false), "before"});
  if (options_.deformed) pictures.push_back({paint(f, displacement_to_rest(result_, f), true), "deformed"});

  const int width = width_of(f), height = height_of(f), count = static_cast<int>(pictures.size());
  const bool has_legend = !options_.color_by.empty();
  const Rgb ink = ink_of(options_);
  const Vec3 view = plane.right.cross(plane.down);
  Eigen::Index across = 0;
  const bool along_axis = view.cwiseAbs().maxCoeff(&across) > 1 - 1e-12;
  std::string place = along_axis ? fmt::format("{} {} = {:.1f} mm", plane.name, "LPS"[across], plane.point[across])
                                 : fmt::format("{} at ({:.0f}, {:.0f}, {:.0f}) mm", plane.name, plane.point[0],
                                               plane.point[1], plane.point[2]);
  if (!note.empty()) place += ", " + note;
  if (options_.magnified != 1) place += fmt::format(", displacement x {:g}", options_.magnified);
  const auto caption = [&](const Picture& p) { return fmt::format("{}: {}", p.caption, place); };
  int widest = width + 2 * letters;  // of a picture and its caption
  for (const Picture& p : pictures) widest = std::max(widest, 2 * letters + Canvas::text_width(caption(p), font));
  Canvas sheet(count * widest + (count - 1) * gap + (has_legend ? legend_width : 0),
               height + header + 2 * letters + footer, paper_of(options_));
  int left = 0;
  for (const Picture& p : pictures) {
    const int x = left + letters, y = header + letters;
    sheet.paste(p.canvas, x, y);
    sheet.text(caption(p), x, 5, font, ink);
    sheet.text(orientation_letters(-plane.right), left + 3, y + height / 2 - font / 2, font, ink);
    sheet.text(orientation_letters(plane.right), x + width + 3, y + height / 2 - font / 2, font, ink);
    sheet.text(orientation_letters(-plane.down), x + width / 2 - 4, header + 4, font, ink);
    sheet.text(orientation_letters(plane.down), x + width / 2 - 4, y + height + 3, font, ink);
    add_scale_bar(f, x, y + height + letters - 2, ink, sheet);
    left += widest + gap;
  }
  if (has_legend) {
    add_legend(sheet, left, header + letters, height);
    const std::string unit = shown_unit().first;
    std::string name = options_.color_by;
    std::replace(name.begin(), name.end(), '_', ' ');
    sheet.text_ending_at(name + (unit.empty() ? "" : " [" + unit + "]"), sheet.width() - 4,
                         header + letters + height + 4, font, ink);
  }
  return sheet;
}

Canvas contact_sheet(const std::vector<Canvas>& pictures, bool white) {
  int width = 1, height = 1;
  for (const Canvas& p : pictures) {
    width = std::max(width, p.width());
    height = std::max(height, p.height());
  }
  const double count = static_cast<double>(pictures.size());
  const int columns = std::max(1, static_cast<int>(std::ceil(std::sqrt(count * height / width))));
  const int rows = static_cast<int>(std::ceil(count / columns));
  Canvas sheet(columns * (width + gap) - gap, rows * (height + gap) - gap, nothing_of(white));
  for (int n = 0; n < static_cast<int>(pictures.size()); ++n)
    sheet.paste(pictures[n], n % columns * (width + gap), n / columns * (height + gap));
  return sheet;
}

}  // namespace hexmesh
