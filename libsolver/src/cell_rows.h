// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <unordered_map>
#include <vector>

#include "cell_product.h"
#include "hexmesh/core/bytes.h"
#include "hexsolver/term.h"

namespace hexsolver {

/// Passes over fewer cells take less time than the threads to wake up.
inline constexpr std::size_t cells_worth_threads = 4000;

/// A vector (24) of each cell of a mesh, to be multiplied with: cells of batches that are all alike share theirs.
template <class Real>
class CellRows {
public:
  /// @param mesh  must outlive this
  explicit CellRows(const Mesh& mesh) : mesh_(mesh) {}

  /// @param of      cell -> vector
  /// @param shared  cell -> its number; cells of one number >= 0 have the same
  template <class Of, class Shared>
  void set(const Of& of, const Shared& shared) {
    alike_.clear();
    place_of_batch_.resize(mesh_.batches().size());
    std::unordered_map<std::int32_t, std::int32_t> known;
    std::int32_t num_each = 0;
    for (std::size_t b = 0; b < place_of_batch_.size(); ++b) {
      const Mesh::Batch& batch = mesh_.batches()[b];
      const std::int32_t number = shared(batch.first);
      bool are_alike = number >= 0;
      for (std::size_t c = batch.first + 1; c < batch.first + batch.count && are_alike; ++c)
        are_alike = shared(c) == number;
      if (!are_alike) {
        place_of_batch_[b] = -1 - num_each++;
        continue;
      }
      const auto [entry, is_new] = known.try_emplace(number, static_cast<std::int32_t>(alike_.size()));
      if (is_new) {
        const CellVector v = of(batch.first);
        LaneVectors<Real>& alike = alike_.emplace_back();
        for (std::size_t lane = 0; lane < Mesh::batch_size; ++lane) alike.set(lane, v);
      }
      place_of_batch_[b] = entry->second;
    }
    each_.resize(static_cast<std::size_t>(num_each));
    const auto count = static_cast<std::ptrdiff_t>(place_of_batch_.size());
#pragma omp parallel for schedule(static)
    for (std::ptrdiff_t n = 0; n < count; ++n) {
      const auto b = static_cast<std::size_t>(n);
      if (place_of_batch_[b] >= 0) continue;
      const Mesh::Batch& batch = mesh_.batches()[b];
      LaneVectors<Real>& each = each_[static_cast<std::size_t>(-1 - place_of_batch_[b])];
      for (std::size_t lane = 0; lane < batch.count; ++lane) each.set(lane, of(batch.first + lane));
    }
  }

  const LaneVectors<Real>& of_batch(std::size_t batch) const {
    const std::int32_t place = place_of_batch_[batch];
    return place >= 0 ? alike_[static_cast<std::size_t>(place)] : each_[static_cast<std::size_t>(-1 - place)];
  }

  /// Batches of one number >= 0 have one vector.
  std::int32_t number_of_batch(std::size_t batch) const { return place_of_batch_[batch]; }

  /// Shape (3, 8): columns = nodes of the cell.
  auto get(std::size_t cell) const {
    const std::size_t batch = mesh_.batch_of(cell);
    return of_batch(batch).get(cell - mesh_.batches()[batch].first);
  }

  std::size_t bytes() const {
    return hexmesh::bytes_of(place_of_batch_) + hexmesh::bytes_of(alike_) + hexmesh::bytes_of(each_);
  }

private:
  const Mesh& mesh_;
  std::vector<std::int32_t> place_of_batch_;  ///< n: alike_[n]; -1 - n: each_[n]
  std::vector<LaneVectors<Real>> alike_, each_;
};

}  // namespace hexsolver
