// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "cli/tool.h"
#include "methods.h"
#include "rows.h"

namespace hextools {

struct AccuracyOptions {
  std::vector<std::string> laws = {"cauchy", "corotational"};
  std::vector<double> tolerances = {1e-3, 1e-6};
  std::vector<int> iterations = {5, 10, 20};  ///< of conjugate gradients a step of motion; empty: no motion
  std::vector<std::string> meshes;            ///< files of tetrahedra
  double most_elements = 1e5;                 ///< of cells or tetrahedra that are compared
  double reference_tets = 25000;              ///< of 10 nodes
  int repeats = 3;
};

struct AccuracyTables {
  Row about;  ///< the machine, the body and the references
  std::vector<Row> equilibria, motions;
};

/// Methods x sizes x tolerances against converged references of the same law, and the times they take.
///
/// Two references for each law: the voxels themselves (level 0), the limit of cells, and 10-node tetrahedra of the
/// smooth surface, the limit of tetrahedra. Times are medians of interleaved runs after one that is not counted; what
/// takes more than two seconds runs once.
AccuracyTables bench_accuracy(const Experiment& experiment, const AccuracyOptions& options, const Console& console);

}  // namespace hextools
