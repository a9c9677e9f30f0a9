// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>

#include "cli/parse.h"
#include "gather.h"
#include "hexmesh/core/error.h"
#include "hexmesh/file/markup_file.h"
#include "hexmesh/scan/clean.h"
#include "hexmesh/volume/region.h"

namespace hextools {
namespace {

using hexmesh::Error;
using hexmesh::ErrorKind;
using hexmesh::Grid;
using hexmesh::LabelVolume;
using hexmesh::Segmentation;

/// "5=liver", "liver", "5" or "SCT:10200004".
hexmesh::SegmentChoice parse_segment(const std::string& text) {
  if (text.find('=') == std::string::npos) return {text, ""};
  const auto [what, name] = parse_pair("--segment", text, "NAME, LABEL, CODE or one of them =NAME");
  return {what, name};
}

LabelVolume one_label_per_voxel(const ScanOptions& o, Segmentation segmentation, const Console& console) {
  std::vector<hexmesh::SegmentChoice> choices;
  for (const std::string& text : o.segments) choices.push_back(parse_segment(text));
  std::vector<hexmesh::Overlap> overlaps;
  LabelVolume out = hexmesh::flatten(hexmesh::select_segments(std::move(segmentation), choices), o.priority, overlaps);
  for (const hexmesh::Overlap& overlap : overlaps)
    console.warning(fmt::format("{} voxels ({:.2f} mL) are of '{}' and of '{}': the former wins (--priority)",
                                overlap.voxels, static_cast<double>(overlap.voxels) * out.grid.voxel_volume() / 1000,
                                overlap.winner, overlap.loser));
  return out;
}

hexmesh::Box zone_of_interest(const ScanOptions& o, const Input* markup) {
  if (markup) {
    const std::optional<hexmesh::Box> box = hexmesh::read_markup(markup->path()).box;
    if (!box) throw Error(ErrorKind::input, fmt::format("--roi-markup '{}' holds no ROI, expected one", o.roi_markup));
    return *box;
  }
  const auto [x0, x1, y0, y1, z0, z1] = parse_numbers<6>(o.roi).value_or(std::array<double, 6>{});
  if (!(x0 < x1 && y0 < y1 && z0 < z1))
    throw Error(ErrorKind::usage,
                fmt::format("--roi-mm '{}', expected x0,x1,y0,y1,z0,z1 with x0 < x1, y0 < y1, z0 < z1", o.roi));
  return hexmesh::box_between({x0, y0, z0}, {x1, y1, z1});
}

LabelVolume cut_out(const ScanOptions& o, const Input* markup, LabelVolume volume) {
  if (!o.roi.empty() || markup)
    return hexmesh::crop_to_box(volume, hexmesh::enlarged(zone_of_interest(o, markup), std::max(o.margin, 0.0)));
  return o.margin >= 0 ? hexmesh::crop_to_segments(volume, o.margin) : volume;
}

void clean(const ScanOptions& o, LabelVolume& volume, const Console& console) {
  const auto report = [&](const std::string& step, const hexmesh::Cleaning& cleaning) {
    for (std::size_t s = 0; s < volume.segments.size(); ++s) {
      const auto ml = [&](std::size_t voxels) {
        return static_cast<double>(voxels) * volume.grid.voxel_volume() / 1000;
      };
      console.note(fmt::format("segment '{}', {}: {} voxels ({:.2f} mL) removed, {} ({:.2f} mL) added",
                               volume.segments[s].name, step, cleaning.removed[s], ml(cleaning.removed[s]),
                               cleaning.added[s], ml(cleaning.added[s])));
    }
  };
  if (o.open > 0) report(fmt::format("opening by {:g} mm", o.open), hexmesh::open_segments(volume, o.open));
  if (o.close > 0) report(fmt::format("closing by {:g} mm", o.close), hexmesh::close_segments(volume, o.close));
  if (o.fill_cavities) report("cavities filled", hexmesh::fill_cavities(volume));
  if (o.specks_ml > 0)
    report(fmt::format("specks below {:g} mL", o.specks_ml), hexmesh::remove_specks(volume, o.specks_ml));
  if (o.largest_component) report("largest part kept", hexmesh::keep_largest_component(volume));
}

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

Sources sources_of(const ScanOptions& o, RunFiles& files) {
  Sources sources;
  for (const std::string& name : o.inputs) sources.files.push_back(&files.input(name));
  for (const std::string& text : o.named_inputs) {
    const auto [name, file] = parse_pair("--input", text, "NAME=FILE");
    sources.named.emplace_back(name, &files.input(file));
  }
  return sources;
}

int run_conversion(const ScanOptions& o, const CommonOptions& common, const Console& console) {
  const bool labels_wanted = !o.inputs.empty() || !o.named_inputs.empty();
  if (!labels_wanted && o.intensity.empty())
    throw Error(ErrorKind::usage, "no input, expected a segmentation, --input NAME=FILE or --intensity SCAN");
  if (labels_wanted && o.output.empty()) throw Error(ErrorKind::usage, "no output, expected -o OUT.nrrd");
  if (o.intensity.empty() != o.intensity_output.empty())
    throw Error(ErrorKind::usage, "--intensity SCAN and --intensity-out OUT.nrrd go together");
  RunFiles files(common);
  const Sources sources = sources_of(o, files);
  const Input* scan = files.input_if_named(o.intensity);
  const Input* roi = files.input_if_named(o.roi_markup);
  Output* output = labels_wanted ? volume_if_named(o.output, files) : nullptr;
  Output* intensity_output = volume_if_named(o.intensity_output, files);

  hexmesh::ReadOptions options = read_options(o, files, console);
  std::optional<hexmesh::IntensityVolume> intensity;
  if (scan) {
    std::optional<Grid> stored;
    intensity = hexmesh::read_intensity(scan->path(), options, &stored);
    options.reference = stored;
  }
  if (labels_wanted) {
    LabelVolume volume = one_label_per_voxel(o, gather(o, sources, options, console), console);
    volume = cut_out(o, roi, std::move(volume));
    clean(o, volume, console);
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

void add_cleaning(CLI::App& app, ScanOptions& o) {
  const auto add = [&](const char* name, double& value, const char* text) {
    app.add_option(name, value, text)->check(CLI::Range(0.001, 100.0))->group("Cleaning, in this order");
  };
  add("--open", o.open, "Erode, then dilate by this radius [mm]: cuts spikes and thin bridges");
  add("--close", o.close, "Dilate, then erode by this radius [mm]: fills thin gaps");
  app.add_flag("--fill-cavities", o.fill_cavities, "Give to each segment the background it encloses")
      ->group("Cleaning, in this order");
  add("--remove-specks", o.specks_ml, "Remove parts smaller than this [mL]");
  app.add_flag("--largest-component", o.largest_component,
               "Keep of each segment only the largest part that hangs together through voxel faces")
      ->group("Cleaning, in this order");
}

}  // namespace

std::function<int()> declare_conversion(CLI::App& app, const std::shared_ptr<ScanOptions>& o,
                                        const CommonOptions& common, const Console& console) {
  app.add_option("inputs", o->inputs,
                 "Segmentations: NRRD, .seg.nrrd, NIfTI, MetaImage, VTI; DICOM SEG and RTSTRUCT as files or "
                 "folders; surfaces and lines as OBJ, STL, PLY, OFF, VTP; - is standard input. Later ones win "
                 "where they overlap");
  add_repeated(app, "--input", o->named_inputs,
               "NAME=FILE: all that the file holds as one segment of that name; these come after the other inputs");
  add_label_names(app, *o);
  add_repeated(app, "--segment", o->segments,
               "Keep only this segment: NAME, LABEL or terminology code (SCT:10200004), with =NAME to name it; "
               "may be given often");
  add_repeated(app, "--priority", o->priority, "Segments that win where segments overlap, the first most")
      ->delimiter(',');
  app.add_option("--fraction", o->fraction, "Of a fractional DICOM SEG: least share of a voxel, 0 to 1")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  app.add_option("--series", o->series, "SeriesInstanceUID, or its end, where DICOM files hold several");
  app.add_option("--spacing", o->spacing, "Edge of the cubic voxels of surfaces and lines [mm]")
      ->check(CLI::Range(1e-6, 1000.0));
  app.add_option("--scale", o->scale, "Multiply the coordinates of surfaces and lines: 1000 where they are in metres")
      ->check(CLI::Range(1e-6, 1e6))
      ->capture_default_str();
  CLI::Option* roi = app.add_option("--roi-mm", o->roi, "Zone of interest x0,x1,y0,y1,z0,z1 in LPS [mm]");
  app.add_option("--roi-markup", o->roi_markup, "Zone of interest: a 3D Slicer ROI (.mrk.json)")->excludes(roi);
  app.add_option("--margin", o->margin,
                 "Room around the zone of interest, or else around the segments [mm], >= 0; the rest is cut off")
      ->check(CLI::NonNegativeNumber);
  add_cleaning(app, *o);
  app.add_option("--intensity", o->intensity, "The scan: any of the image formats, or a folder with a DICOM series");
  app.add_option("--intensity-out", o->intensity_output, "Write its grey values on the labels' grid (NRRD)");
  app.add_option("-o,--output", o->output, "Labelled NRRD; - is standard output");
  return [o, &common, &console] { return run_conversion(*o, common, console); };
}

}  // namespace hextools
