// SPDX-License-Identifier: Apache-2.0
#include "material_choices.h"

#include <fmt/format.h>

#include "cli/checksum.h"
#include "cli/parse.h"
#include "hexmesh/core/error.h"
#include "hexmesh/file/material_file.h"

namespace hextools {
namespace {

using hexmesh::Error;
using hexmesh::ErrorKind;

std::optional<hexmesh::Quantity>& quantity_named(const std::string& key, const std::string& option,
                                                 hexmesh::MaterialChoice& choice) {
  if (key == "young_kpa") return choice.young_kpa;
  if (key == "poisson") return choice.poisson;
  if (key == "density_kg_m3") return choice.density_kg_m3;
  throw Error(ErrorKind::usage, fmt::format("--material '{}': unknown key '{}', expected young_kpa, poisson, "
                                            "density_kg_m3, tissue",
                                            option, key));
}

void apply_setting(const std::string& setting, const std::string& option, hexmesh::MaterialChoice& choice) {
  const auto [key, text] = key_and_value(setting);
  if (key == "tissue") {
    if (text.empty()) throw Error(ErrorKind::usage, fmt::format("--material '{}': the tissue has no name", option));
    if (!choice.tissue.empty())
      throw Error(ErrorKind::usage, fmt::format("--material '{}': tissue is given twice", option));
    choice.tissue = text;
    return;
  }
  std::optional<hexmesh::Quantity>& quantity = quantity_named(key, option, choice);
  const std::optional<double> value = parse_number<double>(text);
  if (!value) throw Error(ErrorKind::usage, fmt::format("--material '{}': '{}' is not a number", option, text));
  if (quantity) throw Error(ErrorKind::usage, fmt::format("--material '{}': {} is given twice", option, key));
  quantity = *value;
}

/// "liver:young_kpa=100,poisson=0.3,density_kg_m3=1060", "5:tissue=bone" or "vena_cava:none".
std::pair<std::string, hexmesh::MaterialChoice> parse_material(const std::string& option) {
  const std::size_t colon = option.rfind(':');
  if (colon == std::string::npos || colon == 0)
    throw Error(ErrorKind::usage,
                fmt::format("--material '{}', expected SEGMENT:key=value,... or SEGMENT:none", option));
  hexmesh::MaterialChoice choice;
  const std::string rest = option.substr(colon + 1);
  if (rest == "none") {
    choice.none = true;
    return {option.substr(0, colon), choice};
  }
  for (const std::string& setting : split_list(rest, ',')) apply_setting(setting, option, choice);
  return {option.substr(0, colon), choice};
}

}  // namespace

std::map<std::string, hexmesh::MaterialChoice> material_choices(const BuildOptions& o, const Input* file,
                                                                std::vector<std::string>& read) {
  std::map<std::string, hexmesh::MaterialChoice> choices;
  if (file) {
    read.push_back(checksum_line(file->name(), file->path()));
    choices = hexmesh::read_materials(file->path(), file->known_as());
  }
  for (const std::string& option : o.materials)
    if (!choices.insert(parse_material(option)).second)
      throw Error(ErrorKind::usage, fmt::format("--material '{}': the segment has one already", option));
  return choices;
}

}  // namespace hextools
