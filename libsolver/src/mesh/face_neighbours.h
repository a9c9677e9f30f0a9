// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>

#include "mesh/mesh.h"

namespace hexsolver {

/// Whether a cell's field at a place is that of the node there, of which it may be no corner: they move as one.
bool holds_node(const Mesh& mesh, std::size_t cell, std::size_t node);

/// Of two cells of which one has a face that is the other's too, or in that of the other, which is larger.
/// Sides are 2 axis + (1: the upper one).
struct SharedFace {
  std::int32_t cell;
  int side;
  std::int32_t other;
  int its_side;  ///< the opposite one, unless both stand at one index
};

/// Each once. Cells that stand side by side but are split share none.
void for_each_shared_face(const Mesh& mesh, const std::function<void(const SharedFace&)>& f);

}  // namespace hexsolver
