// SPDX-License-Identifier: Apache-2.0
#include "lattice_report.h"

#include <fmt/format.h>

namespace hextools {

using nlohmann::json;

std::string table(const nlohmann::json& report) {
  std::string out = fmt::format("{:<6}{:>11}{:>11}{:>11}{:>9}{:>8}{:>8}   cell [mm]\n", "level", "cells", "nodes",
                                "boundary", "unique", "stored", "joined");
  for (const json& l : report["levels"])
    out += fmt::format("{:<6}{:>11}{:>11}{:>11}{:>9}{:>8}{:>8}   {:.4g} x {:.4g} x {:.4g}\n", l["level"].get<int>(),
                       l["cells"].get<std::size_t>(), l["nodes"].get<std::size_t>(),
                       l["boundary_cells"].get<std::size_t>(), l["unique_matrices"].get<std::size_t>(),
                       l["stored_matrices"].get<bool>() ? "yes" : "no", l["joined_cells"].get<std::size_t>(),
                       l["cell_mm"][0].get<double>(), l["cell_mm"][1].get<double>(), l["cell_mm"][2].get<double>());
  if (report.contains("gaps"))
    for (const json& l : report["levels"])
      if (const auto split = l["split_cells"].get<std::size_t>(); split > 0)
        out += fmt::format("level {}: {} of the cells share their place with another, apart from it\n",
                           l["level"].get<int>(), split);
  for (const json& s : report["segments"]) {
    out += fmt::format("segment {} '{}': {:.1f} mL", s["label"].get<int>(), s["name"].get<std::string>(),
                       s["volume_ml"].get<double>());
    if (!s.contains("young_kpa")) {
      out += ", no material\n";
      continue;
    }
    out += fmt::format(", E {:.4g} kPa", s["young_kpa"].get<double>());
    if (s.contains("young_kpa_range"))
      out += fmt::format(" on average ({:.4g} to {:.4g}, {} materials)", s["young_kpa_range"][0].get<double>(),
                         s["young_kpa_range"][1].get<double>(), s["materials"].get<std::size_t>());
    out += fmt::format(", nu {:.4g}, {:.1f} g\n", s["poisson"].get<double>(), s["mass_g"].get<double>());
  }
  return out;
}

void note_joined(const json& report, const Console& console) {
  for (const json& level : report["levels"]) {
    const auto joined = level["joined_cells"].get<std::size_t>();
    if (joined == 0) continue;
    const json& worst = level["joined"][0];
    console.note(fmt::format(
        "level {}: {} of {} cells join material that is not connected inside them, e.g. {} parts at ({:.1f}, {:.1f}, "
        "{:.1f}) mm; coarser levels join more (all: 'joined' in the report, 'parts' in hexexport --lattice); --gaps "
        "split "
        "keeps them apart",
        level["level"].get<int>(), joined, level["cells"].get<std::size_t>(), worst["parts"].get<int>(),
        worst["center_mm"][0].get<double>(), worst["center_mm"][1].get<double>(), worst["center_mm"][2].get<double>()));
    return;
  }
}

}  // namespace hextools
