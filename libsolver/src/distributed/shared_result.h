// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "distributed/shared_level.h"
#include "hexmesh/file/result_file.h"

namespace hexsolver::mpi {

/// What this process writes of the result, and measures of all cells into the report. Called by all processes at once.
hexmesh::ResultRows result_rows(const SharedLevel& level, Vec u, SolveReport& report);

}  // namespace hexsolver::mpi
