// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "hexmesh/lattice/lattice.h"
#include "hexsolver/scene/scene.h"

namespace hextools {

/// What a solution has to do, for the share that is done.
struct SolveWork {
  std::vector<std::size_t> cells;  ///< of each level; empty: not known
  int finest = 0;                  ///< level that is solved
  double tolerance = 1e-8;
};

SolveWork work_of(const hexmesh::Lattice& lattice, const hexsolver::Scene& scene, int finest);

/// The share of a solution that is done, by cells: all of the coarser levels, and of this one as far as the residual
/// has fallen. Nothing where that is not known, and of a finer level that is only looked at.
std::optional<double> part_done(const SolveWork& work, int level, double load, double residual);

}  // namespace hextools
