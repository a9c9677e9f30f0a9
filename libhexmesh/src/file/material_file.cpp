// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/file/material_file.h"

#include <limits>

#include "hexmesh/file/toml_reader.h"

namespace hexmesh {
namespace {

constexpr double infinity = std::numeric_limits<double>::infinity();

std::vector<std::pair<double, double>> read_points(TomlReader& table) {
  std::vector<std::pair<double, double>> points;
  for (const std::vector<double>& pair : table.rows("points", 2, "pairs [[x, value], ...], two or more"))
    points.emplace_back(pair[0], pair[1]);
  for (std::size_t n = 1; n < points.size(); ++n)
    if (!(points[n].first > points[n - 1].first))
      table.fail_here(
          fmt::format("points has x = {} after {}, expected ascending x", points[n].first, points[n - 1].first));
  if (points.size() == 1) table.fail_here("points has one pair, expected two or more");
  return points;
}

/// { offset, slope }, { offset, factor, exponent } or { points }, with of, min, max.
GreyLaw read_law(TomlReader table, bool may_follow_density) {
  GreyLaw law;
  const auto value = [&](const char* key) { return table.number(key, -infinity, infinity, "a number"); };
  const auto offset = value("offset"), slope = value("slope"), factor = value("factor"), exponent = value("exponent");
  law.points = read_points(table);
  law.min = value("min");
  law.max = value("max");
  if (may_follow_density)
    law.of_density = table.choice<bool>("of", {{"intensity", false}, {"density_kg_m3", true}}).value_or(false);
  table.finish();

  const bool is_linear = slope && !factor && !exponent && law.points.empty();
  const bool is_power = factor && exponent && !slope && law.points.empty();
  const bool is_piecewise = !law.points.empty() && !offset && !slope && !factor && !exponent;
  if (!is_linear && !is_power && !is_piecewise)
    table.fail_here(
        "this is no law, expected { offset, slope }, { offset, factor, exponent } or { points = [[x, value], ...] }");
  if (law.min && law.max && *law.min > *law.max)
    table.fail_here(fmt::format("min is {} and max {}, expected min <= max", *law.min, *law.max));
  law.shape = is_linear ? GreyLaw::Shape::linear : is_power ? GreyLaw::Shape::power : GreyLaw::Shape::piecewise;
  law.offset = offset.value_or(0);
  law.factor = is_linear ? *slope : factor.value_or(0);
  law.exponent = exponent.value_or(1);
  return law;
}

std::optional<Quantity> read_quantity(TomlReader& table, const std::string& key, bool may_follow_density) {
  if (table.is_table(key)) return read_law(*table.table(key, "a law"), may_follow_density);
  if (const auto number = table.number(key, -infinity, infinity, "a number or a law { ... }")) return *number;
  return std::nullopt;
}

MaterialChoice read_choice(TomlReader table) {
  MaterialChoice choice;
  choice.none = table.flag("none").value_or(false);
  choice.tissue = table.text("tissue", "the name of a tissue").value_or("");
  choice.density_kg_m3 = read_quantity(table, "density_kg_m3", false);
  choice.young_kpa = read_quantity(table, "young_kpa", true);
  choice.poisson = read_quantity(table, "poisson", true);
  table.finish();
  if (choice.none && (!choice.tissue.empty() || choice.young_kpa || choice.poisson || choice.density_kg_m3))
    table.fail_here("none = true goes with no other key, expected it alone");
  return choice;
}

std::map<std::string, MaterialChoice> read_choices(const toml::table& root, const std::string& display_name) {
  TomlReader reader(root, display_name, "");
  std::map<std::string, MaterialChoice> choices;
  if (auto materials = reader.table("material", "tables written [material.SEGMENT]"))
    for (const auto& [name, table] : materials->named_tables()) choices[name] = read_choice(table);
  reader.finish();
  return choices;
}

}  // namespace

std::map<std::string, MaterialChoice> read_materials(const std::filesystem::path& path,
                                                     const std::string& display_name) {
  return read_choices(parse_toml(path, display_name), display_name);
}

std::map<std::string, MaterialChoice> parse_materials(std::string_view toml, const std::string& display_name,
                                                      bool has_places) {
  const toml::table root = parse_toml_text(toml, display_name);
  return read_choices(has_places ? root : without_places(root), display_name);
}

}  // namespace hexmesh
