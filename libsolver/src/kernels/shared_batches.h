// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <unordered_map>
#include <vector>

#include "hexmesh/core/bytes.h"
#include "mesh/mesh.h"

namespace hexsolver {

/// Which batches of a mesh have cells that all share one number. Such batches have one entry for each number; the
/// others have an entry for each batch.
class SharedBatches {
public:
  struct Shared {
    std::int32_t number = 0;
    std::size_t first_cell = 0;  ///< of the first batch that has it
  };

  /// @param number_of  cell -> number; negative = a cell that shares nothing
  template <class NumberOf>
  void find(const Mesh& mesh, const NumberOf& number_of) {
    shared_.clear();
    num_single_ = 0;
    place_.resize(mesh.batches().size());
    std::unordered_map<std::int32_t, std::int32_t> known;
    for (std::size_t b = 0; b < place_.size(); ++b) {
      const Mesh::Batch& batch = mesh.batches()[b];
      const std::int32_t number = number_of(batch.first);
      bool is_shared = number >= 0;
      for (std::size_t c = batch.first + 1; c < batch.end() && is_shared; ++c) is_shared = number_of(c) == number;
      if (!is_shared) {
        place_[b] = -1 - num_single_++;
        continue;
      }
      const auto [entry, is_new] = known.try_emplace(number, static_cast<std::int32_t>(shared_.size()));
      if (is_new) shared_.push_back({number, batch.first});
      place_[b] = entry->second;
    }
  }

  bool is_empty() const noexcept { return place_.empty(); }
  const std::vector<Shared>& shared() const noexcept { return shared_; }
  std::size_t num_single() const noexcept { return num_single_; }

  bool is_shared(std::size_t batch) const { return place_[batch] >= 0; }
  std::int32_t shared_place(std::size_t batch) const { return place_[batch]; }  ///< in shared(); negative = none
  std::size_t single_place(std::size_t batch) const { return -1 - place_[batch]; }

  std::size_t bytes() const { return hexmesh::bytes_of(place_) + hexmesh::bytes_of(shared_); }  ///< of memory

private:
  std::vector<std::int32_t> place_;  ///< of each batch: n in shared(), or -1 - n among the others
  std::vector<Shared> shared_;
  std::int32_t num_single_ = 0;
};

}  // namespace hexsolver
