// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <set>

#include "cli/result_state.h"
#include "cli/result_steps.h"
#include "cli/tool.h"
#include "hexmesh/core/error.h"
#include "hexmesh/scan/image_io.h"
#include "hexmesh/view/slice.h"
#include "hexslice_volume.h"

namespace {

using namespace hextools;
using hexmesh::Canvas;
using hexmesh::Error;
using hexmesh::ErrorKind;
using hexmesh::SliceAxis;
using hexmesh::SlicePlane;
using hexmesh::Vec3;

struct Options {
  std::string input, scan, output;
  std::vector<std::string> axes;
  int count = 3;
  double every = 0;
  std::optional<double> at;
  std::vector<double> normal, point;
  std::string only;
  bool no_outlines = false, contact_sheet = false;
  hexmesh::SliceOptions slice;
};

/// The planes of one direction.
struct Stack {
  std::string name;
  Vec3 across;  ///< unit vector
  std::vector<SlicePlane> planes;
};

SliceAxis axis_named(const std::string& name) {
  return name == "axial" ? SliceAxis::axial : name == "coronal" ? SliceAxis::coronal : SliceAxis::sagittal;
}

/// From where to where the body reaches along a direction, at rest and deformed [mm].
std::pair<double, double> reach_of(const hexmesh::Result& result, const Vec3& direction) {
  std::pair<double, double> out = {INFINITY, -INFINITY};
  const auto include = [&](const std::vector<Vec3>& points, const std::vector<Vec3>& displacement) {
    for (std::size_t n = 0; n < points.size(); ++n)
      for (const double d : {direction.dot(points[n]), direction.dot(points[n] + displacement[n])})
        out = {std::min(out.first, d), std::max(out.second, d)};
  };
  include(result.surface.points, result.surface_displacement);
  if (result.surface.points.empty()) include(result.nodes, result.displacement);
  return out;
}

/// @throws Error{usage} where a plane misses the body, naming where it is
void check_place(double place, const std::pair<double, double>& range, const char* option) {
  if (place >= range.first && place <= range.second) return;
  throw Error(ErrorKind::usage, fmt::format("{} is at {:g} mm, expected within the body, {:.1f} to {:.1f} mm", option,
                                            place, range.first, range.second));
}

/// Places along a direction as --at, --every and --count ask for.
std::vector<double> places(const Options& o, const std::pair<double, double>& range) {
  if (o.at) {
    check_place(*o.at, range, "--at");
    return {*o.at};
  }
  if (o.every > 0 && (range.second - range.first) / o.every > 2000)
    throw Error(ErrorKind::usage, fmt::format("--every {:g} makes {:.3g} slices, expected at most 2000", o.every,
                                              (range.second - range.first) / o.every));
  std::vector<double> out;
  if (o.every > 0)
    for (double n = std::ceil(range.first / o.every); n * o.every <= range.second; ++n) out.push_back(n * o.every);
  else
    for (int n = 1; n <= o.count; ++n) out.push_back(range.first + (range.second - range.first) * n / (o.count + 1));
  return out;
}

std::vector<Stack> make_stacks(const Options& o, const hexmesh::Result& result) {
  std::vector<Stack> stacks;
  if (!o.normal.empty()) {
    const Vec3 normal = Vec3(o.normal[0], o.normal[1], o.normal[2]).normalized();
    Stack stack{"oblique", normal, {}};
    if (!o.point.empty()) {
      check_place(normal.dot(Vec3(o.point[0], o.point[1], o.point[2])), reach_of(result, normal),
                  "--point along --normal");
      stack.planes.push_back(hexmesh::oblique_plane({o.point[0], o.point[1], o.point[2]}, normal));
    } else {
      // Through the line along the normal that passes the middle of the body.
      const hexmesh::Bounds bounds = hexmesh::bounds_of(result);
      const Vec3 middle = (bounds.low + bounds.high) / 2;
      for (const double place : places(o, reach_of(result, normal)))
        stack.planes.push_back(hexmesh::oblique_plane(middle + (place - middle.dot(normal)) * normal, normal));
    }
    stacks.push_back(std::move(stack));
    return stacks;
  }
  const std::vector<std::string> axes =
      o.axes.empty() ? std::vector<std::string>{"axial", "coronal", "sagittal"} : o.axes;
  for (const std::string& name : axes) {
    const SliceAxis axis = axis_named(name);
    Stack stack{name, Vec3::Unit(static_cast<int>(axis)), {}};
    for (const double place : places(o, reach_of(result, stack.across)))
      stack.planes.push_back(hexmesh::plane_across(axis, place));
    if (stack.planes.empty())
      throw Error(ErrorKind::usage,
                  fmt::format("--every {:g} meets the body in no {} slice, expected less", o.every, name));
    stacks.push_back(std::move(stack));
  }
  return stacks;
}

void check_options(Options& o) {
  if (o.output == "-") throw Error(ErrorKind::usage, "-o is -, expected a folder for the pictures");
  if (o.scan == "-" && o.input == "-")
    throw Error(ErrorKind::usage, "the result and --scan are both -, expected one of them at most");
  if (o.scan.empty() && (o.slice.level || o.slice.window))
    throw Error(ErrorKind::usage, "--level and --window are given without --scan: they choose its grey values");
  if (!o.normal.empty() && Vec3(o.normal[0], o.normal[1], o.normal[2]).norm() == 0)
    throw Error(ErrorKind::usage, "--normal is 0,0,0, expected a direction");
  if (!o.point.empty() && o.normal.empty())
    throw Error(ErrorKind::usage, "--point goes with --normal: the plane through that point");
  if (o.at && o.axes.size() != 1)
    throw Error(ErrorKind::usage, fmt::format("--at goes with one --axis, but there are {}", o.axes.size()));
  if (std::set(o.axes.begin(), o.axes.end()).size() != o.axes.size())
    throw Error(ErrorKind::usage, "an --axis is given twice, expected each once");
  o.slice.before = o.only != "deformed";
  o.slice.deformed = o.only != "before";
  o.slice.outlines = !o.no_outlines;
}

void make_folder(const std::string& name) {
  std::error_code failed;
  std::filesystem::create_directories(name, failed);
  if (!std::filesystem::is_directory(name))
    throw Error(ErrorKind::output, fmt::format("cannot make the folder '{}', expected a writable place", name));
}

/// Pictures in the output folder; all names are free before the first is taken.
class Pictures {
public:
  Pictures(const Options& o, const CommonOptions& common, std::vector<std::string> names)
      : o_(o), common_(common), names_(std::move(names)) {
    make_folder(o.output);
    for (const std::string& name : names_) open_output(path(name), ".png", common_, {});
    if (common.force) remove_older();
  }
  void write(const std::string& name, const Canvas& picture) const {
    const auto file = open_output(path(name), ".png", common_, {o_.input, o_.scan});
    picture.write_png(file->path());
    file->commit();
  }
  std::size_t size() const { return names_.size(); }

private:
  /// Pictures of an earlier, longer series of the same names, which --force replaces as a whole.
  void remove_older() const {
    for (const std::string& name : names_) {
      const std::size_t digits = name.find_last_of('_') + 1;
      if (digits == 0 || name != names_.back()) continue;
      const std::size_t width = name.find('.') - digits;
      for (int n = std::stoi(name.substr(digits)) + 1;; ++n)
        if (!std::filesystem::remove(path(fmt::format("{}{:0{}}.png", name.substr(0, digits), n, width)))) break;
    }
  }
  std::string path(const std::string& name) const { return (std::filesystem::path(o_.output) / name).string(); }

  const Options& o_;
  const CommonOptions& common_;
  std::vector<std::string> names_;
};

int run_planes(Options& o, const CommonOptions& common, const Console& console) {
  check_options(o);
  const hexmesh::InputFile input(o.input);
  const hexmesh::Result result = hexmesh::read_result(input.path());
  warn_of_state(result, console);
  const std::optional<hexmesh::IntensityVolume> scan = read_scan_of(result, o.scan, console);
  const hexmesh::SliceRenderer renderer(result, scan ? &*scan : nullptr, o.slice);
  const std::vector<Stack> stacks = make_stacks(o, result);
  const std::string note = state_note(result);

  std::vector<std::string> names;
  for (const Stack& stack : stacks) {
    if (o.contact_sheet) names.push_back(stack.name + ".png");
    for (std::size_t n = 1; n <= stack.planes.size() && !o.contact_sheet; ++n)
      names.push_back(fmt::format("{}_{}.png", stack.name, n));
  }
  const Pictures pictures(o, common, names);
  auto name = names.begin();
  for (const Stack& stack : stacks) {
    std::vector<Canvas> sheet;
    for (const SlicePlane& plane : stack.planes) {
      Canvas picture = renderer.draw(plane, note);
      if (o.contact_sheet)
        sheet.push_back(std::move(picture));
      else
        pictures.write(*name++, picture);
    }
    if (o.contact_sheet) pictures.write(*name++, hexmesh::contact_sheet(sheet));
  }
  console.note(fmt::format("wrote {} pictures into {}", pictures.size(), o.output));
  return 0;
}

int run_steps(Options& o, const CommonOptions& common, const Console& console) {
  check_options(o);
  if (o.axes.empty() && o.normal.empty()) o.axes = {"coronal"};
  if (!o.normal.empty() && o.point.empty())
    throw Error(ErrorKind::usage, "--normal is given without --point, expected the one plane to show");
  if (o.axes.size() > 1) throw Error(ErrorKind::usage, "steps are shown in one plane, expected one --axis");
  o.count = 1;
  const hexmesh::InputFile input(o.input);
  const hexmesh::Result result = hexmesh::read_result(input.path());
  if (result.times.empty()) throw Error(ErrorKind::usage, "the result is no motion, expected one, or hexslice planes");
  warn_of_state(result, console);
  const std::optional<hexmesh::IntensityVolume> scan = read_scan_of(result, o.scan, console);

  // One frame and one scale of colours for all pictures: the body wherever it gets.
  const std::filesystem::path path = input.path();
  ResultSteps steps(path, result);
  hexmesh::Bounds bounds = hexmesh::bounds_of(result);
  double largest = 0;
  for (std::size_t n = 0; n < result.times.size(); ++n) {
    const hexmesh::Result& step = steps.at(n);
    const hexmesh::Bounds b = hexmesh::bounds_of(step);
    bounds = {bounds.low.cwiseMin(b.low), bounds.high.cwiseMax(b.high)};
    for (const Vec3& u : step.surface_displacement) largest = std::max(largest, u.norm());
  }
  o.slice.bounds = bounds;
  o.slice.color_max = largest;
  const hexmesh::SliceRenderer check(steps.at(0), scan ? &*scan : nullptr, o.slice);  // before a folder is made
  const SlicePlane plane = make_stacks(o, result).front().planes.front();

  std::vector<std::string> names;
  if (o.contact_sheet) names.push_back("steps.png");
  for (std::size_t n = 0; n < result.times.size() && !o.contact_sheet; ++n)
    names.push_back(fmt::format("step_{:04}.png", n));
  const Pictures pictures(o, common, names);
  std::vector<Canvas> sheet;
  for (std::size_t n = 0; n < result.times.size(); ++n) {
    const hexmesh::SliceRenderer renderer(steps.at(n), scan ? &*scan : nullptr, o.slice);
    Canvas picture = renderer.draw(plane, fmt::format("{:.4g} s", result.times[n]));
    if (o.contact_sheet)
      sheet.push_back(std::move(picture));
    else
      pictures.write(names[n], picture);
  }
  if (o.contact_sheet) pictures.write(names.front(), hexmesh::contact_sheet(sheet));
  console.note(fmt::format("wrote {} pictures into {}", pictures.size(), o.output));
  return 0;
}

void add_options(CLI::App& app, Options& o) {
  app.add_option("result", o.input, "Result file of hexsolve; - is standard input")->required();
  app.add_option("--scan", o.scan,
                 "Grey values (NRRD, NIfTI, MetaImage, DICOM folder); without it a 10 mm grid is drawn");
  CLI::Option* axis = app.add_option("--axis", o.axes, "axial, coronal or sagittal; may be given again [default: all]")
                          ->check(CLI::IsMember({"axial", "coronal", "sagittal"}))
                          ->allow_extra_args(false);
  app.add_option("--at", o.at, "LPS coordinate of the slice across its axis [mm]")->needs(axis)->check(finite_number);
  app.add_option("--normal", o.normal, "An oblique plane across this direction, x,y,z LPS")
      ->delimiter(',')
      ->expected(3)
      ->excludes(axis)
      ->check(finite_number);
  app.add_option("--point", o.point, "The oblique plane through this point, x,y,z LPS [mm]")
      ->delimiter(',')
      ->expected(3)
      ->check(finite_number);
  app.add_option("--level", o.slice.level, "Middle of the grey window, in the scan's unit")->check(finite_number);
  app.add_option("--window", o.slice.window, "Width of the grey window")
      ->check(CLI::PositiveNumber)
      ->check(finite_number);
  app.add_option("--pixel-mm", o.slice.pixel_mm, "Size of a pixel [mm]; 0 = about 420 pixels a side")
      ->check(CLI::Range(0.0, 100.0))
      ->capture_default_str()
      ->check(finite_number);
  app.add_option("--only", o.only, "Show one picture instead of two side by side: before or deformed")
      ->check(CLI::IsMember({"before", "deformed"}));
  app.add_flag("--no-outlines", o.no_outlines, "Leave out the outlines of the segments");
  app.add_flag("--lattice", o.slice.lattice, "Show the borders between the cells of the lattice");
  app.add_flag("--arrows", o.slice.arrows, "Show the displacement within the plane as arrows");
  app.add_option("--color", o.slice.color_by,
                 "Show a field in colour with a legend: displacement, or a cell field, e.g. von_mises_stress");
  app.add_flag("--contact-sheet", o.contact_sheet, "All slices of an axis in one picture");
  app.add_option("-o,--output", o.output, "Folder for the pictures")->required();
}

}  // namespace

int main(int argc, char** argv) {
  auto o = std::make_shared<Options>();
  return run_tool(
      argc, argv,
      {"hexslice", "Draw the deformed scan.", "hexslice planes liver.hexresult --scan ct.nrrd -o pictures",
       [o](CLI::App& app, const CommonOptions& common, const Console& console) -> std::function<int()> {
         app.require_subcommand(1);
         CLI::App* planes = app.add_subcommand(
             "planes", "Slices along the patient's axes or across any direction, before and after side by side (PNG)");
         add_options(*planes, *o);
         CLI::Option* every = planes->add_option("--every", o->every, "A slice every so many mm")
                                  ->check(CLI::PositiveNumber)
                                  ->check(finite_number);
         planes->add_option("--count", o->count, "Slices per axis")
             ->check(CLI::Range(1, 500))
             ->capture_default_str()
             ->excludes(every);
         CLI::App* steps =
             app.add_subcommand("steps", "One slice of a motion at each state that its result keeps (PNG)");
         add_options(*steps, *o);
         CLI::App* volume = app.add_subcommand(
             "volume", "The deformed scan as a translucent volume: planes across the view, back to front (PNG)");
         const std::function<int()> run_volume = declare_volume(*volume, common, console);
         return [=, &common, &console] {
           if (volume->parsed()) return run_volume();
           return planes->parsed() ? run_planes(*o, common, console) : run_steps(*o, common, console);
         };
       }});
}
