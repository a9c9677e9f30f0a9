// SPDX-License-Identifier: Apache-2.0
#include "segments/segment_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "cli/parse.h"
#include "hexmesh/core/error.h"
#include "hexmesh/file/markup_file.h"
#include "hexmesh/scan/clean.h"
#include "hexmesh/scan/isotropic.h"
#include "hexmesh/volume/region.h"
#include "segments/drawn_segment.h"

namespace hextools {
namespace {

using hexmesh::Error;
using hexmesh::ErrorKind;
using hexmesh::LabelVolume;
using hexmesh::Segmentation;

/// "5=liver", "liver", "5" or "SCT:10200004".
hexmesh::SegmentChoice parse_segment(const std::string& text) {
  if (text.find('=') == std::string::npos) return {text, ""};
  const auto [what, name] = parse_pair("--segment", text, "NAME, LABEL, CODE or one of them =NAME");
  return {what, name};
}

LabelVolume one_label_per_voxel(const SegmentOptions& o, Segmentation segmentation, const Console& console) {
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

std::optional<hexmesh::Box> zone_of_interest(const SegmentOptions& o, const Input* markup) {
  if (o.roi.empty() && !markup) return {};
  if (markup) {
    const std::optional<hexmesh::Box> box = hexmesh::read_markup(markup->path()).box;
    if (!box)
      throw Error(ErrorKind::input, fmt::format("--roi (--roi-markup) '{}' holds no ROI, expected one", o.roi_markup));
    return *box;
  }
  const auto [x0, x1, y0, y1, z0, z1] = parse_numbers<6>(o.roi).value_or(std::array<double, 6>{});
  if (!(x0 < x1 && y0 < y1 && z0 < z1))
    throw Error(ErrorKind::usage,
                fmt::format("--box (--roi-mm) '{}', expected x0,x1,y0,y1,z0,z1 with x0 < x1, y0 < y1, z0 < z1", o.roi));
  return hexmesh::box_between({x0, y0, z0}, {x1, y1, z1});
}

LabelVolume cut_out(const SegmentOptions& o, const std::optional<hexmesh::Box>& zone, LabelVolume volume) {
  if (zone) return hexmesh::crop_to_box(volume, hexmesh::enlarged(*zone, std::max(o.margin, 0.0)));
  return o.margin >= 0 ? hexmesh::crop_to_segments(volume, o.margin) : volume;
}

void clean(const SegmentOptions& o, LabelVolume& volume, const Console& console) {
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

void make_isotropic(const SegmentOptions& o, LabelVolume& volume, const Console& console) {
  if (o.isotropic < 0) return;
  const hexmesh::Vec3& s = volume.grid.spacing();
  const double edge = o.isotropic > 0 ? o.isotropic : s.minCoeff();
  const std::vector<std::size_t> before = hexmesh::count_voxels(volume);
  const double voxel = volume.grid.voxel_volume() / 1000;
  const std::string was = fmt::format("{:.4g} x {:.4g} x {:.4g}", s[0], s[1], s[2]);
  volume = hexmesh::isotropic(volume, edge);
  const std::vector<std::size_t> after = hexmesh::count_voxels(volume);
  constexpr double most_off = 0.05;
  for (std::size_t n = 0; n < after.size(); ++n) {
    const double was_ml = static_cast<double>(before[n]) * voxel;
    const double is_ml = static_cast<double>(after[n]) * volume.grid.voxel_volume() / 1000;
    if (std::abs(is_ml - was_ml) > most_off * was_ml)
      throw Error(
          ErrorKind::geometry,
          fmt::format("voxels of {:g} mm make {:.3g} mL of segment '{}', which has {:.3g} mL, expected a smaller "
                      "--isotropic",
                      edge, is_ml, volume.segments[n].name, was_ml));
    console.note(fmt::format("segment '{}', voxels of {} mm made {:g} mm: {:.2f} mL of {:.2f} mL",
                             volume.segments[n].name, was, edge, is_ml, was_ml));
  }
}

Sources sources_of(const SegmentOptions& o, RunFiles& files) {
  Sources sources;
  for (const std::string& name : o.inputs) sources.files.push_back(&files.input(name));
  for (const std::string& text : o.named_inputs) {
    const auto [name, file] = parse_pair("--input", text, "NAME=FILE");
    sources.named.emplace_back(name, &files.input(file));
  }
  return sources;
}

}  // namespace

hexmesh::ReadOptions read_options(const SegmentOptions& o, const Input* names, const Console& console) {
  hexmesh::ReadOptions options;
  options.fraction = o.fraction;
  options.series = o.series;
  options.warn = warning_on(console);
  if (names) options.names = hexmesh::read_label_table(names->path());
  return options;
}

SegmentReader::SegmentReader(const SegmentOptions& o, RunFiles& files, const Console& console)
    : o_(o),
      console_(console),
      sources_(sources_of(o, files)),
      roi_(files.input_if_named(o.roi_markup)),
      names_(files.input_if_named(o.label_names, Content::text)) {
  if (!o.has_inputs())
    throw Error(ErrorKind::usage, "no input, expected a segmentation, --input NAME=FILE or --as NAME");
  if (!o.name_of_drawn.empty() && !(o.named_inputs.empty() && o.segments.empty() && o.priority.empty()))
    throw Error(ErrorKind::usage, "--as makes one segment of a scan, expected no --input, --segment or --priority");
  read_ = read_options(o, names_, console);
}

std::vector<const Input*> SegmentReader::files() const {
  std::vector<const Input*> out = sources_.files;
  for (const auto& [name, file] : sources_.named) out.push_back(file);
  for (const Input* file : {roi_, names_})
    if (file) out.push_back(file);
  return out;
}

bool SegmentReader::has_dicom() const {
  const std::vector<const Input*> all = files();
  return std::any_of(all.begin(), all.end(), [](const Input* file) { return hexmesh::is_dicom(file->path()); });
}

LabelVolume SegmentReader::read() const {
  const std::optional<hexmesh::Box> zone = zone_of_interest(o_, roi_);
  LabelVolume volume = o_.name_of_drawn.empty()
                           ? one_label_per_voxel(o_, gather(o_, sources_, read_, console_), console_)
                           : drawn_segment(o_, sources_, zone, read_);
  volume = cut_out(o_, zone, std::move(volume));
  keep_connected(o_, volume);
  clean(o_, volume, console_);
  make_isotropic(o_, volume, console_);
  return volume;
}

}  // namespace hextools
