// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "cli/progress.h"
#include "cli/result_state.h"
#include "cli/result_steps.h"
#include "commands.h"
#include "film.h"
#include "hexmesh/core/error.h"
#include "hexmesh/file/result_file.h"
#include "pictures.h"
#include "plane_stacks.h"

namespace hextools {
namespace {

using hexmesh::Canvas;
using hexmesh::Error;
using hexmesh::ErrorKind;

struct StepOptions {
  PlaneOptions planes;
  std::optional<int> pictures_per_second;  ///< nothing: 25
};

/// One frame and one scale of colours for all pictures: the body wherever it gets.
void fit_all_steps(const hexmesh::Result& result, ResultSteps& steps, hexmesh::SliceOptions& slice) {
  hexmesh::Bounds bounds = hexmesh::bounds_of(result);
  for (std::size_t n = 0; n < result.times.size(); ++n) {
    const hexmesh::Result& step = steps.at(n);
    const hexmesh::Bounds b = hexmesh::bounds_of(step);
    bounds = {bounds.low.cwiseMin(b.low), bounds.high.cwiseMax(b.high)};
    if (slice.color_by.empty()) continue;
    const hexmesh::ColorRange colors = hexmesh::color_range(step, slice.color_by, slice.magnified);
    slice.colors = slice.colors ? hexmesh::joined(*slice.colors, colors) : colors;
  }
  slice.bounds = bounds;
}

/// @throws Error{usage} where options ask for more than one plane
void check_step_options(StepOptions& options) {
  PlaneOptions& o = options.planes;
  check_options(o);
  if (o.axes.empty() && o.normal.empty()) o.axes = {"coronal"};
  if (!o.normal.empty() && o.point.empty())
    throw Error(ErrorKind::usage, "--normal is given without --point, expected the one plane to show");
  if (o.axes.size() > 1) throw Error(ErrorKind::usage, "steps are shown in one plane, expected one --axis");
  if (o.contact_sheet && is_film_name(o.output))
    throw Error(ErrorKind::usage, fmt::format("-o is the film '{}', expected a folder for a contact sheet", o.output));
  o.count = 1;
  if (options.pictures_per_second && !is_film_name(o.output))
    throw Error(ErrorKind::usage, "--fps is given without a film, expected -o in .mp4, .webm or .gif");
  constexpr int most_of_gif = 50;
  if (options.pictures_per_second.value_or(0) > most_of_gif && is_gif_name(o.output))
    throw Error(ErrorKind::usage,
                fmt::format("--fps is {}, expected at most {} for a .gif", *options.pictures_per_second, most_of_gif));
}

std::vector<std::string> names_of_pictures(const PlaneOptions& o, std::size_t count) {
  if (o.contact_sheet) return {"steps.png"};
  std::vector<std::string> names;
  for (std::size_t n = 0; n < count; ++n) names.push_back(fmt::format("step_{:04}.png", n));
  return names;
}

int run_steps(StepOptions& options, const CommonOptions& common, const Console& console) {
  PlaneOptions& o = options.planes;
  check_step_options(options);
  RunFiles files(common);
  const Input& input = files.input(o.input);
  const Input* scan_file = files.input_if_named(o.scan);
  const hexmesh::Result result = read_with_surface(input.path());
  if (result.times.empty()) throw Error(ErrorKind::usage, "the result is no motion, expected one, or hexslice planes");
  warn_of_state(result, console);
  const std::optional<hexmesh::IntensityVolume> scan = read_scan_of(result, scan_file, console);

  const std::filesystem::path path = input.path();
  ResultSteps steps(path, result, o.slice.magnified);
  if (result.cell_fields.contains(o.slice.color_by) && !steps.at(0).cell_fields.contains(o.slice.color_by))
    throw Error(ErrorKind::usage,
                fmt::format("'{}' is kept of the end only (dynamics.output_fields, or an earlier version), expected a "
                            "field of every state, e.g. displacement",
                            o.slice.color_by));
  fit_all_steps(result, steps, o.slice);
  const hexmesh::SliceRenderer check(steps.at(0), scan ? &*scan : nullptr, o.slice);  // before a folder is made
  const hexmesh::SlicePlane plane = make_stacks(o, result).front().planes.front();

  std::optional<Film> film;
  std::optional<Pictures> pictures;
  Output* film_file = nullptr;
  const std::vector<std::string> names = names_of_pictures(o, result.times.size());
  if (is_film_name(o.output)) {
    film_file = &files.output(o.output, Content::binary, std::filesystem::path(o.output).extension());
    film.emplace(o.output);
  } else {
    pictures.emplace(o.output, names, files, common);
  }
  std::vector<Canvas> sheet;
  for (std::size_t n = 0; n < result.times.size(); ++n) {
    const hexmesh::SliceRenderer renderer(steps.at(n), scan ? &*scan : nullptr, o.slice);
    Canvas picture = renderer.draw(plane, fmt::format("{:.4g} s", result.times[n]));
    if (!pictures || o.contact_sheet)  // else as each is written
      at_work("drawing pictures", static_cast<double>(n + 1) / static_cast<double>(result.times.size()));
    if (o.contact_sheet)
      sheet.push_back(std::move(picture));
    else if (film)
      film->add(picture);
    else
      pictures->write(names[n], picture);
  }
  if (film) {
    film->write(film_file->path(), options.pictures_per_second.value_or(25));
    files.commit();
    console.note(fmt::format("wrote {} pictures as the film {}", result.times.size(), o.output));
    return 0;
  }
  if (o.contact_sheet) pictures->write(names.front(), check.contact_sheet(sheet));
  pictures->commit(console);
  return 0;
}

}  // namespace

std::function<int()> declare_steps(CLI::App& app, const CommonOptions& common, const Console& console) {
  const auto o = std::make_shared<StepOptions>();
  add_options(app, o->planes);
  app.get_option("--output")
      ->description("Folder for the pictures, or a film (.mp4, .webm, .gif), which takes the program ffmpeg");
  app.add_option("--fps", o->pictures_per_second, "Pictures a second of a film [default: 25]")
      ->check(CLI::Range(1, 120));
  return [o, &common, &console] { return run_steps(*o, common, console); };
}

}  // namespace hextools
