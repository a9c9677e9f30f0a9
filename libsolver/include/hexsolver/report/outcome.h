// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hexmesh/result/result.h"
#include "hexsolver/report/report.h"

namespace hexsolver {

/// What a solution is, and how it came about. Where it did not converge the result is the last state that did.
struct Outcome {
  hexmesh::Result result;
  SolveReport report;
};

}  // namespace hexsolver
