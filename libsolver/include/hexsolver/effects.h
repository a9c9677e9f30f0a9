// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "hexsolver/scene.h"

namespace hexsolver {

/// Something that a scene may call for. What it does not call for is not built, read, stored or timed.
struct Effect {
  std::string name;
  bool active = false;
  std::string why;
  double seconds = 0;  ///< spent on it
};

inline constexpr const char* error_estimate_name = "error estimate";

std::vector<Effect> list_effects(const Scene& scene);

}  // namespace hexsolver
