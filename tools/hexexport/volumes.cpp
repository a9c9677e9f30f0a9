// SPDX-License-Identifier: Apache-2.0
#include "volumes.h"

#include <fmt/format.h>

#include <algorithm>

#include "cli/progress.h"
#include "cli/result_state.h"
#include "hexmesh/core/error.h"
#include "hexmesh/scan/image_io.h"
#include "hexmesh/scan/transform_file.h"
#include "hexmesh/view/vtk_export.h"
#include "hexmesh/warp/bounds.h"
#include "hexmesh/warp/deform.h"
#include "hexmesh/warp/warp.h"

namespace hextools {
namespace {

using hexmesh::Error;
using hexmesh::ErrorKind;

/// The voxels of --to and --segmentation.
hexmesh::Grid grid_of(const ExportOptions& o, const hexmesh::Result& result, ScanOfResult& scan, const Input* file,
                      const Console& console) {
  if (file) return hexmesh::read_intensity(file->path(), {.warn = warning_on(console)}).grid;
  return o.grid == "fitted" || !scan.get() ? hexmesh::fitted_grid(result) : scan.get()->grid;
}

double body_ml(const hexmesh::Result& result) {
  double voxels = 0;
  for (const hexmesh::LatticeSegment& s : result.segments)
    if (s.material) voxels += static_cast<double>(s.num_voxels);
  return voxels * result.voxels.voxel_volume() / 1000;
}

void check_consistency(const hexmesh::Result& result, const hexmesh::Warp& warp, const Console& console) {
  const hexmesh::WarpCheck check = hexmesh::check_warp(result, warp);
  const std::string text = fmt::format(
      "the transforms undo each other in the body to {:.2g} voxels on average, {:.2g} at worst; {} of {} voxels are "
      "off by more than 0.1",
      check.mean, check.largest, check.over_a_tenth, check.voxels);
  const double share =
      static_cast<double>(check.over_a_tenth) / static_cast<double>(std::max<std::size_t>(check.voxels, 1));
  const hexmesh::Vec3& samples = warp.to_rest.grid.spacing();
  if (share > 0.1)
    throw Error(ErrorKind::geometry,
                fmt::format("{}: a field of samples every {:.3g} x {:.3g} x {:.3g} mm cannot hold this deformation, "
                            "expected less motion or a smaller body",
                            text, samples[0], samples[1], samples[2]));
  if (share > 1e-3)
    console.warning(text + ": the body is folded or nearly flat there");
  else
    console.note(text);
  if (check.ghost_ml > 0.01 * body_ml(result))
    console.warning(
        fmt::format("{:.3g} mL around the body are led into it by the transform, because it moves farther "
                    "than it is thick: filters show the body there a second time (--to and "
                    "--segmentation do not)",
                    check.ghost_ml));
}

void warn_of_what_is_outside(const hexmesh::Result& result, const hexmesh::Grid& voxels, const Console& console) {
  const hexmesh::Bounds b = hexmesh::bounds_of(result);
  const hexmesh::Vec3 last = voxels.corner(7), middle = voxels.continuous_index((b.low + b.high) / 2);
  const double reach = (b.high - b.low).norm() / 2;
  for (int d = 0; d < 3; ++d)
    if ((middle[d] - last[d]) * voxels.spacing()[d] > reach || -middle[d] * voxels.spacing()[d] > reach)
      throw Error(ErrorKind::input, "the grid to write on holds no part of the body, expected one around it");
  const auto holds = [&](const hexmesh::Vec3& p) { return voxels.covers(voxels.continuous_index(p)); };
  std::size_t outside = 0;
  for (std::size_t n = 0; n < result.surface_displacement.size(); ++n) {
    const hexmesh::Vec3& p = result.surface.points[n];
    outside += holds(p) && !holds(p + result.surface_displacement[n]);
  }
  if (outside > 0)
    console.warning(
        fmt::format("{} of {} surface points of the body move out of the volume that is written: "
                    "--grid fitted holds all of it",
                    outside, result.surface.points.size()));
}

}  // namespace

const hexmesh::IntensityVolume* ScanOfResult::get() {
  if (file_ && !scan_) scan_ = read_scan_of(result_, file_, console_);
  return scan_ ? &*scan_ : nullptr;
}

void write_volumes(const ExportOptions& o, const hexmesh::Result& result, ScanOfResult& scan, const Input* grid,
                   const OutputWriter& writer, const Console& console) {
  if (o.warped.empty() && o.segmentation.empty() && o.transform.empty() && o.transform_points.empty()) return;
  if (!o.warped.empty()) scan.get();

  at_work("finding where each voxel went");
  const hexmesh::Warp warp = hexmesh::make_warp(result);
  if (!o.transform.empty() || !o.transform_points.empty()) check_consistency(result, warp, console);
  if (!o.warped.empty() || !o.segmentation.empty()) {
    const hexmesh::Grid voxels = grid_of(o, result, scan, grid, console);
    warn_of_what_is_outside(result, voxels, console);
    writer.write(o.warped, [&](const auto& path) {
      hexmesh::write_intensity(hexmesh::deform(result, *scan.get(), warp.to_rest, voxels), path);
    });
    writer.write(o.segmentation, [&](const auto& path) {
      hexmesh::write_labels(hexmesh::deformed_labels(result, warp.to_rest, voxels), path);
    });
  }
  writer.write(o.transform, [&](const auto& path) { hexmesh::write_transform(warp.to_rest, path); });
  writer.write(o.transform_points, [&](const auto& path) { hexmesh::write_transform(warp.from_rest, path); });
}

}  // namespace hextools
