// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <omp.h>

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "hexmesh/core/grid.h"

namespace hextools {

/// Keeps the order of its keys, which becomes that of the columns of a table.
using Row = nlohmann::ordered_json;

/// Of the lengths of differences [mm].
struct Distances {
  double mean = 0, min = 0, max = 0, deviation = 0;
};
Distances distances(const std::vector<hexmesh::Vec3>& a, const std::vector<hexmesh::Vec3>& b);

/// Of numbers; their own unit.
Distances statistics(const std::vector<double>& values);

/// PREFIX_mean, PREFIX_min, PREFIX_max, PREFIX_std.
void add_to(Row& row, const std::string& prefix, const Distances& d);

double median(std::vector<double> values);

template <class F>
double seconds_of(F&& f) {
  const double start = omp_get_wtime();
  f();
  return omp_get_wtime() - start;
}

/// Rows as comma-separated values. The columns are those of all rows, in the order in which they come.
std::string to_csv(const std::vector<Row>& rows);

}  // namespace hextools
