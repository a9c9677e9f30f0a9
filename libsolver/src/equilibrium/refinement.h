// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "equilibrium/local_level.h"

namespace hexsolver {

/// The cells of a level that most of the error of its displacement comes from, each cell's part told by what its eight
/// children find: with u the solution here, u' that of all cells halved, e = u' - u and the dual weights z of the mean
/// |e|, K' z = d mean|e| / de, a cell's part is |e| |z| in the energy of its children, of what the cell itself cannot
/// follow of e and z. Reactions are off by twice the error of the energy, so that their part is |e|^2.
/// Source: Becker and Rannacher, "An optimal control approach to a posteriori error estimation in finite element
/// methods", Acta Numerica 10 (2001), sections 2 and 3; the mark of Doerfler, "A convergent adaptive algorithm for
/// Poisson's equation", SIAM J. Numer. Anal. 33 (1996).
/// @param halved  the same with all cells divided
/// @param u       the solution there
/// @param change  e, there
/// @param scene   what is to be accurate
/// @param part    of the error that may be left: the less, the more cells at once
/// @returns by cell; some are true unless no cell can be divided
std::vector<bool> find_cells_to_divide(const LocalLevel& of, LocalLevel& halved, const NodeVector& u,
                                       const NodeVector& change, const Scene& scene, double part);

}  // namespace hexsolver
