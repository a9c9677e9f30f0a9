// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "cli/result_state.h"
#include "cli/result_steps.h"
#include "commands.h"
#include "hexmesh/core/error.h"
#include "hexmesh/file/result_file.h"
#include "pictures.h"
#include "plane_stacks.h"

namespace hextools {
namespace {

using hexmesh::Canvas;
using hexmesh::Error;
using hexmesh::ErrorKind;

/// One frame and one scale of colours for all pictures: the body wherever it gets.
void fit_all_steps(const hexmesh::Result& result, ResultSteps& steps, hexmesh::SliceOptions& slice) {
  hexmesh::Bounds bounds = hexmesh::bounds_of(result);
  double largest = 0;
  for (std::size_t n = 0; n < result.times.size(); ++n) {
    const hexmesh::Result& step = steps.at(n);
    const hexmesh::Bounds b = hexmesh::bounds_of(step);
    bounds = {bounds.low.cwiseMin(b.low), bounds.high.cwiseMax(b.high)};
    for (const hexmesh::Vec3& u : step.surface_displacement) largest = std::max(largest, u.norm());
  }
  slice.bounds = bounds;
  slice.color_max = largest / slice.magnified;
}

int run_steps(PlaneOptions& o, const CommonOptions& common, const Console& console) {
  check_options(o);
  if (o.axes.empty() && o.normal.empty()) o.axes = {"coronal"};
  if (!o.normal.empty() && o.point.empty())
    throw Error(ErrorKind::usage, "--normal is given without --point, expected the one plane to show");
  if (o.axes.size() > 1) throw Error(ErrorKind::usage, "steps are shown in one plane, expected one --axis");
  o.count = 1;
  RunFiles files(common);
  const Input& input = files.input(o.input);
  const Input* scan_file = files.input_if_named(o.scan);
  const hexmesh::Result result = read_with_surface(input.path());
  if (result.times.empty()) throw Error(ErrorKind::usage, "the result is no motion, expected one, or hexslice planes");
  warn_of_state(result, console);
  const std::optional<hexmesh::IntensityVolume> scan = read_scan_of(result, scan_file, console);

  const std::filesystem::path path = input.path();
  ResultSteps steps(path, result, o.slice.magnified);
  fit_all_steps(result, steps, o.slice);
  const hexmesh::SliceRenderer check(steps.at(0), scan ? &*scan : nullptr, o.slice);  // before a folder is made
  const hexmesh::SlicePlane plane = make_stacks(o, result).front().planes.front();

  std::vector<std::string> names;
  if (o.contact_sheet) names.push_back("steps.png");
  for (std::size_t n = 0; n < result.times.size() && !o.contact_sheet; ++n)
    names.push_back(fmt::format("step_{:04}.png", n));
  Pictures pictures(o.output, names, files, common);
  std::vector<Canvas> sheet;
  for (std::size_t n = 0; n < result.times.size(); ++n) {
    const hexmesh::SliceRenderer renderer(steps.at(n), scan ? &*scan : nullptr, o.slice);
    Canvas picture = renderer.draw(plane, fmt::format("{:.4g} s", result.times[n]));
    if (o.contact_sheet)
      sheet.push_back(std::move(picture));
    else
      pictures.write(names[n], picture);
  }
  if (o.contact_sheet) pictures.write(names.front(), hexmesh::contact_sheet(sheet, o.slice.white));
  pictures.commit(console);
  return 0;
}

}  // namespace

std::function<int()> declare_steps(CLI::App& app, const CommonOptions& common, const Console& console) {
  const auto o = std::make_shared<PlaneOptions>();
  add_options(app, *o);
  return [o, &common, &console] { return run_steps(*o, common, console); };
}

}  // namespace hextools
