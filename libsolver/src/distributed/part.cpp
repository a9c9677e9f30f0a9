// SPDX-License-Identifier: Apache-2.0
#include "distributed/part.h"

#include <algorithm>

namespace hexsolver::mpi {
namespace {

/// A cell on its way to the process that gets it.
struct TravellingCell {
  Index3 index;
  std::int32_t element;
};

std::vector<TravellingCell> take_cells(const Processes& all, Piece& piece, const Index3& block) {
  const auto first = piece.level().cells.begin() + static_cast<std::ptrdiff_t>(piece.rows().first_cell);
  const std::vector<Index3> own =
      piece.in_whole({first, first + static_cast<std::ptrdiff_t>(piece.rows().num_own_cells)});
  const std::vector<std::int32_t> elements = piece.take_elements_in_file();
  std::vector<Index3> blocks;
  for (const Index3& index : own) blocks.push_back(hexmesh::coarser_index(index, block));
  const std::vector<int> goes_to = partition_along_curve(all, blocks);
  std::vector<std::vector<TravellingCell>> to(static_cast<std::size_t>(all.count()));
  for (std::size_t c = 0; c < own.size(); ++c)
    to[static_cast<std::size_t>(goes_to[c])].push_back({own[c], elements[c]});
  std::vector<TravellingCell> cells;
  for (const std::vector<TravellingCell>& part : all.exchange(to)) cells.insert(cells.end(), part.begin(), part.end());
  std::sort(cells.begin(), cells.end(),
            [](const TravellingCell& a, const TravellingCell& b) { return before(a.index, b.index); });
  return cells;
}

}  // namespace

Part take_part(const Processes& all, const hexmesh::LatticeReader& file, const hexmesh::Lattice& outline, int level,
               Piece& piece, const Index3& block) {
  const std::vector<TravellingCell> cells = take_cells(all, piece, block);
  Part out{{}, outline};
  if (!cells.empty()) out.low = cells.front().index;
  for (const TravellingCell& c : cells)
    for (std::size_t d = 0; d < 3; ++d) out.low[d] = std::min(out.low[d], c.index[d]);
  for (std::size_t d = 0; d < 3; ++d) out.low[d] -= out.low[d] % block[d];
  hexmesh::Level& to = out.lattice.levels[static_cast<std::size_t>(level)];
  const Index3 &size = to.voxels_per_cell, &low = out.low;
  const hexmesh::Grid& whole = outline.voxels;
  out.lattice.voxels =
      hexmesh::Grid(whole.extent(), whole.spacing(),
                    whole.position(Vec3(low[0] * size[0], low[1] * size[1], low[2] * size[2])), whole.direction());
  for (const TravellingCell& c : cells) {
    to.cells.push_back({c.index[0] - low[0], c.index[1] - low[1], c.index[2] - low[2]});
    to.element.push_back(c.element);
  }
  all.all_or_none([&] { file.read_elements(out.lattice, level, to.element); });
  return out;
}

}  // namespace hexsolver::mpi
