// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <limits>

#include "hexmesh/file/result_file.h"
#include "hexsolver/report/report.h"

namespace hexsolver {

/// Where the law or the state have no meaning.
struct CellChanges {
  std::size_t cells = 0;     ///< that these are counted of
  std::size_t strained = 0;  ///< beyond what Hooke's law is meant for
  std::size_t turned = 0;    ///< beyond what small strain is meant for
  std::size_t inverted = 0;
  double least_jacobian = std::numeric_limits<double>::infinity();
};

/// @param result       a state with measures
/// @param first, count  cells that count
CellChanges count_changes(const hexmesh::Result& result, std::size_t first, std::size_t count);

/// Into the report, with warnings.
void report_changes(const CellChanges& changes, SolveReport& report);

}  // namespace hexsolver
