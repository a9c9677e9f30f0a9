// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <cmath>
#include <map>

#include "hexbench/experiments.h"
#include "hexbench/motion.h"
#include "measurements.h"

namespace hextools::paper {

std::vector<Row> table3(const Console& console) {
  hexsolver::Scene scene;
  scene.gravity = {0, 0, -9810};
  scene.conditions = {beyond("right end", {-65, 0, 0}, {-1, 0, 0}, hexmesh::Vec3::Zero())};
  scene.dynamics = paper_dynamics(1, 10);
  hexmesh::Lattice lattice = liver_of_phantom(4, 0.3);
  lattice.surface.points = surface_centers(lattice);
  // The paper prints two of these rates (its Table 2); the figure itself is a picture.
  const std::map<std::pair<int, int>, double> published = {
      {{242, 229}, 70}, {{242, 1455}, 43}, {{1346, 229}, 15}, {{1346, 1455}, 13}};
  const std::map<int, int> nodes_of = {{8, 27}, {46, 107}, {242, 436}, {1346, 2003}, {8913, 11378}};  // by elements
  std::vector<Row> rows;
  for (const nlohmann::json& l : bench_motion_levels(lattice, scene, console)) {
    const int cells = l["cells"].get<int>();
    int nearest = 8913;
    for (const auto& [elements, nodes] : nodes_of)
      if (std::abs(std::log(1.0 * elements / cells)) < std::abs(std::log(1.0 * nearest / cells))) nearest = elements;
    for (const nlohmann::json& surface : l["surfaces"]) {
      const int points = surface["points"].get<int>();
      const auto known = published.find({nearest, points});
      Row row = {
          {"case", fmt::format("{} cells, {} nodes, {} points [steps/s]", cells, l["nodes"].get<int>(), points)}};
      row["paper"] = known == published.end() ? Row() : Row(known->second);
      row["ours"] = surface["steps_per_second"].get<double>();
      row["reference"] = nullptr;
      row["nodes"] = l["nodes"].get<int>();
      row["points"] = points;
      row["paper_nodes"] = nodes_of.at(nearest);
      row["reading"] = fmt::format(
          "the paper's nearest has {} cells, on a 2 GHz Pentium M with rendering; ours on one of "
          "today's threads, without",
          nearest);
      rows.push_back(std::move(row));
    }
  }
  return rows;
}

}  // namespace hextools::paper
