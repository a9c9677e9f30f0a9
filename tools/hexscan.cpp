// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <charconv>

#include "cli/tool.h"
#include "hexmesh/core/error.h"
#include "hexmesh/scan/clean.h"
#include "hexmesh/scan/image_io.h"
#include "hexmesh/scan/phantom.h"

namespace {

using namespace hextools;
using hexmesh::Error;
using hexmesh::ErrorKind;
using hexmesh::LabelVolume;

struct Options {
  std::vector<std::string> inputs, named_inputs, segments;
  bool largest_component = false;
  std::string output;
  std::string phantom;
  double spacing = 2;
  std::vector<std::string> settings;
  std::string intensity_output;
};

/// "5=liver", "liver" or "5".
hexmesh::SegmentChoice parse_segment(const std::string& text) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos) return {text, ""};
  if (equals == 0 || equals + 1 == text.size())
    throw Error(ErrorKind::usage, fmt::format("--segment '{}', expected NAME, LABEL or LABEL=NAME", text));
  return {text.substr(0, equals), text.substr(equals + 1)};
}

/// "liver=FILE": every label of the file becomes one segment of that name.
LabelVolume read_named(const std::string& text) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0 || equals + 1 == text.size())
    throw Error(ErrorKind::usage, fmt::format("--input '{}', expected NAME=FILE", text));
  const hexmesh::InputFile file(text.substr(equals + 1));
  LabelVolume volume = hexmesh::read_labels(file.path());
  const std::array<double, 3> color =
      volume.segments.empty() ? hexmesh::Segment{}.color : volume.segments.front().color;
  for (std::uint16_t& label : volume.labels) label = label != 0;
  volume.segments = {{1, text.substr(0, equals), color}};
  return volume;
}

void summarize(const LabelVolume& volume, const Console& console) {
  const std::vector<std::size_t> counts = hexmesh::count_voxels(volume);
  if (std::count(counts.begin(), counts.end(), 0U) == static_cast<std::ptrdiff_t>(counts.size()))
    console.warning("no voxel has a label");
  for (std::size_t s = 0; s < counts.size(); ++s)
    console.note(fmt::format("segment {} '{}': {} voxels, {:.1f} mL", volume.segments[s].label, volume.segments[s].name,
                             counts[s], static_cast<double>(counts[s]) * volume.grid.voxel_volume() / 1000));
}

std::unique_ptr<hexmesh::OutputFile> open_labels(const Options& o, const CommonOptions& common) {
  std::vector<std::string> inputs = o.inputs;
  for (const std::string& named : o.named_inputs) inputs.push_back(named.substr(named.find('=') + 1));
  return open_output(o.output, ".nrrd", common, inputs);
}

int run_scan(const Options& o, const CommonOptions& common, const Console& console) {
  const auto output = open_labels(o, common);
  std::vector<LabelVolume> volumes;
  for (const std::string& name : o.inputs) {
    const hexmesh::InputFile file(name);
    volumes.push_back(hexmesh::read_labels(file.path()));
  }
  for (const std::string& named : o.named_inputs) volumes.push_back(read_named(named));
  if (volumes.empty()) throw Error(ErrorKind::usage, "no input, expected a label volume or --input NAME=FILE");
  LabelVolume volume = std::move(volumes.front());
  for (std::size_t n = 1; n < volumes.size(); ++n) {
    std::size_t overlap = 0;
    volume = hexmesh::overlay(std::move(volume), volumes[n], overlap);
    if (overlap > 0)
      console.warning(
          fmt::format("{} voxels lie in input {} and in one before it; input {} wins", overlap, n + 1, n + 1));
  }
  std::vector<hexmesh::SegmentChoice> choices;
  for (const std::string& text : o.segments) choices.push_back(parse_segment(text));
  volume = hexmesh::select_segments(std::move(volume), choices);
  if (o.largest_component) {
    std::vector<std::size_t> removed;
    volume = hexmesh::keep_largest_component(std::move(volume), removed);
    for (std::size_t s = 0; s < removed.size(); ++s)
      console.note(fmt::format("segment '{}': {} voxels ({:.2f} mL) outside its largest part removed",
                               volume.segments[s].name, removed[s],
                               static_cast<double>(removed[s]) * volume.grid.voxel_volume() / 1000));
  }
  summarize(volume, console);
  hexmesh::write_labels(volume, output->path());
  output->commit();
  return 0;
}

/// "length=80", "rotate_x=20" (degrees) or "shift_x=1" (mm).
void apply_setting(const std::string& text, hexmesh::SolidPhantom& solid) {
  const std::size_t equals = text.find('=');
  const std::string key = text.substr(0, equals);
  double value = 0;
  const char* end = text.data() + text.size();
  const char* start = equals == std::string::npos ? end : text.data() + equals + 1;
  if (const auto [stop, failed] = std::from_chars(start, end, value); failed != std::errc() || stop != end)
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
  solid.spacing = o.spacing;
  for (const std::string& setting : o.settings) apply_setting(setting, solid);
  const auto output = open_labels(o, common);
  const LabelVolume labels = hexmesh::solid_phantom(solid);
  summarize(labels, console);
  hexmesh::write_labels(labels, output->path());
  output->commit();
  return 0;
}

int run_phantom(const Options& o, const CommonOptions& common, const Console& console) {
  if (o.phantom != "liver") return run_solid(o, common, console);
  if (!o.settings.empty())
    throw Error(ErrorKind::usage, fmt::format("--set '{}' goes with solids, the liver has no sizes", o.settings[0]));
  const auto output = open_labels(o, common);
  std::unique_ptr<hexmesh::OutputFile> intensity;
  if (!o.intensity_output.empty()) intensity = open_output(o.intensity_output, ".nrrd", common, {});
  const hexmesh::Phantom phantom = hexmesh::liver_phantom(o.spacing);
  summarize(phantom.labels, console);
  hexmesh::write_labels(phantom.labels, output->path());
  if (intensity) {
    hexmesh::write_intensity(phantom.intensity, intensity->path());
    intensity->commit();
  }
  output->commit();
  return 0;
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
                        "Label volumes: NIfTI, NRRD, .seg.nrrd, MetaImage; - is standard input. Later ones win where "
                        "they overlap");
         app.add_option("--input", o->named_inputs, "NAME=FILE: all labels of the file as one segment of that name");
         app.add_option("--segment", o->segments,
                        "Keep only this segment: NAME, LABEL, or LABEL=NAME to name it; may be given often");
         app.add_flag("--largest-component", o->largest_component,
                      "Keep of each segment only the largest part that hangs together through voxel faces");
         CLI::Option* output = app.add_option("-o,--output", o->output, "Labelled NRRD; - is standard output");
         CLI::App* phantom = app.add_subcommand("phantom", "Make a phantom instead of reading a scan");
         std::vector<std::string> names = {"liver"};
         std::string sizes;
         for (const auto& [name, defaults] : hexmesh::solid_phantoms()) {
           names.push_back(name);
           sizes += "; " + name;
           for (const auto& [key, value] : defaults) sizes += fmt::format(" {}={:g}", key, value);
         }
         phantom->add_option("name", o->phantom, "Which phantom")->required()->check(CLI::IsMember(names));
         phantom->add_option("--set", o->settings,
                             "KEY=NUMBER of a solid: its sizes [mm], rotate_x, rotate_y, rotate_z [degrees], shift_x, "
                             "shift_y, shift_z [mm]. Sizes" +
                                 sizes);
         phantom->add_option("--spacing", o->spacing, "Edge of the cubic voxels [mm], 0.25 to 10")
             ->check(CLI::Range(0.25, 10.0))
             ->capture_default_str();
         phantom->add_option("--intensity-out", o->intensity_output, "Write the CT-like grey values (NRRD)");
         output->required();
         return [=, &common, &console] {
           return phantom->parsed() ? run_phantom(*o, common, console) : run_scan(*o, common, console);
         };
       }});
}
