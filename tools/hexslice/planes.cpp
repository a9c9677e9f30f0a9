// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "cli/result_state.h"
#include "commands.h"
#include "film.h"
#include "hexmesh/core/error.h"
#include "hexmesh/file/surface_target.h"
#include "hexmesh/surface/surface_file.h"
#include "pictures.h"
#include "plane_stacks.h"

namespace hextools {
namespace {

using hexmesh::Canvas;

hexmesh::TriangleSurface read_target(const Input& file) {
  return hexmesh::is_surface_name(file.name()) ? hexmesh::read_surface(file.path())
                                               : hexmesh::read_surface_target(file.path());
}

int run_planes(PlaneOptions& o, const CommonOptions& common, const Console& console) {
  check_options(o);
  if (is_film_name(o.output))
    throw hexmesh::Error(hexmesh::ErrorKind::usage,
                         fmt::format("-o is '{}', expected a folder: films are of motions (hexslice steps)", o.output));
  RunFiles files(common);
  const Input& input = files.input(o.input);
  const Input* scan_file = files.input_if_named(o.scan);
  const Input* target = files.input_if_named(o.target);
  const hexmesh::Result result = hexmesh::magnified(read_with_surface(input.path()), o.slice.magnified);
  warn_of_state(result, console);
  if (is_preview(result) && o.only.empty()) o.slice.deformed = false;
  if (target) o.slice.target = read_target(*target);
  if (o.slice.scene) {
    o.slice.obstacles = obstacles_of(result);
    o.slice.moved = moved_by(result);
  }
  const std::optional<hexmesh::IntensityVolume> scan = read_scan_of(result, scan_file, console);
  const hexmesh::SliceRenderer renderer(result, scan ? &*scan : nullptr, o.slice);
  const std::vector<PlaneStack> stacks = make_stacks(o, result);
  const std::string note = state_note(result);

  std::vector<std::string> names;
  for (const PlaneStack& stack : stacks) {
    if (o.contact_sheet) names.push_back(stack.name + ".png");
    for (std::size_t n = 1; n <= stack.planes.size() && !o.contact_sheet; ++n)
      names.push_back(fmt::format("{}_{}.png", stack.name, n));
  }
  Pictures pictures(o.output, names, files, common);
  auto name = names.begin();
  for (const PlaneStack& stack : stacks) {
    std::vector<Canvas> sheet;
    for (const hexmesh::SlicePlane& plane : stack.planes) {
      Canvas picture = renderer.draw(plane, note);
      if (o.contact_sheet)
        sheet.push_back(std::move(picture));
      else
        pictures.write(*name++, picture);
    }
    if (o.contact_sheet) pictures.write(*name++, renderer.contact_sheet(sheet));
  }
  pictures.commit(console);
  return 0;
}

}  // namespace

std::function<int()> declare_planes(CLI::App& app, const CommonOptions& common, const Console& console) {
  const auto o = std::make_shared<PlaneOptions>();
  add_options(app, *o);
  app.add_flag("--scene", o->slice.scene,
               "Show what the scene says: points that are held in blue, those that are moved in red with an arrow, "
               "obstacles in violet");
  app.add_option(
      "--target", o->target,
      "Show in yellow where a surface is (.stl, .obj, .ply, .off, .vtp; .hexsurface): what a body was fitted "
      "to");
  CLI::Option* every =
      app.add_option("--every", o->every, "A slice every so many mm")->check(CLI::PositiveNumber)->check(finite_number);
  app.add_option("--count", o->count, "Slices per axis")
      ->check(CLI::Range(1, 500))
      ->capture_default_str()
      ->excludes(every);
  return [o, &common, &console] { return run_planes(*o, common, console); };
}

}  // namespace hextools
