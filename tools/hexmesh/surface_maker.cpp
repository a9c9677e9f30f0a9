// SPDX-License-Identifier: Apache-2.0
#include "surface_maker.h"

#include <fmt/format.h>

#include "cli/parse.h"
#include "hexmesh/core/error.h"
#include "hexmesh/lattice/locator.h"
#include "hexmesh/surface/decimate.h"
#include "hexmesh/surface/extract.h"
#include "hexmesh/surface/surface_file.h"

namespace hextools {

using hexmesh::Error;
using hexmesh::ErrorKind;

SurfaceMaker::SurfaceMaker(const BuildOptions& o, const BuildInputs& inputs, const hexmesh::Lattice& lattice)
    : lattice_(lattice) {
  for (const std::string& text : o.surfaces) {
    const auto [name, value] = parse_pair("--surface", text, "SEGMENT=TRIANGLES");
    const std::optional<std::size_t> count = parse_number<std::size_t>(value);
    if (!count)
      throw Error(ErrorKind::usage, fmt::format("--surface '{}': '{}' is not a number of triangles", text, value));
    triangles_[label_of(name)] = *count;
  }
  for (const auto& [name, file] : inputs.embedded) files_of_[label_of(name)].push_back(file);
}

hexmesh::TriangleSurface SurfaceMaker::make(Notes& notes) const {
  hexmesh::TriangleSurface all;
  for (const hexmesh::LatticeSegment& s : lattice_.segments) {
    const std::uint16_t label = s.segment.label;
    if (const auto files = files_of_.find(label); files != files_of_.end())
      for (const Input* file : files->second) append(all, embedded(*file, label));
    else if (s.material)
      append(all, extracted(s, notes));
  }
  return all;
}

std::uint16_t SurfaceMaker::label_of(const std::string& name) const {
  return hexmesh::segment_named(lattice_.segments, name).segment.label;
}

hexmesh::TriangleSurface SurfaceMaker::extracted(const hexmesh::LatticeSegment& s, Notes& notes) const {
  const auto wanted = triangles_.find(s.segment.label);
  if (wanted != triangles_.end() && wanted->second == 0) return {};
  hexmesh::TriangleSurface surface = hexmesh::extract_surface(lattice_, s.segment.label);
  if (wanted == triangles_.end()) return surface;
  surface = hexmesh::decimate(surface, wanted->second);
  const std::size_t crossing = hexmesh::count_self_intersections(surface);
  if (crossing > 0)
    notes.push_back(
        fmt::format("warning: surface of '{}' with {} triangles crosses itself in {} pairs of triangles; more "
                    "triangles may help",
                    s.segment.name, surface.triangles.size(), crossing));
  return surface;
}

hexmesh::TriangleSurface SurfaceMaker::embedded(const Input& file, std::uint16_t label) const {
  hexmesh::TriangleSurface surface = hexmesh::read_surface(file.path());
  surface.segment.assign(surface.triangles.size(), label);
  const hexmesh::CellLocator locator(lattice_.voxels, {1, 1, 1}, lattice_.levels.front().cells);
  for (const hexmesh::Vec3& p : surface.points)
    if (locator.locate_position(p).cell < 0)
      throw Error(ErrorKind::geometry,
                  fmt::format("surface '{}' has a point at ({:.1f}, {:.1f}, {:.1f}) mm, more than {} mm from the "
                              "material, expected a surface of this body in LPS and mm",
                              file.known_as(), p[0], p[1], p[2], hexmesh::embedding_reach));
  return surface;
}

}  // namespace hextools
