// SPDX-License-Identifier: Apache-2.0
#include "mesh/mesh.h"

#include <algorithm>

#include "core/parallel.h"
#include "hexmesh/core/bytes.h"

namespace hexsolver {

using hexmesh::bytes_of;

Mesh::Mesh(std::vector<Index3> cells, const Mat3& edges, const Vec3& corner)
    : Mesh(cells, hexmesh::number_nodes(cells), edges, corner) {}

Mesh::Mesh(std::vector<Index3> cells, hexmesh::NodeNumbering numbering, const Mat3& edges, const Vec3& corner)
    : cells_(std::move(cells)), numbering_(std::move(numbering)), edges_(edges), corner_(corner) {
  slabs_.assign(static_cast<std::size_t>(hexmesh::extent_of(cells_)[2]), {0, 0});
  for (std::size_t c = 0; c < cells_.size(); ++c) {
    auto& slab = slabs_[cells_[c][2]];
    if (slab.second == 0) slab.first = c;
    slab.second = c + 1;
  }
  batch_of_.resize(cells_.size());
  for (const auto& [begin, end] : slabs_)
    for (std::size_t first = begin; first < end; first += batch_size) {
      batches_.push_back(make_batch(first, std::min(batch_size, end - first)));
      for (std::size_t c = first; c < first + batches_.back().count; ++c)
        batch_of_[c] = static_cast<std::int32_t>(batches_.size() - 1);
    }
}

Mesh::Batch Mesh::make_batch(std::size_t first, std::size_t count) const {
  Batch batch{first, count, count == batch_size};
  for (std::size_t r = 0; r < 4; ++r) batch.rows[r] = cell_nodes()[first][2 * r];
  for (std::size_t lane = 0; lane < count; ++lane)
    for (std::size_t a = 0; a < 8; ++a)
      batch.is_row =
          batch.is_row && cell_nodes()[first + lane][a] == batch.rows[a / 2] + static_cast<std::int32_t>(lane + a % 2);
  return batch;
}

std::size_t Mesh::bytes() const {
  return bytes_of(cells_) + bytes_of(numbering_.cell_nodes) + bytes_of(numbering_.nodes) + bytes_of(batches_) +
         bytes_of(batch_of_);
}

}  // namespace hexsolver
