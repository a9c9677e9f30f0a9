// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "mesh/mesh.h"

namespace hexsolver {

/// Where the vectors of the cells of a batch are among those of all nodes.
struct BatchNodes {
  const CellNodes* cells;
  int count;
  const std::int32_t* rows;  ///< Mesh::Batch::rows; null unless they are eight in a row
};

inline BatchNodes nodes_of_batch(const Mesh& mesh, std::size_t number) {
  const Mesh::Batch& batch = mesh.batches()[number];
  return {&mesh.cell_nodes()[batch.first], static_cast<int>(batch.count), batch.is_row ? batch.rows.data() : nullptr};
}

}  // namespace hexsolver
