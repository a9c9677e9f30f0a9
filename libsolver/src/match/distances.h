// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>
#include <vector>

#include "hexsolver/report/report.h"

namespace hexsolver {

/// Distances [mm] and the area that each stands for.
using Distances = std::vector<std::pair<double, double>>;

DistanceReport statistics(Distances all);

/// Half of the area is nearer; 0 of none.
double median(Distances all);

}  // namespace hexsolver
