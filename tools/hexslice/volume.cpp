// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/view/volume.h"

#include <fmt/format.h>
#include <omp.h>

#include <Eigen/Geometry>

#include "cli/parse.h"
#include "cli/progress.h"
#include "cli/result_state.h"
#include "commands.h"
#include "hexmesh/core/error.h"
#include "hexmesh/file/result_file.h"
#include "hexmesh/view/slice.h"

namespace hextools {
namespace {

using hexmesh::Error;
using hexmesh::ErrorKind;
using hexmesh::Vec3;

struct View {
  const char* name;
  Vec3 view, up;
};

/// From where the body is seen.
const std::array<View, 7> views = {{{"anterior", {0, 1, 0}, {0, 0, 1}},
                                    {"posterior", {0, -1, 0}, {0, 0, 1}},
                                    {"left", {-1, 0, 0}, {0, 0, 1}},
                                    {"right", {1, 0, 0}, {0, 0, 1}},
                                    {"superior", {0, 0, -1}, {0, -1, 0}},
                                    {"inferior", {0, 0, 1}, {0, -1, 0}},
                                    {"oblique", {0.6, 1, -0.5}, {0, 0, 1}}}};

struct Options {
  std::string input, scan, output, preset = "anterior", highlight;
  std::vector<std::string> show;
  std::vector<double> view, up;
  std::vector<int> size = {512};
  std::string background = "black";
  double magnified = 1;
  bool at_rest = false, flat = false, translucent = false;
  hexmesh::VolumeOptions volume;
};

double number(const std::string& text, const std::string& of) {
  const double value = parse_number<double>(text).value_or(-1);
  if (!(value >= 0 && value <= 1))
    throw Error(ErrorKind::usage, fmt::format("{} is '{}', expected a number from 0 to 1", of, text));
  return value;
}

std::uint16_t label_of(const hexmesh::Result& result, const std::string& name) {
  const hexmesh::LatticeSegment& segment = hexmesh::segment_named(result.segments, name);
  if (!segment.material)
    throw Error(ErrorKind::input,
                fmt::format("segment '{}' has no material, and so no cells to show, expected one that has", name));
  return segment.segment.label;
}

/// "opacity=0.05" or "color=0.8/0.3/0.2" of the segment of that name.
void apply_setting(const std::string& setting, const std::string& name, hexmesh::Appearance& look) {
  const auto [key, value] = key_and_value(setting);
  if (key == "opacity") {
    look.opacity = number(value, fmt::format("opacity of '{}'", name));
  } else if (key == "color") {
    const std::vector<std::string> parts = split(value, '/');
    if (parts.size() != 3)
      throw Error(ErrorKind::usage, fmt::format("color of '{}' is '{}', expected R/G/B, each 0 to 1", name, value));
    for (std::size_t c = 0; c < 3; ++c) look.color[c] = number(parts[c], fmt::format("color of '{}'", name));
  } else {
    throw Error(ErrorKind::usage, fmt::format("unknown key '{}' in --show, expected opacity or color", key));
  }
}

/// "liver:opacity=0.05,color=0.8/0.3/0.2"; "*" is every segment.
void apply(const std::string& text, const hexmesh::Result& result,
           std::map<std::uint16_t, hexmesh::Appearance>& looks) {
  const std::size_t colon = text.rfind(':');
  if (colon == std::string::npos)
    throw Error(ErrorKind::usage, fmt::format("--show is '{}', expected SEGMENT:opacity=0.05,color=R/G/B", text));
  const std::string name = text.substr(0, colon);
  std::vector<std::uint16_t> labels;
  if (name == "*")
    for (const auto& [label, look] : looks) labels.push_back(label);
  else
    labels.push_back(label_of(result, name));
  for (const std::string& setting : split(text.substr(colon + 1), ','))
    for (const std::uint16_t label : labels) apply_setting(setting, name, looks[label]);
}

void set_view(Options& o) {
  for (const View& v : views)
    if (o.preset == v.name) {
      o.volume.view = v.view;
      o.volume.up = v.up;
    }
  if (!o.view.empty()) o.volume.view = {o.view[0], o.view[1], o.view[2]};
  if (o.volume.view.norm() == 0) throw Error(ErrorKind::usage, "--direction is 0,0,0, expected a direction of view");
  if (!o.up.empty()) o.volume.up = {o.up[0], o.up[1], o.up[2]};
  const auto is_along = [&](const Vec3& up) {
    return o.volume.view.cross(up).norm() <= 1e-6 * o.volume.view.norm() * up.norm();
  };
  if (is_along(o.volume.up)) {
    if (!o.up.empty()) throw Error(ErrorKind::usage, "--up is along the direction of view, expected another one");
    o.volume.up = {0, -1, 0};
  }
}

/// Where the sides of the picture are in the patient, and what it shows.
void annotate(hexmesh::Canvas& picture, const Options& o, std::string caption, const std::string& note) {
  const Vec3 right = o.volume.view.cross(o.volume.up).normalized(), down = o.volume.view.normalized().cross(right);
  constexpr int font = 13, edge = 5;
  const std::uint8_t grey = o.background == "white" ? 0 : 255;
  const hexmesh::Rgb ink = {grey, grey, grey};
  const int middle_x = picture.width() / 2, middle_y = picture.height() / 2;
  picture.text(hexmesh::orientation_letters(-right), edge, middle_y, font, ink);
  picture.text_ending_at(hexmesh::orientation_letters(right), picture.width() - edge, middle_y, font, ink);
  picture.text(hexmesh::orientation_letters(-down), middle_x, edge, font, ink);
  picture.text(hexmesh::orientation_letters(down), middle_x, picture.height() - font - edge, font, ink);
  if (!note.empty()) caption += ", " + note;
  if (o.magnified != 1 && !o.at_rest) caption += fmt::format(", displacement x {:g}", o.magnified);
  picture.text(caption, edge, edge, font, ink);
}

int run_volume(Options& o, const CommonOptions& common, const Console& console) {
  set_view(o);
  if (o.output != "-" && !o.output.ends_with(".png"))
    throw Error(ErrorKind::usage, fmt::format("output '{}', expected a name that ends in .png", o.output));
  if (o.scan.empty() && (o.volume.level || o.volume.window))
    throw Error(ErrorKind::usage, "--level and --window are given without --scan: they choose its grey values");
  o.volume.width = o.size[0];
  o.volume.height = o.size.size() > 1 ? o.size[1] : o.size[0];
  o.volume.shaded = !o.flat;
  if (o.background == "white") o.volume.background = {255, 255, 255};
  RunFiles files(common);
  const Input& input = files.input(o.input);
  const Input* scan_file = files.input_if_named(o.scan);
  Output& output = files.output(o.output, Content::binary, ".png");
  const hexmesh::Result result = hexmesh::magnified(hexmesh::read_result(input.path()), o.magnified);
  warn_of_state(result, console);
  const std::optional<hexmesh::IntensityVolume> scan = read_scan_of(result, scan_file, console);
  o.volume.appearance = hexmesh::default_appearance(result, o.translucent || !o.highlight.empty());
  for (const std::string& text : o.show) apply(text, result, o.volume.appearance);
  if (!o.highlight.empty()) o.volume.appearance[label_of(result, o.highlight)] = {{1, 0.85, 0.1}, 0.5};

  at_work("drawing the volume");
  const double start = omp_get_wtime();
  const hexmesh::VolumeRenderer renderer(result, scan ? &*scan : nullptr, o.volume);
  const double ready = omp_get_wtime();
  hexmesh::Canvas picture = renderer.draw(o.at_rest ? std::vector<Vec3>{} : result.displacement);
  const double drawn = omp_get_wtime();
  annotate(picture, o, o.at_rest || is_preview(result) ? "at rest" : "deformed", state_note(result));
  picture.write_png(output.path());
  files.commit();
  console.note(fmt::format("{} x {} pixels, {} planes {:.3g} mm apart, {} cells: ready in {:.3f} s, drawn in {:.3f} s",
                           o.volume.width, o.volume.height, o.volume.planes, renderer.plane_distance(),
                           result.cells.size(), ready - start, drawn - ready));
  return 0;
}

}  // namespace

std::function<int()> declare_volume(CLI::App& app, const CommonOptions& common, const Console& console) {
  auto o = std::make_shared<Options>();
  app.add_option("result", o->input, "Result file of hexsolve; - is standard input")->required();
  app.add_option("--scan", o->scan,
                 "Grey values (NRRD, NIfTI, MetaImage, DICOM folder); without it each segment has one colour");
  app.add_option("--view", o->preset, "Seen from: anterior, posterior, left, right, superior, inferior or oblique")
      ->check(CLI::IsMember({"anterior", "posterior", "left", "right", "superior", "inferior", "oblique"}))
      ->capture_default_str();
  app.add_option("--direction", o->view, "Direction of view instead, x,y,z LPS")
      ->excludes("--view")
      ->delimiter(',')
      ->expected(3)
      ->check(finite_number);
  app.add_option("--up", o->up, "What is up on the picture, x,y,z LPS")
      ->delimiter(',')
      ->expected(3)
      ->check(finite_number);
  app.add_option("--perspective", o->volume.perspective, "Vertical angle of view [degrees]; 0 = orthographic")
      ->check(CLI::Range(0.0, 119.0))
      ->capture_default_str()
      ->check(finite_number);
  app.add_option("--size", o->size, "Pixels, N or WIDTH,HEIGHT [default: 512]")
      ->delimiter(',')
      ->expected(1, 2)
      ->check(CLI::Range(1, 4096));
  app.add_option("--planes", o->volume.planes, "Planes across the view; opacities are those of one of 101")
      ->check(CLI::Range(1, 10000))
      ->capture_default_str();
  add_repeated(app, "--show", o->show,
               "SEGMENT:opacity=0.05,color=0.8/0.3/0.2: how a segment looks; * is every segment, opacity 0 hides it");
  app.add_flag("--translucent", o->translucent, "Segments let others be seen through them");
  app.add_option("--highlight", o->highlight,
                 "A segment to show bright and dense, e.g. tumour; the others are translucent");
  app.add_option("--level", o->volume.level, "Middle of the grey window, in the scan's unit")->check(finite_number);
  app.add_option("--window", o->volume.window, "Width of the grey window")
      ->check(CLI::PositiveNumber)
      ->check(finite_number);
  app.add_option("--magnify", o->magnified, "Show the displacement so many times larger")
      ->check(positive_number)
      ->capture_default_str();
  app.add_option("--background", o->background, "Paper: black or white")
      ->check(CLI::IsMember({"black", "white"}))
      ->capture_default_str();
  app.add_flag("--rest", o->at_rest, "The body at rest, in the same frame");
  app.add_flag("--flat", o->flat, "Without light on surfaces");
  app.add_flag("--linear-opacity", o->volume.linear_opacity,
               "Opacity of N planes as alpha 101 / N, as in the paper, instead of 1 - (1 - alpha)^(101 / N)");
  app.add_option("-o,--output", o->output, "Picture (.png); - is standard output")->required();
  return [o, &common, &console] { return run_volume(*o, common, console); };
}

}  // namespace hextools
