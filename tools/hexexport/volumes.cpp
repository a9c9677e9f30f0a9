// SPDX-License-Identifier: Apache-2.0
#include "volumes.h"

#include "cli/progress.h"
#include "cli/result_state.h"
#include "hexmesh/scan/image_io.h"
#include "hexmesh/scan/transform_file.h"
#include "hexmesh/view/vtk_export.h"
#include "hexmesh/warp/deform.h"
#include "hexmesh/warp/warp.h"

namespace hextools {
namespace {

/// The voxels of --to and --segmentation.
hexmesh::Grid grid_of(const ExportOptions& o, const hexmesh::Result& result, ScanOfResult& scan, const Input* file,
                      const Console& console) {
  if (file) return hexmesh::read_intensity(file->path(), {.warn = warning_on(console)}).grid;
  return o.grid == "fitted" || !scan.get() ? hexmesh::fitted_grid(result) : scan.get()->grid;
}

void check_consistency(const hexmesh::Result& result, const hexmesh::Warp& warp, const Console& console) {
  const hexmesh::WarpNotices notices = hexmesh::notices_of(result, warp, hexmesh::check_warp(result, warp));
  if (!notices.note.empty()) console.note(notices.note);
  for (const std::string& w : notices.warnings) console.warning(w);
}

void warn_of_what_is_outside(const hexmesh::Result& result, const hexmesh::Grid& voxels, const Console& console) {
  if (const std::string warning = hexmesh::warning_of_grid(result, voxels); !warning.empty()) console.warning(warning);
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
