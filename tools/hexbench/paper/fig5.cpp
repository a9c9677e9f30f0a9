// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "hexbench/experiments.h"
#include "measurements.h"

namespace hextools::paper {

using hexmesh::Vec3;
using hexsolver::Stiffness;

std::vector<Row> fig5(const Console& /*console*/) {
  constexpr int single = 4;  // the level of one cell
  const hexmesh::Lattice lattice = lattice_of(solid("c-shape", 4, {{"height", 64}}), 100, 0.3, {single + 1, {0, 0, 0}});
  hexsolver::Scene scene;
  scene.elasticity = hexsolver::Elasticity::cauchy;
  scene.gravity = {0, -9810, 0};
  scene.conditions = {beyond("foot", {0, -32, 0}, {0, -1, 0}, Vec3::Zero())};
  const std::vector<Vec3> tip = {{30, 24, 0}};
  const auto sinks = [&](Stiffness stiffness, int level) {
    scene.stiffness = stiffness;
    return -solve(lattice, scene, level).at(tip).front()[1];
  };
  const double ours = sinks(Stiffness::exact, single), uniform = sinks(Stiffness::uniform, single);
  const double fine = sinks(Stiffness::exact, 0);
  return {
      Row{{"case", "tip of a C of one cell under its weight sinks [mm]"},
          {"paper", nullptr},
          {"ours", ours},
          {"reference", fine},
          {"uniform", uniform},
          {"reading",
           fmt::format("one cell cannot bend as 4 mm cells do; the non-uniform one reaches {:.1f} %, the uniform one "
                       "{:.1f} % of their sag",
                       100 * ours / fine, 100 * uniform / fine)}}};
}

}  // namespace hextools::paper
