// SPDX-License-Identifier: Apache-2.0
#include "distributed/part.h"

#include <algorithm>
#include <array>
#include <map>
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

/// A kind of condensed cell in numbers.
using TravellingKind = std::array<double, 24 * 24 + 24 + 2 + 24 * 3>;

TravellingKind packed(const hexmesh::CondensedElement& kind) {
  TravellingKind out;
  CellMatrix::Map(out.data()) = kind.stiffness;
  CellVector::Map(&out[24 * 24]) = kind.divergence;
  out[24 * 24 + 24] = kind.excess;
  out[24 * 24 + 25] = kind.volume;
  hexmesh::CellWeight::Map(&out[24 * 24 + 26]) = kind.weight;
  return out;
}

hexmesh::CondensedElement unpacked(const TravellingKind& in) {
  return {CellMatrix::Map(in.data()), CellVector::Map(&in[24 * 24]), in[24 * 24 + 24], in[24 * 24 + 25],
          hexmesh::CellWeight::Map(&in[24 * 24 + 26])};
}

}  // namespace

Part take_part(const Processes& all, const hexmesh::LatticeReader& file, const hexmesh::Lattice& outline, int level,
               Piece& piece, const Index3& block) {
  const std::size_t first = piece.rows().first_cell, count = piece.rows().num_own_cells;
  const KeyedCells& keys = piece.keys();
  std::vector<Index3> blocks;
  for (std::size_t c = first; c < first + count; ++c)
    blocks.push_back(hexmesh::coarser_index(keys.cells[c].index, block));
  Journey journey(all, partition_along_curve(all, blocks));
  const std::vector<std::int32_t> elements = piece.take_elements_in_file();
  auto cells = journey.send<TravellingCell>([&](std::size_t c) {
    return TravellingCell{keys.cells[first + c], elements[c]};
  });
  std::vector<std::size_t> order(cells.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return before(cells[a].key, cells[b].key); });
  journey.arrange(std::move(order));
  std::sort(cells.begin(), cells.end(),
            [](const TravellingCell& a, const TravellingCell& b) { return before(a.key, b.key); });

  Part out{{}, {}, {}, outline, std::move(journey)};
  if (outline.parting.any()) {
    const std::vector<Index3> voxels = piece.some_voxels();
    const auto split = out.journey.send<TravellingSplit>([&](std::size_t c) {
      return TravellingSplit{keys.corners_of(first + c), voxels[first + c]};
    });
    for (const TravellingSplit& s : split) {
      out.keys.corners.push_back(s.corners);
      out.voxels.push_back(s.voxel);
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
  for (const auto& [key, element] : cells) {
    out.keys.cells.push_back(key);
    to.cells.push_back({key.index[0] - low[0], key.index[1] - low[1], key.index[2] - low[2]});
    to.element.push_back(element);
  }
  all.all_or_none([&] { file.read_elements(out.lattice, level, to.element); });
  return out;
}

hexmesh::CondensedLevel take_condensed(const Processes& all, const Piece& piece, const Part& part,
                                       const hexmesh::CondensedLevel& of_piece) {
  // Each process gets the kinds of its cells once from each of those that have read some of them.
  struct Numbers {
    std::int32_t from, kind;
  };
  const std::size_t first = piece.rows().first_cell;
  const std::vector<int>& goes_to = part.journey.goes_to();
  std::vector<std::vector<TravellingKind>> kinds(static_cast<std::size_t>(all.count()));
  std::vector<std::map<std::int32_t, std::int32_t>> number(kinds.size());
  for (std::size_t c = 0; c < goes_to.size(); ++c) {
    const auto to = static_cast<std::size_t>(goes_to[c]);
    const std::int32_t kind = of_piece.kind[first + c];
    if (number[to].try_emplace(kind, static_cast<std::int32_t>(kinds[to].size())).second)
      kinds[to].push_back(packed(of_piece.condensed[hexmesh::as_size(kind)]));
  }
  const auto numbers = part.journey.send<Numbers>([&](std::size_t c) {
    return Numbers{all.rank(), number[static_cast<std::size_t>(goes_to[c])].at(of_piece.kind[first + c])};
  });
  hexmesh::CondensedLevel out;
  std::vector<std::int32_t> first_of;
  for (const std::vector<TravellingKind>& from : all.exchange(kinds)) {
    first_of.push_back(static_cast<std::int32_t>(out.condensed.size()));
    for (const TravellingKind& kind : from) out.condensed.push_back(unpacked(kind));
  }
  for (const Numbers& n : numbers) out.kind.push_back(first_of[hexmesh::as_size(n.from)] + n.kind);
  return out;
}

}  // namespace hexsolver::mpi
