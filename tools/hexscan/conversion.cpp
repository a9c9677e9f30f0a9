// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>

#include "hexmesh/core/error.h"
#include "options.h"
#include "segments/segment_reader.h"

namespace hextools {
namespace {

using hexmesh::Error;
using hexmesh::ErrorKind;
using hexmesh::Grid;
using hexmesh::LabelVolume;

/// Labelled voxels beyond the scan get its lowest grey value.
void warn_uncovered(const LabelVolume& volume, const Grid& scan, const Console& console) {
  std::size_t labelled = 0, outside = 0;
  for (std::size_t n = 0; n < volume.labels.size(); ++n) {
    if (volume.labels[n] == 0) continue;
    ++labelled;
    const hexmesh::Index3 v = volume.grid.index(n);
    const hexmesh::Vec3 position = volume.grid.position(hexmesh::Vec3(v[0], v[1], v[2]));
    if (!scan.covers(scan.continuous_index(position))) ++outside;
  }
  if (outside > 0 && outside == labelled)
    throw Error(ErrorKind::geometry,
                "the scan covers none of the labelled voxels, expected the scan they were drawn on");
  if (outside > 0)
    console.warning(
        fmt::format("{} of {} labelled voxels lie outside the scan and get its lowest grey value", outside, labelled));
}

int run_conversion(const ScanOptions& o, const CommonOptions& common, const Console& console) {
  const bool labels_wanted = o.has_inputs();
  if (!labels_wanted && o.intensity.empty())
    throw Error(ErrorKind::usage, "no input, expected a segmentation, --input NAME=FILE or --intensity SCAN");
  if (labels_wanted && o.output.empty()) throw Error(ErrorKind::usage, "no output, expected -o OUT.nrrd");
  if (o.intensity.empty() != o.intensity_output.empty())
    throw Error(ErrorKind::usage, "--intensity SCAN and --intensity-out OUT.nrrd go together");
  RunFiles files(common);
  std::optional<SegmentReader> segments;
  if (labels_wanted) segments.emplace(o, files, console);
  const Input* scan = files.input_if_named(o.intensity);
  Output* output = labels_wanted ? volume_if_named(o.output, files) : nullptr;
  Output* intensity_output = volume_if_named(o.intensity_output, files);

  std::optional<hexmesh::IntensityVolume> intensity;
  if (scan) {
    std::optional<Grid> stored;
    intensity = hexmesh::read_intensity(scan->path(),
                                        segments ? segments->options() : read_options(o, nullptr, console), &stored);
    if (segments) segments->set_reference(stored);
  }
  if (labels_wanted) {
    const LabelVolume volume = segments->read();
    if (intensity) warn_uncovered(volume, intensity->grid, console);
    note_segments(volume, console);
    hexmesh::write_labels(volume, output->path());
    if (intensity && !hexmesh::same_grid(intensity->grid, volume.grid)) {
      if (!hexmesh::same_lattice_of_voxels(intensity->grid, volume.grid))
        console.warning("the scan lies on another grid than the labels: its grey values are interpolated to theirs");
      intensity = hexmesh::place_on(*intensity, volume.grid);
    }
  }
  if (intensity) hexmesh::write_intensity(*intensity, intensity_output->path());
  files.commit();
  return 0;
}

}  // namespace

std::function<int()> declare_conversion(CLI::App& app, const std::shared_ptr<ScanOptions>& o,
                                        const CommonOptions& common, const Console& console) {
  add_segment_options(app, *o);
  app.add_option("--intensity", o->intensity, "The scan: any of the image formats, or a folder with a DICOM series");
  app.add_option("--intensity-out", o->intensity_output, "Write its grey values on the labels' grid (NRRD)");
  app.add_option("-o,--output", o->output, "Labelled NRRD; - is standard output");
  return [o, &common, &console] { return run_conversion(*o, common, console); };
}

}  // namespace hextools
