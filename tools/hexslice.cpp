// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "cli/result_state.h"
#include "cli/tool.h"
#include "hexmesh/core/error.h"
#include "hexmesh/scan/image_io.h"
#include "hexmesh/view/slice.h"

namespace {

using namespace hextools;
using hexmesh::Error;
using hexmesh::ErrorKind;
using hexmesh::SliceAxis;

struct Options {
  std::string input, scan, output;
  int count = 3;
  hexmesh::SliceOptions slice;
};

int run_planes(const Options& o, const CommonOptions& common, const Console& console) {
  const hexmesh::InputFile input(o.input);
  const hexmesh::Result result = hexmesh::read_result(input.path());
  warn_of_state(result, console);
  std::optional<hexmesh::IntensityVolume> scan;
  if (!o.scan.empty()) {
    const hexmesh::InputFile file(o.scan);
    scan = hexmesh::read_intensity(file.path(), {.warn = warning_on(console)});
    const auto covered = [&](const hexmesh::Vec3& p) { return scan->grid.covers(scan->grid.continuous_index(p)); };
    if (std::none_of(result.nodes.begin(), result.nodes.end(), covered))
      throw Error(ErrorKind::input, fmt::format("scan '{}' covers no part of the body, expected the scan it was "
                                                "segmented on",
                                                o.scan));
  }
  const hexmesh::SliceRenderer renderer(result, scan ? &*scan : nullptr, o.slice);

  std::error_code failed;
  std::filesystem::create_directories(o.output, failed);
  if (!std::filesystem::is_directory(o.output))
    throw Error(ErrorKind::output, fmt::format("cannot make the folder '{}', expected a writable place", o.output));
  struct Picture {
    SliceAxis axis;
    double position;
    std::string path;
  };
  std::vector<Picture> pictures;
  for (const auto& [axis, name] : {std::pair{SliceAxis::axial, "axial"}, std::pair{SliceAxis::coronal, "coronal"},
                                   std::pair{SliceAxis::sagittal, "sagittal"}}) {
    const auto [low, high] = renderer.range(axis);
    for (int n = 1; n <= o.count; ++n) {
      const auto path = std::filesystem::path(o.output) / fmt::format("{}_{}.png", name, n);
      pictures.push_back({axis, low + (high - low) * n / (o.count + 1), path.string()});
      open_output(path.string(), ".png", common, {});  // all names are free before the first is taken
    }
  }
  for (const Picture& p : pictures) {
    const auto file = open_output(p.path, ".png", common, {o.input, o.scan});
    renderer.before_and_after(p.axis, p.position).write_png(file->path());
    file->commit();
  }
  console.note(fmt::format("wrote {} pictures into {}", pictures.size(), o.output));
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  auto o = std::make_shared<Options>();
  return run_tool(
      argc, argv,
      {"hexslice", "Draw slices of the deformed scan.", "hexslice planes liver.hexresult --scan ct.nrrd -o pictures",
       [o](CLI::App& app, const CommonOptions& common, const Console& console) -> std::function<int()> {
         app.require_subcommand(1);
         CLI::App* planes = app.add_subcommand(
             "planes", "Axial, coronal and sagittal slices with segment outlines, before and after side by side (PNG)");
         planes->add_option("result", o->input, "Result file of hexsolve; - is standard input")->required();
         planes->add_option("--scan", o->scan,
                            "Grey values (NRRD, NIfTI, MetaImage); without it a 10 mm grid is drawn");
         planes->add_option("--count", o->count, "Slices per axis")->check(CLI::Range(1, 500))->capture_default_str();
         planes->add_option("--level", o->slice.level, "Middle of the grey window, in the scan's unit");
         planes->add_option("--window", o->slice.window, "Width of the grey window")->check(CLI::PositiveNumber);
         planes->add_option("--pixel-mm", o->slice.pixel_mm, "Size of a pixel [mm]; 0 = about 420 pixels a side")
             ->check(CLI::Range(0.0, 100.0))
             ->capture_default_str();
         planes->add_option("-o,--output", o->output, "Folder for the pictures")->required();
         return [=, &common, &console] { return run_planes(*o, common, console); };
       }});
}
