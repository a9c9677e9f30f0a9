// SPDX-License-Identifier: Apache-2.0
#include "segments/gather.h"

#include <fmt/format.h>

#include <cmath>

#include "hexmesh/core/error.h"
#include "hexmesh/surface/surface_file.h"
#include "hexmesh/surface/voxelize.h"

namespace hextools {
namespace {

using hexmesh::Error;
using hexmesh::ErrorKind;
using hexmesh::Grid;
using hexmesh::Segmentation;

/// One segment of all that a file labels; an empty one where it labels nothing.
void merge_segments(Segmentation& segmentation, const std::string& name) {
  if (segmentation.segments.empty()) segmentation.segments.push_back({{}, 0, 1});
  for (hexmesh::LayeredSegment& s : segmentation.segments) {
    s.segment.label = 1;
    s.segment.name = name;
    s.segment.color = segmentation.segments.front().segment.color;
  }
}

/// Labels without a name, one file beside others: "liver.nii.gz" holds "liver", or "liver_1" and "liver_2".
void name_after_file(Segmentation& segmentation, const std::filesystem::path& path) {
  const std::string file = path.filename().string(), stem = file.substr(0, file.find('.'));
  for (hexmesh::LayeredSegment& s : segmentation.segments)
    if (s.segment.name == fmt::format("label_{}", s.value))
      s.segment.name = segmentation.segments.size() == 1 ? stem : fmt::format("{}_{}", stem, s.value);
}

/// All inputs before they share a grid.
struct Parts {
  std::vector<Segmentation> volumes;
  std::vector<hexmesh::Shape> shapes;
  std::vector<std::string> shape_names;
};

/// Multiplies all coordinates, and warns of what is hardly in mm.
/// @throws Error{usage} for a thickness that is more than it
void scale(hexmesh::Shape& shape, double factor, double thickness, const std::string& name, const Console& console) {
  for (hexmesh::Vec3& p : shape.surface.points) p *= factor;
  for (auto& line : shape.lines)
    for (hexmesh::Vec3& p : line) p *= factor;
  hexmesh::Vec3 low = hexmesh::Vec3::Constant(INFINITY), high = -low;
  for (const hexmesh::Vec3& p : shape.surface.points) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  constexpr double smallest_organ = 1;
  const double size = (high - low).maxCoeff();
  if (shape.lines.empty() && thickness > size)
    throw Error(ErrorKind::usage,
                fmt::format("--thickness {:g} mm is more than surface '{}' is large, expected at most "
                            "{:.3g} mm",
                            thickness, name, size));
  if (size >= 0 && size < smallest_organ)
    console.warning(
        fmt::format("surface '{}' is {:.3g} mm large, expected coordinates in mm (--scale 1000 where they "
                    "are in metres)",
                    name, size));
}

Parts read_parts(const SegmentOptions& o, const Sources& sources, const hexmesh::ReadOptions& options,
                 const Console& console) {
  Parts out;
  const auto add_shape = [&](const std::string& name, const std::filesystem::path& path) {
    scale(out.shapes.emplace_back(hexmesh::read_shape(path)), o.scale, o.thickness, name, console);
    out.shape_names.push_back(name);
  };
  std::vector<std::filesystem::path> dicom;
  for (const Input* input : sources.files) {
    const std::filesystem::path& path = input->path();
    if (hexmesh::is_surface_name(path)) {
      add_shape(std::filesystem::path(input->known_as()).stem().string(), path);
    } else if (hexmesh::is_dicom(path)) {
      dicom.push_back(path);
    } else {
      out.volumes.push_back(hexmesh::read_segmentation({path}, options));
      if (sources.files.size() > 1) name_after_file(out.volumes.back(), input->known_as());
    }
  }
  if (!dicom.empty()) out.volumes.insert(out.volumes.begin(), hexmesh::read_segmentation(dicom, options));
  for (const auto& [name, file] : sources.named) {
    const std::filesystem::path& path = file->path();
    if (hexmesh::is_surface_name(path)) {
      add_shape(name, path);
      continue;
    }
    out.volumes.push_back(hexmesh::read_segmentation({path}, options));
    merge_segments(out.volumes.back(), name);
  }
  return out;
}

/// Where shapes go beside label volumes: voxels of their size around them.
std::vector<Grid> grids_of_shapes(const SegmentOptions& o, const Parts& parts) {
  if (parts.volumes.empty() && o.spacing == 0)
    throw Error(ErrorKind::usage, "surfaces have no voxels of their own, expected --spacing MM");
  if (!parts.volumes.empty() && o.spacing != 0)
    throw Error(
        ErrorKind::usage,
        fmt::format("--spacing {} goes with surfaces alone, the voxels of the label volume are used", o.spacing));
  if (parts.shapes.empty()) return {};
  return {hexmesh::grid_around(parts.shapes,
                               parts.volumes.empty() ? o.spacing : parts.volumes.front().grid.spacing().minCoeff(),
                               o.thickness / 2)};
}

void report_shape(const std::string& name, const hexmesh::Voxelization& v, const Grid& grid, double thickness,
                  const Console& console) {
  const double ml = static_cast<double>(v.voxels.size()) * grid.voxel_volume() / 1000;
  console.note(
      fmt::format("surface '{}': {} closed parts filled ({:.4g} mL enclosed), {} open ones as shells: {} voxels, "
                  "{:.4g} mL",
                  name, v.closed_parts, v.enclosed_ml, v.open_parts, v.voxels.size(), ml));
  if (v.mended_parts > 0)
    console.warning(
        fmt::format("surface '{}': the triangles of {} parts face both ways; they are filled by what they "
                    "enclose",
                    name, v.mended_parts));
  for (const auto& [open, all] : v.nearly_closed)
    console.warning(
        fmt::format("surface '{}': a part with {} open edges of {} counts as a sheet and is not filled, "
                    "expected holes closed if it is a body",
                    name, open, all));
  constexpr double most_off = 0.05;
  const bool is_open = v.open_parts > 0 || v.closed_parts == 0;  // lines are no parts
  if (is_open && thickness > 0 && thickness < grid.spacing().maxCoeff())
    console.warning(fmt::format("--thickness {:g} mm is less than a voxel of {:g} mm, expected a smaller --spacing",
                                thickness, grid.spacing().maxCoeff()));
  if (v.open_parts > 0 && thickness == 0)
    console.warning(
        fmt::format("surface '{}': {} open parts are shells, one voxel thick: their volume, {:.4g} mL with what is "
                    "closed, and their stiffness follow --spacing, expected --thickness",
                    name, v.open_parts, ml));
  else if (v.open_parts == 0 && v.closed_parts > 0 && v.mended_parts == 0 &&
           std::abs(ml - v.enclosed_ml) > most_off * v.enclosed_ml)
    console.warning(
        fmt::format("surface '{}' encloses {:.4g} mL, its voxels {:.4g} mL: they are coarse for it, "
                    "expected a smaller --spacing",
                    name, v.enclosed_ml, ml));
}

}  // namespace

Segmentation gather(const SegmentOptions& o, const Sources& sources, const hexmesh::ReadOptions& options,
                    const Console& console) {
  Parts parts = read_parts(o, sources, options, console);
  const std::vector<Grid> around = grids_of_shapes(o, parts);
  Segmentation out = parts.volumes.empty() ? Segmentation{around.front(), {}, {}}
                                           : hexmesh::join(std::move(parts.volumes), around, options.warn);
  for (std::size_t n = 0; n < parts.shapes.size(); ++n) {
    const std::string& name = parts.shape_names[n];
    const hexmesh::Voxelization voxels = hexmesh::voxelize(parts.shapes[n], out.grid, o.thickness);
    report_shape(name, voxels, out.grid, o.thickness, console);
    Segmentation added{out.grid, {}, {}};
    hexmesh::add_segment(added, {1, name, hexmesh::distinct_color(n), ""}, voxels.voxels);
    out = hexmesh::combine(std::move(out), std::move(added));
  }
  return out;
}

}  // namespace hextools
