// SPDX-License-Identifier: Apache-2.0
#include "distributed/part.h"

#include <algorithm>
#include <numeric>

namespace hexsolver::mpi {
namespace {

/// A cell on its way to the process that gets it.
struct TravellingCell {
  Key key;
  std::int32_t element;
};

/// What more there is to say of it where cells are split.
struct TravellingSplit {
  CornerNumbers corners;
  Index3 voxel;
};

/// Cells that this process has read, to those that get them.
class Journey {
public:
  Journey(const Processes& all, std::vector<int> goes_to) : all_(all), goes_to_(std::move(goes_to)) {}

  /// @param value_of  cell -> value
  template <class T, class ValueOf>
  std::vector<T> send(const ValueOf& value_of) const {
    std::vector<std::vector<T>> to(static_cast<std::size_t>(all_.count()));
    for (std::size_t c = 0; c < goes_to_.size(); ++c) to[static_cast<std::size_t>(goes_to_[c])].push_back(value_of(c));
    std::vector<T> out;
    for (const std::vector<T>& from : all_.exchange(to)) out.insert(out.end(), from.begin(), from.end());
    return out;
  }

private:
  const Processes& all_;
  std::vector<int> goes_to_;
};

}  // namespace

Part take_part(const Processes& all, const hexmesh::LatticeReader& file, const hexmesh::Lattice& outline, int level,
               Piece& piece, const Index3& block) {
  const std::size_t first = piece.rows().first_cell, count = piece.rows().num_own_cells;
  const KeyedCells& keys = piece.keys();
  std::vector<Index3> blocks;
  for (std::size_t c = first; c < first + count; ++c)
    blocks.push_back(hexmesh::coarser_index(keys.cells[c].index, block));
  const Journey journey(all, partition_along_curve(all, blocks));
  const std::vector<std::int32_t> elements = piece.take_elements_in_file();
  const auto cells = journey.send<TravellingCell>([&](std::size_t c) {
    return TravellingCell{keys.cells[first + c], elements[c]};
  });
  std::vector<std::size_t> order(cells.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return before(cells[a].key, cells[b].key); });

  Part out{{}, {}, {}, outline};
  if (outline.parting.any()) {
    const std::vector<Index3> voxels = piece.some_voxels();
    const auto split = journey.send<TravellingSplit>([&](std::size_t c) {
      return TravellingSplit{keys.corners_of(first + c), voxels[first + c]};
    });
    for (const std::size_t c : order) {
      out.keys.corners.push_back(split[c].corners);
      out.voxels.push_back(split[c].voxel);
    }
  }
  if (!cells.empty()) out.low = cells.front().key.index;
  for (const TravellingCell& c : cells)
    for (std::size_t d = 0; d < 3; ++d) out.low[d] = std::min(out.low[d], c.key.index[d]);
  for (std::size_t d = 0; d < 3; ++d) out.low[d] -= out.low[d] % block[d];
  hexmesh::Level& to = out.lattice.levels[static_cast<std::size_t>(level)];
  const Index3 &size = to.voxels_per_cell, &low = out.low;
  const hexmesh::Grid& whole = outline.voxels;
  out.lattice.voxels =
      hexmesh::Grid(whole.extent(), whole.spacing(),
                    whole.position(Vec3(low[0] * size[0], low[1] * size[1], low[2] * size[2])), whole.direction());
  for (const std::size_t c : order) {
    const Index3& index = cells[c].key.index;
    out.keys.cells.push_back(cells[c].key);
    to.cells.push_back({index[0] - low[0], index[1] - low[1], index[2] - low[2]});
    to.element.push_back(cells[c].element);
  }
  all.all_or_none([&] { file.read_elements(out.lattice, level, to.element); });
  return out;
}

}  // namespace hexsolver::mpi
