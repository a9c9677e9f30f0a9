// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/scan/phantom.h"

#include <fmt/format.h>

#include "cli/parse.h"
#include "hexmesh/core/error.h"
#include "options.h"

namespace hextools {
namespace {

using hexmesh::Error;
using hexmesh::ErrorKind;

struct PhantomOptions {
  std::string name;
  double spacing = 2;
  std::vector<std::string> settings;
};

/// "length=80", "rotate_x=20" (degrees) or "shift_x=1" (mm).
void apply_setting(const std::string& text, hexmesh::SolidPhantom& solid) {
  const auto [key, text_of_value] = parse_pair("--set", text, "KEY=NUMBER");
  const std::optional<double> value = parse_number<double>(text_of_value);
  if (!value) throw Error(ErrorKind::usage, fmt::format("--set '{}', expected KEY=NUMBER", text));
  const std::string axes = "xyz";
  const std::size_t axis = key.size() > 2 && key[key.size() - 2] == '_' ? axes.find(key.back()) : std::string::npos;
  const auto d = static_cast<Eigen::Index>(axis);
  if (axis != std::string::npos && key.starts_with("rotate_"))
    solid.rotation[d] = *value;
  else if (axis != std::string::npos && key.starts_with("shift_"))
    solid.shift[d] = *value;
  else
    solid.size[key] = *value;
}

int run_solid(const PhantomOptions& p, const ScanOptions& o, const CommonOptions& common, const Console& console) {
  if (!o.intensity_output.empty())
    throw Error(ErrorKind::usage, fmt::format("--intensity-out goes with the liver, phantom '{}' has none", p.name));
  hexmesh::SolidPhantom solid;
  solid.name = p.name;
  solid.spacing = p.spacing;
  for (const std::string& setting : p.settings) apply_setting(setting, solid);
  RunFiles files(common);
  Output* output = volume_if_named(o.output, files);
  const hexmesh::LabelVolume labels = hexmesh::solid_phantom(solid);
  note_segments(labels, console);
  hexmesh::write_labels(labels, output->path());
  files.commit();
  return 0;
}

int run_phantom(const PhantomOptions& p, const ScanOptions& o, const CommonOptions& common, const Console& console) {
  if (o.output.empty()) throw Error(ErrorKind::usage, "no output, expected -o OUT.nrrd");
  if (p.name != "liver") return run_solid(p, o, common, console);
  if (!p.settings.empty())
    throw Error(ErrorKind::usage, fmt::format("--set '{}' goes with solids, the liver has no sizes", p.settings[0]));
  RunFiles files(common);
  Output* output = volume_if_named(o.output, files);
  Output* intensity = volume_if_named(o.intensity_output, files);
  const hexmesh::Phantom phantom = hexmesh::liver_phantom(p.spacing);
  note_segments(phantom.labels, console);
  hexmesh::write_labels(phantom.labels, output->path());
  if (intensity) hexmesh::write_intensity(phantom.intensity, intensity->path());
  files.commit();
  return 0;
}

}  // namespace

std::function<int()> declare_phantom(CLI::App& app, const std::shared_ptr<ScanOptions>& o, const CommonOptions& common,
                                     const Console& console) {
  const auto p = std::make_shared<PhantomOptions>();
  std::vector<std::string> names = {"liver"};
  std::string sizes;
  for (const auto& [name, defaults] : hexmesh::solid_phantoms()) {
    names.push_back(name);
    sizes += "; " + name;
    for (const auto& [key, value] : defaults) sizes += fmt::format(" {}={:g}", key, value);
  }
  app.add_option("name", p->name, "Which phantom")->required()->check(CLI::IsMember(names));
  add_repeated(app, "--set", p->settings,
               "KEY=NUMBER of a solid: its sizes [mm], rotate_x, rotate_y, rotate_z [degrees], shift_x, shift_y, "
               "shift_z [mm]. Sizes" +
                   sizes);
  app.add_option("--spacing", p->spacing, "Edge of the cubic voxels [mm], 0.25 to 10")
      ->check(CLI::Range(0.25, 10.0))
      ->capture_default_str();
  return [=, &common, &console] { return run_phantom(*p, *o, common, console); };
}

}  // namespace hextools
