// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "hexmesh/core/error.h"
#include "hexscan/options.h"

using namespace hextools;

int main(int argc, char** argv) {
  const auto o = std::make_shared<ScanOptions>();
  return run_tool(
      argc, argv,
      {"hexscan", "Read segmentations and write one labelled volume (NRRD, as 3D Slicer's .seg.nrrd).",
       "hexscan phantom liver --spacing 4 -o liver.nrrd",
       [o](CLI::App& app, const CommonOptions& common, const Console& console) -> std::function<int()> {
         const auto run_conversion = declare_conversion(app, o, common, console);
         CLI::App* phantom = add_subcommand(app, "phantom", "Make a phantom instead of reading a scan",
                                            "hexscan phantom liver --spacing 4 -o liver.nrrd --intensity-out ct.nrrd");
         const auto run_phantom = declare_phantom(*phantom, o, common, console);
         CLI::App* info = add_subcommand(app, "info", "Say what inputs hold: grid, orientation, segments, warnings",
                                         "hexscan info liver.nrrd");
         const auto run_info = declare_info(*info, o, common, console);
         CLI::App* surface = add_subcommand(app, "surface", "Make the obstacle of a [[contact]] of a closed surface",
                                            "hexscan surface probe.stl -o probe.hexsurface");
         const auto run_surface = declare_surface(*surface, common, console);
         return [=] {
           if ((phantom->parsed() || surface->parsed()) &&
               !o->inputs.empty())  // what a subcommand leaves over is the tool's
             throw hexmesh::Error(hexmesh::ErrorKind::usage,
                                  fmt::format("'{}' was not expected (see hexscan {} --help)", o->inputs.front(),
                                              phantom->parsed() ? "phantom" : "surface"));
           if (phantom->parsed()) return run_phantom();
           if (info->parsed()) return run_info();
           return surface->parsed() ? run_surface() : run_conversion();
         };
       }});
}
