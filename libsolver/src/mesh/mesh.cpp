// SPDX-License-Identifier: Apache-2.0
#include "mesh/mesh.h"

#include <algorithm>
#include <limits>

#include "core/parallel.h"
#include "hexmesh/core/bytes.h"

namespace hexsolver {

using hexmesh::bytes_of;

Mesh::Mesh(std::vector<Index3> cells, const Mat3& edges, const Vec3& corner)
    : Mesh(cells, hexmesh::number_nodes(cells), edges, corner) {}

Mesh::Mesh(std::vector<Index3> cells, hexmesh::NodeNumbering numbering, const Mat3& edges, const Vec3& corner)
    : cells_(std::move(cells)), numbering_(std::move(numbering)), sizes_{{0, {1, 1, 1}, edges}}, corner_(corner) {
  cut_into_batches();
}

Mesh::Mesh(std::vector<Index3> cells, std::vector<CellsOfSize> sizes, const Vec3& corner, const SplitNodes* split)
    : cells_(std::move(cells)),
      sizes_(std::move(sizes)),
      corner_(corner),
      is_graded_and_split_(is_graded() && split != nullptr) {
  GradedNumbering nodes = number_graded_nodes(cells_, sizes_, split);
  numbering_ = std::move(nodes.numbering);
  set_hanging(nodes.hanging);
  cut_into_batches();
}

void Mesh::set_hanging(const std::vector<HangingNode>& hanging) {
  hanging_begin_.push_back(0);
  for (const HangingNode& node : hanging) {
    for (const auto& [on, weight] : node) {
      support_nodes_.push_back(on);
      support_weights_.push_back(weight);
    }
    hanging_begin_.push_back(static_cast<std::int32_t>(support_nodes_.size()));
  }
}

/// Cells of one layer of one size make slabs, eight of a slab a batch.
void Mesh::cut_into_batches() {
  slabs_of_size_.push_back(0);
  batch_of_.resize(cells_.size());
  for (std::size_t size = 0; size < sizes_.size(); ++size) {
    const std::size_t end_of_cells = end_of_size(size), first_slab = slabs_.size();
    const std::span<const Index3> of_size(cells_.begin() + static_cast<std::ptrdiff_t>(sizes_[size].first),
                                          cells_.begin() + static_cast<std::ptrdiff_t>(end_of_cells));
    slabs_.resize(first_slab + static_cast<std::size_t>(hexmesh::extent_of(of_size)[2]), {0, 0});
    for (std::size_t c = sizes_[size].first; c < end_of_cells; ++c) {
      auto& slab = slabs_[first_slab + static_cast<std::size_t>(cells_[c][2])];
      if (slab.second == 0) slab.first = c;
      slab.second = c + 1;
    }
    slabs_of_size_.push_back(slabs_.size());
  }
  const std::vector<NodeRange> nodes = nodes_of_slabs();
  for (std::size_t s = 0; s < slabs_.size(); ++s)
    for (std::size_t first = slabs_[s].first; first < slabs_[s].second; first += batch_size) {
      batches_.push_back(make_batch(first, std::min(batch_size, slabs_[s].second - first), nodes[s]));
      for (std::size_t c = first; c < first + batches_.back().count; ++c)
        batch_of_[c] = static_cast<std::int32_t>(batches_.size() - 1);
    }
}

std::vector<Mesh::NodeRange> Mesh::nodes_of_slabs() const {
  constexpr NodeRange none = {std::numeric_limits<std::int32_t>::max(), -1};
  std::vector<NodeRange> nodes(slabs_.size(), none);
  for (std::size_t s = 0; s < slabs_.size(); ++s)
    for (std::size_t c = slabs_[s].first; c < slabs_[s].second; ++c)
      for (const std::int32_t n : cell_nodes()[c])
        nodes[s] = {std::min(nodes[s].first, n), std::max(nodes[s].second, n)};
  for (std::size_t size = 0; size < sizes_.size(); ++size)
    for (std::size_t color = 0; color < 2; ++color) {
      std::int32_t behind = -1;
      bool overlap = false;
      for (std::size_t s = slabs_of_size_[size] + color; s < slabs_of_size_[size + 1]; s += 2) {
        overlap = overlap || nodes[s].first <= behind;
        behind = std::max(behind, nodes[s].second);
      }
      for (std::size_t s = slabs_of_size_[size] + color; s < slabs_of_size_[size + 1]; s += 2)
        if (overlap) nodes[s] = none;
    }
  return nodes;
}

Mesh::Batch Mesh::make_batch(std::size_t first, std::size_t count, const NodeRange& of_slab) const {
  Batch batch{first, count};
  if (count < batch_size) return batch;
  const auto is_in_row = [&](std::size_t from, std::size_t lane) {
    const CellNodes &start = cell_nodes()[first + from], &here = cell_nodes()[first + lane];
    bool is = true;
    for (std::size_t a = 0; a < 8; ++a)
      is = is && here[a] == start[a / 2 * 2] + static_cast<std::int32_t>(lane - from + a % 2);
    return is;
  };
  std::size_t lane = 0;
  std::array<std::size_t, 2> from{};
  for (std::size_t row = 0; row < 2 && lane < batch_size; ++row) {
    from[row] = lane;
    while (lane < batch_size && is_in_row(from[row], lane)) ++lane;
    if (row == 0) batch.split = static_cast<int>(lane);
    for (std::size_t r = 0; r < 4; ++r) {
      std::int32_t& start = batch.rows[row][r];
      start = cell_nodes()[first + from[row]][2 * r] - static_cast<std::int32_t>(from[row]);
      if (batch.split < static_cast<int>(batch_size) &&
          (start < of_slab.first || start + static_cast<std::int32_t>(batch_size) > of_slab.second))
        batch.split = 0;
    }
    if (batch.split == 0) return batch;
  }
  if (lane < batch_size) batch.split = 0;
  return batch;
}

double Mesh::diameter() const {
  Vec3 extent = Vec3::Zero();
  for (const Index3& n : nodes()) extent = extent.cwiseMax(Vec3(n[0], n[1], n[2]));
  return (edges().cwiseAbs() * extent).norm();
}

std::size_t Mesh::bytes() const {
  return bytes_of(cells_) + bytes_of(numbering_.cell_nodes) + bytes_of(numbering_.nodes) + bytes_of(batches_) +
         bytes_of(batch_of_) + bytes_of(hanging_begin_) + bytes_of(support_nodes_) + bytes_of(support_weights_);
}

}  // namespace hexsolver
