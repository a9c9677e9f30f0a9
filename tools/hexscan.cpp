// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <sstream>

#include "cli/scan_report.h"
#include "cli/tool.h"
#include "hexmesh/core/error.h"
#include "hexmesh/scan/clean.h"
#include "hexmesh/scan/image_io.h"
#include "hexmesh/scan/phantom.h"
#include "hexmesh/scan/region.h"
#include "hexmesh/surface/surface_file.h"
#include "hexmesh/surface/voxelize.h"

namespace {

using namespace hextools;
using hexmesh::Error;
using hexmesh::ErrorKind;
using hexmesh::Grid;
using hexmesh::LabelVolume;
using hexmesh::Segmentation;

struct Options {
  std::vector<std::string> inputs, named_inputs, segments, priority;
  std::string series, roi_markup, intensity, intensity_output, output;
  std::string roi;
  double fraction = 0.5, spacing = 0, margin = -1, max_memory_mb = 0;
  double open = 0, close = 0, specks_ml = 0;
  bool fill_cavities = false, largest_component = false;
  std::string phantom;
  double phantom_spacing = 2;
  std::vector<std::string> settings;
  bool json = false;
};

/// "A=B" in its two parts.
std::pair<std::string, std::string> split(const std::string& option, const std::string& text,
                                          const std::string& expected) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0 || equals + 1 == text.size())
    throw Error(ErrorKind::usage, fmt::format("{} '{}', expected {}", option, text, expected));
  return {text.substr(0, equals), text.substr(equals + 1)};
}

/// "5=liver", "liver", "5" or "SCT:10200004".
hexmesh::SegmentChoice parse_segment(const std::string& text) {
  if (text.find('=') == std::string::npos) return {text, ""};
  const auto [what, name] = split("--segment", text, "NAME, LABEL, CODE or one of them =NAME");
  return {what, name};
}

hexmesh::ReadOptions read_options(const Options& o, const Console& console) {
  hexmesh::ReadOptions options;
  options.fraction = o.fraction;
  options.series = o.series;
  options.max_memory =
      static_cast<std::size_t>(1e6 * (o.max_memory_mb > 0 ? o.max_memory_mb : 0.8 * machine_memory_mb()));
  options.warn = warning_on(console);
  return options;
}

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
struct Sources {
  std::vector<Segmentation> volumes;
  std::vector<hexmesh::Shape> shapes;
  std::vector<std::string> shape_names;
};

Sources read_sources(const Options& o, const hexmesh::ReadOptions& options) {
  Sources out;
  std::vector<std::unique_ptr<hexmesh::InputFile>> files;  // standard input stays until all is read
  const auto open = [&](const std::string& name) {
    files.push_back(std::make_unique<hexmesh::InputFile>(name));
    return files.back()->path();
  };
  const auto add_shape = [&](const std::string& name, const std::filesystem::path& path) {
    out.shapes.push_back(hexmesh::read_shape(path));
    out.shape_names.push_back(name);
  };
  std::vector<std::filesystem::path> dicom;
  for (const std::string& input : o.inputs) {
    const std::filesystem::path path = open(input);
    if (hexmesh::is_surface_name(path)) {
      add_shape(path.stem().string(), path);
    } else if (hexmesh::is_dicom(path)) {
      dicom.push_back(path);
    } else {
      out.volumes.push_back(hexmesh::read_segmentation({path}, options));
      if (o.inputs.size() > 1) name_after_file(out.volumes.back(), path);
    }
  }
  if (!dicom.empty()) out.volumes.insert(out.volumes.begin(), hexmesh::read_segmentation(dicom, options));
  for (const std::string& text : o.named_inputs) {
    const auto [name, file] = split("--input", text, "NAME=FILE");
    const std::filesystem::path path = open(file);
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
std::vector<Grid> grids_of_shapes(const Options& o, const Sources& sources) {
  if (sources.volumes.empty() && o.spacing == 0)
    throw Error(ErrorKind::usage, "surfaces have no voxels of their own, expected --spacing MM");
  if (!sources.volumes.empty() && o.spacing != 0)
    throw Error(
        ErrorKind::usage,
        fmt::format("--spacing {} goes with surfaces alone, the voxels of the label volume are used", o.spacing));
  if (sources.shapes.empty()) return {};
  return {hexmesh::grid_around(
      sources.shapes, sources.volumes.empty() ? o.spacing : sources.volumes.front().grid.spacing().minCoeff())};
}

void report_shape(const std::string& name, const hexmesh::Voxelization& v, const Grid& grid, const Console& console) {
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
  constexpr double lost = 0.9;
  if (v.open_parts == 0 && ml < lost * v.enclosed_ml)
    console.warning(
        fmt::format("surface '{}' encloses {:.4g} mL, its voxels {:.4g} mL: parts thinner than a voxel are "
                    "lost, expected a smaller --spacing",
                    name, v.enclosed_ml, ml));
}

/// All inputs as segments of one grid.
Segmentation gather(const Options& o, const hexmesh::ReadOptions& options, const Console& console) {
  Sources sources = read_sources(o, options);
  const std::vector<Grid> around = grids_of_shapes(o, sources);
  Segmentation out = sources.volumes.empty() ? Segmentation{around.front(), {}, {}}
                                             : hexmesh::join(std::move(sources.volumes), around, options.warn);
  for (std::size_t n = 0; n < sources.shapes.size(); ++n) {
    const std::string& name = sources.shape_names[n];
    const hexmesh::Voxelization voxels = hexmesh::voxelize(sources.shapes[n], out.grid);
    report_shape(name, voxels, out.grid, console);
    Segmentation added{out.grid, {}, {}};
    hexmesh::add_segment(added, {1, name, hexmesh::distinct_color(n), ""}, voxels.voxels);
    out = hexmesh::combine(std::move(out), std::move(added));
  }
  return out;
}

LabelVolume one_label_per_voxel(const Options& o, Segmentation segmentation, const Console& console) {
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

hexmesh::Box zone_of_interest(const Options& o) {
  std::optional<hexmesh::Box> box;
  if (!o.roi_markup.empty()) {
    box = hexmesh::read_markup(o.roi_markup).box;
    if (!box) throw Error(ErrorKind::input, fmt::format("--roi-markup '{}' holds no ROI, expected one", o.roi_markup));
  } else {
    hexmesh::Vec3 low, high;
    char comma = ',';
    std::istringstream numbers(o.roi);
    for (int d = 0; d < 3; ++d) {
      if (d > 0) numbers >> comma;
      numbers >> low[d] >> comma >> high[d];
    }
    if (!numbers || numbers.peek() != EOF || !((high - low).minCoeff() > 0))
      throw Error(ErrorKind::usage,
                  fmt::format("--roi-mm '{}', expected x0,x1,y0,y1,z0,z1 with x0 < x1, y0 < y1, z0 < z1", o.roi));
    box = hexmesh::box_between(low, high);
  }
  return hexmesh::enlarged(*box, std::max(o.margin, 0.0));
}

LabelVolume cut_out(const Options& o, LabelVolume volume) {
  if (!o.roi.empty() || !o.roi_markup.empty()) return hexmesh::crop_to_box(volume, zone_of_interest(o));
  return o.margin >= 0 ? hexmesh::crop_to_segments(volume, o.margin) : volume;
}

void clean(const Options& o, LabelVolume& volume, const Console& console) {
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

void summarize(const LabelVolume& volume, const Console& console) {
  const std::vector<std::size_t> counts = hexmesh::count_voxels(volume);
  if (std::count(counts.begin(), counts.end(), 0U) == static_cast<std::ptrdiff_t>(counts.size()))
    console.warning("no voxel has a label");
  for (std::size_t s = 0; s < counts.size(); ++s)
    console.note(fmt::format("segment {} '{}': {} voxels, {:.1f} mL", volume.segments[s].label, volume.segments[s].name,
                             counts[s], static_cast<double>(counts[s]) * volume.grid.voxel_volume() / 1000));
}

std::unique_ptr<hexmesh::OutputFile> open_volume(const std::string& name, const Options& o,
                                                 const CommonOptions& common) {
  for (const char* other : {".nii", ".nii.gz", ".mha", ".mhd", ".vti", ".dcm", ".stl", ".obj"})
    if (name.ends_with(other))
      throw Error(ErrorKind::usage, fmt::format("output '{}' would hold an NRRD, expected a name in .nrrd", name));
  std::vector<std::string> inputs = o.inputs;
  for (const std::string& named : o.named_inputs) inputs.push_back(named.substr(named.find('=') + 1));
  inputs.push_back(o.intensity);
  return open_output(name, ".nrrd", common, inputs);
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

int run_scan(const Options& o, const CommonOptions& common, const Console& console) {
  const bool labels_wanted = !o.inputs.empty() || !o.named_inputs.empty();
  if (!labels_wanted && o.intensity.empty())
    throw Error(ErrorKind::usage, "no input, expected a segmentation, --input NAME=FILE or --intensity SCAN");
  if (labels_wanted && o.output.empty()) throw Error(ErrorKind::usage, "no output, expected -o OUT.nrrd");
  if (o.intensity.empty() != o.intensity_output.empty())
    throw Error(ErrorKind::usage, "--intensity SCAN and --intensity-out OUT.nrrd go together");
  if (!o.output.empty() && o.output == o.intensity_output)
    throw Error(ErrorKind::usage, fmt::format("-o and --intensity-out are both '{}', expected two names", o.output));
  const auto output = labels_wanted ? open_volume(o.output, o, common) : nullptr;
  const auto intensity_output = o.intensity.empty() ? nullptr : open_volume(o.intensity_output, o, common);

  hexmesh::ReadOptions options = read_options(o, console);
  std::optional<hexmesh::IntensityVolume> intensity;
  if (!o.intensity.empty()) {
    const hexmesh::InputFile file(o.intensity);
    std::optional<Grid> stored;
    intensity = hexmesh::read_intensity(file.path(), options, &stored);
    options.reference = stored;
  }
  if (labels_wanted) {
    LabelVolume volume = one_label_per_voxel(o, gather(o, options, console), console);
    volume = cut_out(o, std::move(volume));
    clean(o, volume, console);
    if (intensity) warn_uncovered(volume, intensity->grid, console);
    summarize(volume, console);
    hexmesh::write_labels(volume, output->path());
    if (intensity && !hexmesh::same_grid(intensity->grid, volume.grid)) {
      if (!hexmesh::same_lattice_of_voxels(intensity->grid, volume.grid))
        console.warning("the scan lies on another grid than the labels: its grey values are interpolated to theirs");
      intensity = hexmesh::place_on(*intensity, volume.grid);
    }
  }
  if (intensity) {
    hexmesh::write_intensity(*intensity, intensity_output->path());
    intensity_output->commit();
  }
  if (output) output->commit();
  return 0;
}

int run_info(const Options& o, const CommonOptions& common, const Console& console) {
  std::vector<std::string> warnings;
  hexmesh::ReadOptions options = read_options(o, console);
  options.warn = [&](const std::string& message) { warnings.push_back(message); };
  std::vector<std::unique_ptr<hexmesh::InputFile>> files;
  std::vector<std::filesystem::path> paths;
  for (const std::string& input : o.inputs) {
    files.push_back(std::make_unique<hexmesh::InputFile>(input));
    paths.push_back(files.back()->path());
  }
  if (paths.empty()) throw Error(ErrorKind::usage, "no input, expected a file or folder");
  const std::string text = describe_scans(paths, options, warnings, o.json);
  write_text("-", text, common);
  if (!o.json)
    for (const std::string& warning : warnings) console.warning(warning);
  return 0;
}

/// "length=80", "rotate_x=20" (degrees) or "shift_x=1" (mm).
void apply_setting(const std::string& text, hexmesh::SolidPhantom& solid) {
  const auto [key, number] = split("--set", text, "KEY=NUMBER");
  double value = 0;
  const char* end = number.data() + number.size();
  if (const auto [stop, failed] = std::from_chars(number.data(), end, value); failed != std::errc() || stop != end)
    throw Error(ErrorKind::usage, fmt::format("--set '{}', expected KEY=NUMBER", text));
  const std::string axes = "xyz";
  const std::size_t axis = key.size() > 2 && key[key.size() - 2] == '_' ? axes.find(key.back()) : std::string::npos;
  const auto d = static_cast<Eigen::Index>(axis);
  if (axis != std::string::npos && key.starts_with("rotate_"))
    solid.rotation[d] = value;
  else if (axis != std::string::npos && key.starts_with("shift_"))
    solid.shift[d] = value;
  else
    solid.size[key] = value;
}

int run_solid(const Options& o, const CommonOptions& common, const Console& console) {
  if (!o.intensity_output.empty())
    throw Error(ErrorKind::usage, fmt::format("--intensity-out goes with the liver, phantom '{}' has none", o.phantom));
  hexmesh::SolidPhantom solid;
  solid.name = o.phantom;
  solid.spacing = o.phantom_spacing;
  for (const std::string& setting : o.settings) apply_setting(setting, solid);
  const auto output = open_volume(o.output, o, common);
  const LabelVolume labels = hexmesh::solid_phantom(solid);
  summarize(labels, console);
  hexmesh::write_labels(labels, output->path());
  output->commit();
  return 0;
}

int run_phantom(const Options& o, const CommonOptions& common, const Console& console) {
  if (o.output.empty()) throw Error(ErrorKind::usage, "no output, expected -o OUT.nrrd");
  if (o.phantom != "liver") return run_solid(o, common, console);
  if (!o.settings.empty())
    throw Error(ErrorKind::usage, fmt::format("--set '{}' goes with solids, the liver has no sizes", o.settings[0]));
  const auto output = open_volume(o.output, o, common);
  std::unique_ptr<hexmesh::OutputFile> intensity;
  if (!o.intensity_output.empty()) intensity = open_volume(o.intensity_output, o, common);
  const hexmesh::Phantom phantom = hexmesh::liver_phantom(o.phantom_spacing);
  summarize(phantom.labels, console);
  hexmesh::write_labels(phantom.labels, output->path());
  if (intensity) {
    hexmesh::write_intensity(phantom.intensity, intensity->path());
    intensity->commit();
  }
  output->commit();
  return 0;
}

CLI::App* add_phantom(CLI::App& app, Options& o) {
  CLI::App* phantom = app.add_subcommand("phantom", "Make a phantom instead of reading a scan");
  std::vector<std::string> names = {"liver"};
  std::string sizes;
  for (const auto& [name, defaults] : hexmesh::solid_phantoms()) {
    names.push_back(name);
    sizes += "; " + name;
    for (const auto& [key, value] : defaults) sizes += fmt::format(" {}={:g}", key, value);
  }
  phantom->add_option("name", o.phantom, "Which phantom")->required()->check(CLI::IsMember(names));
  add_repeated(*phantom, "--set", o.settings,
               "KEY=NUMBER of a solid: its sizes [mm], rotate_x, rotate_y, rotate_z [degrees], shift_x, shift_y, "
               "shift_z [mm]. Sizes" +
                   sizes);
  phantom->add_option("--spacing", o.phantom_spacing, "Edge of the cubic voxels [mm], 0.25 to 10")
      ->check(CLI::Range(0.25, 10.0))
      ->capture_default_str();
  return phantom;
}

void add_cleaning(CLI::App& app, Options& o) {
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

int main(int argc, char** argv) {
  auto o = std::make_shared<Options>();
  return run_tool(
      argc, argv,
      {"hexscan", "Read segmentations and write one labelled volume (NRRD, as 3D Slicer's .seg.nrrd).",
       "hexscan phantom liver --spacing 4 -o liver.nrrd",
       [o](CLI::App& app, const CommonOptions& common, const Console& console) -> std::function<int()> {
         app.add_option("inputs", o->inputs,
                        "Segmentations: NRRD, .seg.nrrd, NIfTI, MetaImage, VTI; DICOM SEG and RTSTRUCT as files or "
                        "folders; surfaces and lines as OBJ, STL, PLY, OFF, VTP; - is standard input. Later ones win "
                        "where they overlap");
         add_repeated(
             app, "--input", o->named_inputs,
             "NAME=FILE: all that the file holds as one segment of that name; these come after the other inputs");
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
         CLI::Option* roi = app.add_option("--roi-mm", o->roi, "Zone of interest x0,x1,y0,y1,z0,z1 in LPS [mm]");
         app.add_option("--roi-markup", o->roi_markup, "Zone of interest: a 3D Slicer ROI (.mrk.json)")->excludes(roi);
         app.add_option("--margin", o->margin,
                        "Room around the zone of interest, or else around the segments [mm], >= 0; the rest is cut off")
             ->check(CLI::NonNegativeNumber);
         add_cleaning(app, *o);
         app.add_option("--intensity", o->intensity,
                        "The scan: any of the image formats, or a folder with a DICOM series");
         app.add_option("--intensity-out", o->intensity_output, "Write its grey values on the labels' grid (NRRD)");
         app.add_option("--max-memory", o->max_memory_mb,
                        "Refuse an input whose voxels need more [MB]; default: four fifths of the machine's")
             ->check(CLI::PositiveNumber);
         app.add_option("-o,--output", o->output, "Labelled NRRD; - is standard output");
         CLI::App* phantom = add_phantom(app, *o);
         CLI::App* info = app.add_subcommand("info", "Say what inputs hold: grid, orientation, segments, warnings");
         info->add_option("inputs", o->inputs, "Any input of hexscan, or a scan")->required();
         info->add_flag("--json", o->json, "As JSON");
         return [=, &common, &console] {
           return phantom->parsed() ? run_phantom(*o, common, console)
                  : info->parsed()  ? run_info(*o, common, console)
                                    : run_scan(*o, common, console);
         };
       }});
}
