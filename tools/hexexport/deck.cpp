// SPDX-License-Identifier: Apache-2.0
#include "deck.h"

#include <fmt/format.h>

#include "cli/result_report.h"
#include "cli/result_state.h"
#include "hexmesh/core/error.h"
#include "hexmesh/file/calculix_deck.h"

namespace hextools {

using nlohmann::json;

void write_deck(const hexmesh::Result& result, const std::filesystem::path& path) {
  const json report = report_of(result).report;
  const auto expect = [&](bool holds, const char* what, const char* expected) {
    if (!holds) throw hexmesh::Error(hexmesh::ErrorKind::input, fmt::format("--inp: {}, expected {}", what, expected));
  };
  expect(report.value("kind", "equilibrium") == "equilibrium", "the result is a motion", "an equilibrium");
  expect(!report.contains("loaded"), "the lattice shows the body under load", "solve.reference = \"rest\"");
  expect(!report.contains("prestresses"), "the scene has a [[prestress]]", "none");
  expect(report.value("converged", false), "the result is not converged", "one that is");
  expect(report["forces"].empty() || !result.load.empty(), "the result does not say which forces are on its nodes",
         "one of this version's hexsolve, not of hexsolve-mpi");
  for (const json& contact : report["contacts"]) {
    expect(!contact.contains("between") && !contact.contains("self"), "the scene has segments that touch",
           "obstacles alone");
    expect(contact.contains("friction"), "the result does not say how obstacles rub", "one of this version's hexsolve");
    expect(contact["friction"] == 0, "obstacles have friction, and where that holds follows from the way there",
           "[[contact]] without friction");
  }
  const std::vector<hexmesh::Obstacle> obstacles = obstacles_of(result);
  expect(obstacles.size() == report["contacts"].size(), "the result does not hold surfaces that obstacles are",
         "planes, spheres, capsules, cylinders and boxes");
  expect(obstacles.empty() || !result.conditions.empty(), "nothing but obstacles holds the body",
         "a [[fix]] or [[displace]]");
  expect(report.value("volumetric", "") == "full", "C3D8 integrates the volumetric term fully",
         "solve.volumetric = \"full\"");
  expect(report.value("strain", "") == "cauchy", "decks are written for small strain", "solve.strain = \"cauchy\"");
  const bool is_of_voxels = report["levels"].back().value("level", -1) == 0;
  const bool is_exact = report.value("stiffness", "") == "exact" && report.value("supports", "area") != "soft";
  expect(is_of_voxels || is_exact, "springs, modes, condensed and averaged cells have no counterpart above level 0",
         "solve.stiffness = \"exact\" and solve.supports = \"area\"");
  expect(report.value("held_cells", 0U) == 0, "springs of held islands have no counterpart", "a scene without");
  std::vector<hexmesh::DeckObstacle> met;
  for (std::size_t n = 0; n < obstacles.size(); ++n)
    met.push_back({obstacles[n].solid, ResultReport::number_in(report["contacts"][n], "stiffness_n_mm", 0)});
  hexmesh::write_calculix_deck(result, met, path);
}

}  // namespace hextools
