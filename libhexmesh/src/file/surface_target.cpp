// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/file/surface_target.h"

#include "hexmesh/core/error.h"
#include "shared_groups.h"

namespace hexmesh {
namespace {

constexpr const char* format = "hexsurface";
constexpr int version = 1;

}  // namespace

void write_surface_target(const TriangleSurface& surface, const std::filesystem::path& path) {
  hdf5::Writer file(path);
  hdf5::write_header(file, format, version, {});
  TriangleSurface labelled = surface;
  labelled.segment.resize(surface.triangles.size());  // those of other files have no labels
  hdf5::write_surface(file, labelled, false);
  file.close();
}

TriangleSurface read_surface_target(const std::filesystem::path& path) {
  if (!std::filesystem::exists(path))
    throw Error(ErrorKind::input,
                "no such surface '" + path.string() + "', expected a .hexsurface of hexfit or hexscan surface");
  const hdf5::Reader file(path, "surface");
  hdf5::read_header(file, format, version);
  TriangleSurface surface = hdf5::read_surface(file);
  if (surface.triangles.empty()) file.fail("has no triangles, expected some");
  return surface;
}

}  // namespace hexmesh
