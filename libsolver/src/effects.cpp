// SPDX-License-Identifier: Apache-2.0
#include "hexsolver/effects.h"

#include <fmt/format.h>

namespace hexsolver {

std::vector<Effect> list_effects(const Scene& scene) {
  std::vector<Effect> effects;
  effects.push_back({"elasticity", true, "every scene has it"});
  const bool rotates = scene.strain == Strain::corotational;
  effects.push_back({"rotation", rotates,
                     scene.finds_strain
                         ? "solve.strain = \"auto\": if turning cells on a coarse level changes more than the accuracy"
                     : rotates ? scene.rotation == Rotation::polar
                                     ? "solve.strain = \"corotational\": each cell turns with its material"
                                     : "solve.rotation = \"edges\": each cell turns with its averaged edges"
                               : "solve.strain = \"cauchy\": small strain, no cell turns"});
  const bool mean = scene.volumetric == Volumetric::mean;
  effects.push_back({"near-incompressibility", mean,
                     mean ? "solve.volumetric = \"mean\": one dilatation per cell, so that coarse cells do not lock"
                          : "solve.volumetric = \"full\": dilatation varies in a cell"});
  for (const Force& f : scene.forces) effects.push_back({load_name(f), true, fmt::format("[[force]] at {}", f.where)});
  if (scene.forces.empty()) effects.push_back({"forces", false, "the scene has no [[force]]"});
  const bool weighs = scene.gravity != Vec3::Zero();
  effects.push_back({"gravity", weighs, weighs ? "the scene has [gravity]" : "the scene has no [gravity]: no masses"});
  effects.push_back(
      {error_estimate_name, false, "differences between the levels that a solution passes, if there are two"});
  return effects;
}

}  // namespace hexsolver
