// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/view/slice.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>

#include "hexmesh/core/error.h"
#include "hexmesh/view/color_map.h"

namespace hexmesh {
namespace {

constexpr double surroundings_brightness = 0.45;
constexpr double line_pixels = 1.2, line_brightness = 0.35;  // of what is below
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

/// Whether a place is on a line of a grid that is fixed to the rest shape.
/// @param across    the axis nearest to the plane's normal: across it there would be whole planes of lines
/// @param distance  of the lines, as `width` [mm]
bool is_on_line(const Vec3& rest, Eigen::Index across, double distance, double width) {
  const Vec3 lines = rest / distance;
  Vec3 from_line = (lines - lines.array().round().matrix()).cwiseAbs() * distance;
  from_line[across] = width;
  return from_line.minCoeff() < width / 2;
}

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

Result magnified(Result result, double factor) {
  std::vector<std::vector<Vec3>*> fields = {&result.displacement, &result.surface_displacement};
  for (ConditionPoints& c : result.conditions) fields.push_back(&c.displacement);
  for (std::vector<Vec3>* field : fields)
    for (Vec3& u : *field) u *= factor;
  return result;
}

std::string unit_of_field(const std::string& name) {
  static const std::map<std::string, std::string> units = {
      {"displacement", "mm"}, {"strain_energy_density", "N/mm^2"}, {"von_mises_stress", "MPa"},
      {"pressure", "MPa"},    {"smoothed_pressure", "MPa"},        {"contact_pressure", "MPa"},
      {"contact_gap", "mm"},  {"rotation_degrees", "degrees"},     {"young_modulus", "MPa"}};
  const auto unit = units.find(name);
  return unit == units.end() ? "" : unit->second;
}

ColorRange color_range(const Result& result, const std::string& color_by, double magnified) {
  if (color_by == "displacement") {
    ColorRange out{0, 0, 0, 0};
    for (const Vec3& u : result.surface_displacement.empty() ? result.displacement : result.surface_displacement)
      out.high = std::max(out.high, u.norm() / magnified);
    out.greatest = out.high;
    return out;
  }
  const auto field = result.cell_fields.find(color_by);
  if (field == result.cell_fields.end()) {
    std::vector<std::string> names = {"displacement"};
    for (const auto& [name, values] : result.cell_fields) names.push_back(name);
    throw Error(ErrorKind::usage,
                fmt::format("no field '{}' in the result, expected one of: {}", color_by, fmt::join(names, ", ")));
  }
  std::vector<double> sorted = field->second;
  std::sort(sorted.begin(), sorted.end());
  const double low = sorted[sorted.size() / 100], high = sorted[sorted.size() - 1 - sorted.size() / 100];
  // Where values differ by rounding alone they are in the middle of a range.
  const double size = std::max(std::abs(sorted.front()), std::abs(sorted.back()));
  if (sorted.back() - sorted.front() <= 1e-9 * size)
    return {low - 0.05 * size, low + 0.05 * size, sorted.front(), sorted.back()};
  if (low == high) return {sorted.front(), sorted.back(), sorted.front(), sorted.back()};  // of few cells
  return {low, high, sorted.front(), sorted.back()};
}

ColorRange joined(const ColorRange& a, const ColorRange& b) {
  return {std::min(a.low, b.low), std::max(a.high, b.high), std::min(a.least, b.least),
          std::max(a.greatest, b.greatest)};
}

SliceRenderer::SliceRenderer(const Result& result, const IntensityVolume* scan, const SliceOptions& options)
    : result_(result),
      scan_(scan),
      options_(options),
      locator_(locator_of(result)),
      color_of_label_(65536),
      has_material_(65536),
      bounds_(options.bounds.value_or(bounds_of(result))) {
  for (const LatticeSegment& s : result.segments) {
    color_of_label_[s.segment.label] = to_rgb(s.segment.color);
    has_material_[s.segment.label] = s.material.has_value();
  }

  if (!options.color_by.empty()) {
    colors_ = options.colors ? *options.colors : color_range(result, options.color_by, options.magnified);
    if (!(colors_.high > colors_.low)) colors_.high = colors_.low + 1;
    if (options.color_by != "displacement") field_ = &result.cell_fields.at(options.color_by);
  }
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
  return locator_.cell_of_voxel(nearest_voxel(result_.voxels.continuous_index(rest)));
}

std::uint8_t SliceRenderer::faded(std::uint8_t grey) const {
  const double full = options_.white ? 255 : 0;
  return static_cast<std::uint8_t>(full + surroundings_brightness * (grey - full));
}

double SliceRenderer::color_value(const Vec3& rest, const Vec3& displacement) const {
  if (!field_) return displacement.norm() / options_.magnified;
  const std::int32_t cell = cell_at(rest);
  return cell < 0 ? colors_.low : (*field_)[cell];
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
        constexpr double flat = 0.9;
        const bool is_base = !options_.color_by.empty();  // of another colour's meaning
        const Rgb color = is_base ? Rgb{150, 150, 150} : color_of_label_[labels[n]].value_or(Rgb{200, 200, 200});
        for (std::size_t c = 0; c < 3; ++c) pixel[c] = static_cast<std::uint8_t>(flat * color[c]);
      } else if (const double around = scan_ ? value_at(*scan_, here) : NAN; !std::isnan(around) && !left_by_the_body) {
        pixel.fill(faded(grey(around)));
      }
      if (is_material && !options_.color_by.empty()) {
        const Rgb color = viridis((color_value(rest, step) - colors_.low) / (colors_.high - colors_.low));
        for (std::size_t c = 0; c < 3; ++c)
          pixel[c] = static_cast<std::uint8_t>(field_opacity * color[c] + (1 - field_opacity) * pixel[c]);
      }
      if (labels[n] != 0 && options_.grid_mm > 0 &&
          is_on_line(rest, across, options_.grid_mm, line_pixels * f.spacing()[0]))
        for (std::uint8_t& channel : pixel) channel = static_cast<std::uint8_t>(line_brightness * channel);
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
  add_target(f, canvas);
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

Canvas SliceRenderer::legend(int height) const {
  constexpr int bar = 14, edge = 4;
  const auto [unit, of_unit] = shown_unit();
  std::string title = options_.color_by + (unit.empty() ? "" : " [" + unit + "]");
  std::replace(title.begin(), title.end(), '_', ' ');
  Canvas out(std::max(legend_width, Canvas::text_width(title, font) + 2 * edge), height + font + 2 * edge,
             paper_of(options_));
  for (int y = 0; y < height; ++y) {
    const Rgb color = viridis(1 - static_cast<double>(y) / std::max(1, height - 1));
    for (int x = 0; x < bar; ++x) out.at(x, y) = color;
  }
  constexpr int ticks = 4;
  const Rgb ink = ink_of(options_);
  for (int n = 0; n <= ticks; ++n) {
    const int y = (height - 1) * n / ticks;
    const double value = of_unit * (colors_.high + (colors_.low - colors_.high) * n / ticks);
    out.line(bar, y, bar + 3, y, ink);
    const char* beyond = n == 0 && colors_.greatest > colors_.high   ? ">= "
                         : n == ticks && colors_.least < colors_.low ? "<= "
                                                                     : "";
    out.text(fmt::format("{}{:.3g}", beyond, value), bar + 6, std::clamp(y - font / 2, 0, std::max(0, height - font)),
             font, ink);
  }
  out.text(title, 0, height + edge, font, ink);
  return out;
}

std::pair<std::string, double> SliceRenderer::shown_unit() const {
  const std::string unit = unit_of_field(options_.color_by);
  if (unit == "MPa" && std::max(std::abs(colors_.low), std::abs(colors_.high)) < 0.1) return {"kPa", 1e3};
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
  std::optional<Canvas> beside;
  if (options_.legend && !options_.color_by.empty()) beside = legend(height);
  const Rgb ink = ink_of(options_);
  const Vec3 view = plane.right.cross(plane.down);
  Eigen::Index across = 0;
  const bool along_axis = view.cwiseAbs().maxCoeff(&across) > 1 - 1e-12;
  std::string place = along_axis ? fmt::format("{} {} = {:.1f} mm", plane.name, "LPS"[across],
                                               std::round(10 * plane.point[across]) / 10 + 0.0)
                                 : fmt::format("{} at ({:.0f}, {:.0f}, {:.0f}) mm", plane.name, plane.point[0],
                                               plane.point[1], plane.point[2]);
  if (!note.empty()) place += ", " + note;
  if (options_.magnified != 1) place += fmt::format(", displacement x {:g}", options_.magnified);
  const auto caption = [&](const Picture& p) { return fmt::format("{}: {}", p.caption, place); };
  int widest = width + 2 * letters;  // of a picture and its caption
  for (const Picture& p : pictures) widest = std::max(widest, 2 * letters + Canvas::text_width(caption(p), font));
  Canvas sheet(count * widest + (count - 1) * gap + (beside ? beside->width() : 0),
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
  if (beside) sheet.paste(*beside, left, header + letters);
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

Canvas SliceRenderer::contact_sheet(const std::vector<Canvas>& pictures) const {
  const Canvas all = hexmesh::contact_sheet(pictures, options_.white);
  if (options_.color_by.empty()) return all;
  const int around = header + 2 * letters + footer;
  const Canvas beside = legend(std::max(1, std::min(all.height(), pictures.front().height()) - around));
  Canvas sheet(all.width() + gap + beside.width(), all.height(), paper_of(options_));
  sheet.paste(all, 0, 0);
  sheet.paste(beside, all.width() + gap, header + letters);
  return sheet;
}

}  // namespace hexmesh
