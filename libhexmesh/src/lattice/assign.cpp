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

bool is_complete(const MaterialChoice& choice) { return choice.young_kpa && choice.poisson && choice.density_kg_m3; }

/// Where each value comes from; a tissue is named where it gives the stiffness.
std::string source_of(const MaterialChoice& choice, const Tissue* tissue) {
  std::vector<std::string> given, sources;
  for (const auto& [name, value] : {std::pair("young_kpa", choice.young_kpa), std::pair("poisson", choice.poisson),
                                    std::pair("density_kg_m3", choice.density_kg_m3)})
    if (value) given.emplace_back(name);
  if (!given.empty()) sources.push_back(fmt::format("{}: given", fmt::join(given, " and ")));
  if (!choice.young_kpa || !choice.poisson)
    sources.push_back(fmt::format("{} of tissue '{}': {}",
                                  choice.young_kpa ? "poisson"
                                  : choice.poisson ? "young_kpa"
                                                   : "young_kpa and poisson",
                                  tissue->name, tissue->source));
  if (!choice.density_kg_m3)
    sources.push_back(fmt::format("density_kg_m3: {}", tissue ? density_source : "that of water"));
  return fmt::format("{}", fmt::join(sources, "; "));
}

NamedRule make_rule(const std::string& segment, const MaterialChoice& choice) {
  constexpr double water = 1000;  // kg/m^3
  const Tissue* tissue = find_tissue(segment, choice);
  const Material m = tissue ? tissue->material : material_from_units(0, 0, water);
  return {{choice.young_kpa.value_or(m.young * 1e3), choice.poisson.value_or(m.poisson),
           choice.density_kg_m3.value_or(m.density * 1e12)},
          is_complete(choice) ? "given" : source_of(choice, tissue)};
}

MaterialChoice choice_for(const Segment& segment, const std::map<std::string, MaterialChoice>& choices) {
  const auto all = choices.find("*");
  MaterialChoice choice = all == choices.end() ? MaterialChoice{} : all->second;
  for (const auto& [name, asked] : choices)
    if (name != "*" && find_segment({segment}, name)) choice = asked;
  return choice;
}

/// @throws Error{input} naming all segments that nothing says a material of
void check_that_all_have_one(const std::vector<Segment>& segments,
                             const std::map<std::string, MaterialChoice>& choices) {
  std::vector<std::string> without;
  for (const Segment& s : segments) {
    const MaterialChoice choice = choice_for(s, choices);
    if (!choice.none && !(choice.young_kpa && choice.poisson) && !find_tissue(s.name, choice))
      without.push_back("'" + s.name + "'");
  }
  if (without.empty()) return;
  const bool is_one = without.size() == 1;
  throw Error(
      ErrorKind::input,
      fmt::format("segment{} {} {} no material and {} no known tissue, expected young_kpa and poisson, a tissue or "
                  "none{} (--material '{}:young_kpa=...,poisson=...', ':tissue=...' or ':none')",
                  is_one ? "" : "s", fmt::join(without, ", "), is_one ? "has" : "have",
                  is_one ? "its name" : "their names", is_one ? "" : " for each, or for '*', all of them",
                  without.front().substr(1, without.front().size() - 2)));
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
  std::vector<Segment> filled;
  for (std::size_t n = 0; n < counts.size(); ++n)
    if (counts[n] > 0) filled.push_back(volume.segments[n]);
  check_that_all_have_one(filled, choices);
  AssignedMaterials out;
  for (std::size_t n = 0; n < volume.segments.size(); ++n) {
    if (counts[n] == 0) continue;
    const Segment& segment = volume.segments[n];
    const MaterialChoice choice = choice_for(segment, choices);
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
        if (!is_complete(choice))
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
