// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "mesh/mesh.h"

namespace hexsolver {

/// Where the vectors of the cells of a batch are among those of all nodes.
struct BatchNodes {
  const CellNodes* cells;
  int count;
  int split;  ///< and rows: of Mesh::Batch
  const std::array<std::int32_t, 4>* rows;

  /// Of eight cells in one row; null of others.
  const std::int32_t* row() const { return split == static_cast<int>(Mesh::batch_size) ? rows[0].data() : nullptr; }
};

inline BatchNodes nodes_of_batch(const Mesh& mesh, std::size_t number) {
  const Mesh::Batch& batch = mesh.batches()[number];
  return {&mesh.cell_nodes()[batch.first], static_cast<int>(batch.count), batch.split, batch.rows.data()};
}

}  // namespace hexsolver
