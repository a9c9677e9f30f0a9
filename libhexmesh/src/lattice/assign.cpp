// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/lattice/assign.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "hexmesh/core/error.h"

namespace hexmesh {
namespace {

const Tissue* find_tissue(const std::string& segment, const MaterialChoice& choice) {
  if (choice.tissue.empty()) return tissue_of(segment);
  std::vector<std::string> names;
  for (const Tissue& tissue : known_tissues()) {
    if (tissue.name == choice.tissue) return &tissue;
    names.push_back(tissue.name);
  }
  throw Error(ErrorKind::input, fmt::format("material of segment '{}': unknown tissue '{}', expected one of: {}",
                                            segment, choice.tissue, fmt::join(names, ", ")));
}

struct NamedRule {
  MaterialRule rule;
  std::string source;
};

/// Names of the quantities that the user did not give.
std::vector<std::string> left_open(const MaterialChoice& choice) {
  std::vector<std::string> names;
  if (!choice.young_kpa) names.emplace_back("young_kpa");
  if (!choice.poisson) names.emplace_back("poisson");
  if (!choice.density_kg_m3) names.emplace_back("density_kg_m3");
  return names;
}

NamedRule make_rule(const std::string& segment, const MaterialChoice& choice) {
  constexpr double water = 1000;  // kg/m^3, where only the density is left open
  const Tissue* tissue = find_tissue(segment, choice);
  if (!tissue && !(choice.young_kpa && choice.poisson))
    throw Error(ErrorKind::input,
                fmt::format("segment '{0}' has no material and its name no known tissue, expected --material "
                            "{0}:young_kpa=...,poisson=... or {0}:none",
                            segment));
  const Material m = tissue ? tissue->material : material_from_units(0, 0, water);
  NamedRule out{{choice.young_kpa.value_or(m.young * 1e3), choice.poisson.value_or(m.poisson),
                 choice.density_kg_m3.value_or(m.density * 1e12)},
                "given"};
  const std::vector<std::string> open = left_open(choice);
  if (open.empty()) return out;
  out.source = fmt::format("{} of tissue '{}' ({}){}", fmt::join(open, ", "), tissue ? tissue->name : "water",
                           tissue ? tissue->source : "density of water", open.size() < 3 ? ", the rest given" : "");
  return out;
}

}  // namespace

AssignedMaterials assign_materials(const LabelVolume& volume, const std::map<std::string, MaterialChoice>& choices) {
  std::vector<std::string> names;
  for (const Segment& s : volume.segments) names.push_back(s.name);
  for (const auto& [name, choice] : choices)
    if (name != "*" && !find_segment(volume.segments, name))
      throw Error(ErrorKind::input,
                  fmt::format("material for unknown segment '{}', expected one of: {}", name, fmt::join(names, ", ")));
  const std::vector<std::size_t> counts = count_voxels(volume);
  AssignedMaterials out;
  for (std::size_t n = 0; n < volume.segments.size(); ++n) {
    if (counts[n] == 0) continue;
    const Segment& segment = volume.segments[n];
    const auto all = choices.find("*");
    MaterialChoice choice = all == choices.end() ? MaterialChoice{} : all->second;
    for (const auto& [name, asked] : choices)
      if (find_segment({segment}, name)) choice = asked;
    LatticeSegment entry{segment, std::nullopt, counts[n], ""};
    if (!choice.none) {
      auto [rule, source] = make_rule(segment.name, choice);
      entry.source = source;
      if (rule.varies()) {
        entry.material = Material{};  // found when the voxels are
        out.rules[segment.label] = std::move(rule);
      } else {
        entry.material = rule.at(0);
        check_material(*entry.material, segment.name);
        if (!left_open(choice).empty())
          out.notes.push_back(fmt::format("segment '{}': {:g} kPa, nu {:g}, {:g} kg/m^3: {}", segment.name,
                                          entry.material->young * 1e3, entry.material->poisson,
                                          entry.material->density * 1e12, source));
      }
    }
    out.segments.push_back(std::move(entry));
  }
  return out;
}

}  // namespace hexmesh
