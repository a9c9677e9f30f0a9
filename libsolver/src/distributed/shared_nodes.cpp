// SPDX-License-Identifier: Apache-2.0
#include "distributed/shared_nodes.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>

namespace hexsolver::mpi {
Layers::Layers(const Processes& all, const std::vector<std::uint64_t>& first_rows) {
  const auto count = static_cast<std::uint64_t>(all.count());
  for (std::uint64_t p = 0; p < count; ++p) {
    const std::uint64_t wanted = first_rows.back() * p / count;
    begins_.push_back(static_cast<std::int32_t>(std::lower_bound(first_rows.begin(), first_rows.end() - 1, wanted) -
                                                first_rows.begin()));
  }
  begins_.front() = 0;
  begins_.push_back(static_cast<std::int32_t>(first_rows.size()) - 1);
}

Layers::Layers(const Layers& finer, int factor) : begins_(finer.begins_) {
  for (std::int32_t& begin : begins_) begin = (begin + factor - 1) / factor;
}

int Layers::process_of(std::int32_t layer) const {
  const auto next = std::upper_bound(begins_.begin(), begins_.end() - 1, layer);
  return static_cast<int>(next - begins_.begin()) - 1;
}

std::vector<std::vector<Key>> SharedNodes::sort_by_process(const std::vector<Key>& keys) const {
  std::vector<std::vector<Key>> out(static_cast<std::size_t>(all_.count()));
  for (const Key& key : keys) out[static_cast<std::size_t>(process_of(key))].push_back(key);
  return out;
}

const SharedNodes::Entry* SharedNodes::entry_of(const Key& key) const {
  const auto found = std::lower_bound(entries_.begin(), entries_.end(), key,
                                      [](const Entry& e, const Key& k) { return before(e.key, k); });
  return found != entries_.end() && found->key == key ? &*found : nullptr;
}

SharedNodes::SharedNodes(const Processes& all, const Layers& layers, const std::vector<Key>& keys)
    : all_(all), layers_(layers) {
  // The first process that uses a node owns it.
  const std::vector<std::vector<Key>> used = all.exchange(sort_by_process(keys));
  for (std::size_t p = 0; p < used.size(); ++p)
    for (const Key& key : used[p]) entries_.push_back({key, static_cast<int>(p), -1});
  std::stable_sort(entries_.begin(), entries_.end(),
                   [](const Entry& a, const Entry& b) { return before(a.key, b.key); });
  entries_.erase(
      std::unique(entries_.begin(), entries_.end(), [](const Entry& a, const Entry& b) { return a.key == b.key; }),
      entries_.end());
  entries_.shrink_to_fit();

  const std::vector<int> owners = ask<int>(
      all, keys, [&](const Key& key) { return process_of(key); }, [&](const Key& key) { return entry_of(key)->owner; });
  std::vector<Key> own;
  for (std::size_t n = 0; n < keys.size(); ++n)
    if (owners[n] == all.rank()) own.push_back(keys[n]);
  constexpr std::size_t most = std::numeric_limits<PetscInt>::max() / 3;
  if (const std::size_t count = all.sum(own.size()); count > most)
    throw SharedError(hexmesh::ErrorKind::input,
                      fmt::format("{} nodes are more than this PETSc can count, expected at most {}", count, most));
  num_own_ = static_cast<PetscInt>(own.size());
  first_own_ = static_cast<PetscInt>(all.sum_before(own.size()));
  num_all_ = static_cast<PetscInt>(all.sum(own.size()));

  struct Announced {
    Key key;
    PetscInt number;
  };
  std::vector<std::vector<Announced>> announced(static_cast<std::size_t>(all.count()));
  for (std::size_t n = 0; n < own.size(); ++n)
    announced[static_cast<std::size_t>(process_of(own[n]))].push_back({own[n], first_own_ + static_cast<PetscInt>(n)});
  for (const std::vector<Announced>& told : all.exchange(announced))
    for (const Announced& a : told)
      entries_[static_cast<std::size_t>(entry_of(a.key) - entries_.data())].number = a.number;
  numbers_ = find(keys);
}

std::vector<PetscInt> SharedNodes::find(const std::vector<Key>& keys) const {
  return ask<PetscInt>(
      all_, keys, [this](const Key& key) { return process_of(key); },
      [this](const Key& key) {
        const Entry* entry = entry_of(key);
        return entry ? entry->number : PetscInt{-1};
      });
}

namespace {

/// The bits of i, j and k in turn.
std::uint64_t place_on_curve(const Index3& cell) {
  std::uint64_t out = 0;
  for (std::size_t d = 0; d < 3; ++d)
    for (unsigned bit = 0; bit < 21; ++bit) out |= (static_cast<std::uint64_t>(cell[d]) >> bit & 1) << (3 * bit + d);
  return out;
}

}  // namespace

std::vector<int> partition_along_curve(const Processes& all, const std::vector<Index3>& cells) {
  std::vector<std::uint64_t> places;
  for (const Index3& c : cells) places.push_back(place_on_curve(c));
  std::vector<std::uint64_t> sorted = places;
  std::sort(sorted.begin(), sorted.end());

  // The place where each process's part begins, by bisection of the curve: all at once.
  const std::uint64_t num_cells = all.sum(cells.size());
  const std::size_t count = static_cast<std::size_t>(all.count()) - 1;
  std::vector<std::uint64_t> low(count, 0), high(count, std::uint64_t{1} << 63), below(count);
  for (int step = 0; step < 63; ++step) {
    for (std::size_t n = 0; n < count; ++n)
      below[n] = static_cast<std::uint64_t>(
          std::lower_bound(sorted.begin(), sorted.end(), low[n] + (high[n] - low[n]) / 2) - sorted.begin());
    below = all.sum(std::move(below));
    for (std::size_t n = 0; n < count; ++n) {
      const std::uint64_t middle = low[n] + (high[n] - low[n]) / 2;
      (below[n] < num_cells * (n + 1) / static_cast<std::uint64_t>(all.count()) ? low[n] : high[n]) = middle;
    }
  }
  std::vector<int> out;
  for (const std::uint64_t place : places)
    out.push_back(static_cast<int>(std::upper_bound(high.begin(), high.end(), place) - high.begin()));
  return out;
}

}  // namespace hexsolver::mpi
