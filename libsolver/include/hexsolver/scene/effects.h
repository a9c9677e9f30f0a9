// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "hexsolver/scene/scene.h"

namespace hexsolver {

enum class EffectKind {
  elasticity,
  rotation,
  large_strain,
  near_incompressibility,
  force,      ///< one for each [[force]]
  contact,    ///< one for each [[contact]]
  match,      ///< one for each [[match]]
  prestress,  ///< one for each [[prestress]]
  gravity,
  rest_shape,  ///< of a body that the lattice shows under load
  islands,     ///< springs that hold them
  inertia,
  damping,
  grab,  ///< of points that are held from outside while the body moves, in no scene
  error_estimate
};

/// Something that a scene may call for. What it does not call for is not built, read, stored or timed.
struct Effect {
  EffectKind kind = EffectKind::elasticity;
  std::string name;
  bool active = false;
  std::string why;
  double seconds = 0;  ///< spent on it
};

/// As reports call it.
const char* name_of(EffectKind kind);

std::vector<Effect> list_effects(const Scene& scene);

}  // namespace hexsolver
