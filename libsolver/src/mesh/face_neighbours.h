// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>

#include "mesh/mesh.h"

namespace hexsolver {

/// Whether a cell's field at a place is that of the node there, of which it may be no corner: they move as one.
bool holds_node(const Mesh& mesh, std::size_t cell, std::size_t node);

/// f(cell, side, other) for cells that share a face, or whose face is in that of a larger other: once each. Cells that
/// stand side by side but are split share none.
/// @param f  the side is 2 axis + (1: the upper one)
void for_each_shared_face(const Mesh& mesh,
                          const std::function<void(std::int32_t cell, int side, std::int32_t other)>& f);

}  // namespace hexsolver
