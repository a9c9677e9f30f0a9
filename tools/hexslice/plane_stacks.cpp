// SPDX-License-Identifier: Apache-2.0
#include "plane_stacks.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "hexmesh/core/error.h"

namespace hextools {
namespace {

using hexmesh::Error;
using hexmesh::ErrorKind;
using hexmesh::SliceAxis;
using hexmesh::Vec3;

Vec3 vector_of(const std::vector<double>& numbers) { return {numbers[0], numbers[1], numbers[2]}; }

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
std::vector<double> places(const PlaneOptions& o, const std::pair<double, double>& range) {
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

PlaneStack oblique_stack(const PlaneOptions& o, const hexmesh::Result& result, const Vec3& normal) {
  PlaneStack stack{"oblique", normal, {}};
  if (!o.point.empty()) {
    const Vec3 point = vector_of(o.point);
    check_place(normal.dot(point), reach_of(result, normal), "--point along --normal");
    stack.planes.push_back(hexmesh::oblique_plane(point, normal));
    return stack;
  }
  // Through the line along the normal that passes the middle of the body.
  const hexmesh::Bounds bounds = hexmesh::bounds_of(result);
  const Vec3 middle = (bounds.low + bounds.high) / 2;
  for (const double place : places(o, reach_of(result, normal)))
    stack.planes.push_back(hexmesh::oblique_plane(middle + (place - middle.dot(normal)) * normal, normal));
  return stack;
}

}  // namespace

std::vector<PlaneStack> make_stacks(const PlaneOptions& o, const hexmesh::Result& result) {
  if (!o.normal.empty()) return {oblique_stack(o, result, vector_of(o.normal).normalized())};
  std::vector<PlaneStack> stacks;
  const std::vector<std::string> axes =
      o.axes.empty() ? std::vector<std::string>{"axial", "coronal", "sagittal"} : o.axes;
  for (const std::string& name : axes) {
    const SliceAxis axis = axis_named(name);
    PlaneStack stack{name, Vec3::Unit(static_cast<int>(axis)), {}};
    for (const double place : places(o, reach_of(result, stack.across)))
      stack.planes.push_back(hexmesh::plane_across(axis, place));
    if (stack.planes.empty())
      throw Error(ErrorKind::usage,
                  fmt::format("--every {:g} meets the body in no {} slice, expected less", o.every, name));
    stacks.push_back(std::move(stack));
  }
  return stacks;
}

void check_options(PlaneOptions& o) {
  if (o.output == "-") throw Error(ErrorKind::usage, "-o is -, expected a folder for the pictures");
  if (o.scan.empty() && (o.slice.level || o.slice.window))
    throw Error(ErrorKind::usage, "--level and --window are given without --scan: they choose its grey values");
  if (!o.normal.empty() && vector_of(o.normal).norm() == 0)
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
  o.slice.white = o.background == "white";
  o.slice.legend = !o.contact_sheet;
}

void add_options(CLI::App& app, PlaneOptions& o) {
  app.add_option("result", o.input, "Result file of hexsolve; - is standard input")->required();
  app.add_option("--scan", o.scan,
                 "Grey values (NRRD, NIfTI, MetaImage, DICOM folder); without it each segment has its colour");
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
  CLI::Option* pixel = app.add_option("--pixel-mm", o.slice.pixel_mm, "Size of a pixel [mm]; 0 = as --size says")
                           ->check(CLI::Range(0.0, 100.0))
                           ->capture_default_str()
                           ->check(finite_number);
  app.add_option("--size", o.slice.size, "About how many pixels the longer side has")
      ->check(CLI::Range(16, 8192))
      ->capture_default_str()
      ->excludes(pixel);
  app.add_option("--magnify", o.slice.magnified, "Show the displacement so many times larger")
      ->check(positive_number)
      ->capture_default_str();
  app.add_option("--background", o.background, "Paper: black or white")
      ->check(CLI::IsMember({"black", "white"}))
      ->capture_default_str();
  app.add_option("--only", o.only, "Show one picture instead of two side by side: before or deformed")
      ->check(CLI::IsMember({"before", "deformed"}));
  app.add_flag("--no-outlines", o.no_outlines, "Leave out the outlines of the segments");
  app.add_flag("--lattice", o.slice.lattice, "Show the borders between the cells of the lattice");
  app.add_flag("--arrows", o.slice.arrows, "Show the displacement within the plane as arrows");
  app.add_option("--grid", o.slice.grid_mm, "Show lines that move with the material, so far apart [mm]")
      ->check(positive_number);
  app.add_option("--color", o.slice.color_by,
                 "Show a field in colour with a legend: displacement, or a cell field, e.g. von_mises_stress");
  app.add_flag("--contact-sheet", o.contact_sheet, "All slices of an axis in one picture, with one legend");
  app.add_option("-o,--output", o.output, "Folder for the pictures")->required();
}

}  // namespace hextools
