// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <utility>

#include "hexmesh/core/error.h"
#include "hexmesh/file/surface_target.h"
#include "hexmesh/geometry/solid.h"
#include "hexmesh/surface/surface_file.h"
#include "options.h"

namespace hextools {
namespace {

struct SurfaceOptions {
  std::string input, output;
  double scale = 1;
};

int run_surface(const SurfaceOptions& o, const CommonOptions& common, const Console& console) {
  RunFiles files(common);
  const Input& input = files.input(o.input);
  Output& output = files.output(o.output, Content::binary, ".hexsurface");
  hexmesh::TriangleSurface surface = hexmesh::merged(hexmesh::read_surface(input.path()));
  for (hexmesh::Vec3& p : surface.points) p *= o.scale;
  if (hexmesh::edges_of(surface).open == 0 && hexmesh::enclosed_volume(surface) < 0)
    for (auto& t : surface.triangles) std::swap(t[1], t[2]);
  if (const std::string fault = hexmesh::fault_of_solid(surface); !fault.empty())
    throw hexmesh::Error(hexmesh::ErrorKind::input, fmt::format("'{}' {}", o.input, fault));
  hexmesh::write_surface_target(surface, output.path());
  console.note(
      fmt::format("{} triangles around {:.4g} mL", surface.triangles.size(), 1e-3 * hexmesh::enclosed_volume(surface)));
  files.commit();
  return 0;
}

}  // namespace

std::function<int()> declare_surface(CLI::App& app, const CommonOptions& common, const Console& console) {
  const auto o = std::make_shared<SurfaceOptions>();
  app.add_option("input", o->input, "A closed surface: OBJ, STL, PLY, OFF or VTP, LPS in mm")->required();
  app.add_option("--scale", o->scale, "Multiply the coordinates: 1000 where they are in metres")
      ->check(CLI::Range(1e-6, 1e6));
  app.add_option("-o,--output", o->output, "The .hexsurface for a [[contact]]")->required();
  return [=, &common, &console] { return run_surface(*o, common, console); };
}

}  // namespace hextools
