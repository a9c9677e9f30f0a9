// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "cli/run_files.h"
#include "commands.h"
#include "hexmesh/core/error.h"
#include "hexmesh/file/lattice_file.h"
#include "hexmesh/surface/surface_file.h"

namespace hextools {
namespace {

using hexmesh::Error;
using hexmesh::ErrorKind;

struct SurfaceOptions {
  std::string lattice, segment, output;
};

int run_surface(const SurfaceOptions& o, const CommonOptions& common) {
  const std::string ending = std::filesystem::path(o.output).extension();
  if (ending != ".obj" && ending != ".stl" && ending != ".ply" && ending != ".off")
    throw Error(ErrorKind::usage,
                fmt::format("output '{}', expected a name that ends in .obj, .stl, .ply or .off", o.output));
  RunFiles files(common);
  const Input& input = files.input(o.lattice);
  Output& output = files.output(o.output, Content::binary, ending);
  const hexmesh::Lattice lattice =
      hexmesh::read_lattice(input.path(), {-1}, hexmesh::Elements::formed, hexmesh::Voxels::surface_only);
  hexmesh::TriangleSurface surface = lattice.surface;
  if (!o.segment.empty())
    surface = hexmesh::of_segment(surface, hexmesh::segment_named(lattice.segments, o.segment).segment.label);
  if (surface.triangles.empty())
    throw Error(ErrorKind::input, fmt::format("lattice file '{}' has no such surface, expected one", o.lattice));
  hexmesh::write_surface(surface, output.path());
  files.commit();
  return 0;
}

}  // namespace

std::function<int()> declare_surface(CLI::App& app, const CommonOptions& common, const Console& /*console*/) {
  const auto o = std::make_shared<SurfaceOptions>();
  app.add_option("lattice", o->lattice, "Lattice file; - is standard input")->required();
  app.add_option("--segment", o->segment, "Only the surface of this segment");
  app.add_option("-o,--output", o->output, "Surface file")->required();
  return [o, &common] { return run_surface(*o, common); };
}

}  // namespace hextools
