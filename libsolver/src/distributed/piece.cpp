// SPDX-License-Identifier: Apache-2.0
#include "distributed/piece.h"

#include <algorithm>

namespace hexsolver::mpi {
namespace {

std::vector<std::uint64_t> first_rows_of(const Processes& all, const hexmesh::LatticeReader& file, int level,
                                         std::size_t num_cells) {
  const auto rank = static_cast<std::size_t>(all.rank()), count = static_cast<std::size_t>(all.count());
  const std::size_t begin = num_cells * rank / count, end = num_cells * (rank + 1) / count;
  std::vector<std::uint64_t> in_layer;
  all.all_or_none([&] { in_layer = file.cells_in_layers(level, begin, end - begin); });
  in_layer = all.sum(std::move(in_layer));
  std::vector<std::uint64_t> rows = {0};
  for (const std::uint64_t n : in_layer) rows.push_back(rows.back() + n);
  return rows;
}

/// The layers that a piece stands for.
class LayersShare final : public SurfaceShare {
public:
  LayersShare(const Processes& all, const hexmesh::LatticePiece& piece, int layer_voxels)
      : all_(all), piece_(piece), layer_voxels_(layer_voxels) {}
  bool has_voxel(const Index3& voxel) const override { return has(voxel[2] / layer_voxels_, piece_.end); }
  bool has_node(const Index3& node) const override {
    return has(node[2], piece_.end + (all_.rank() + 1 == all_.count()));
  }
  double least(double value) const override { return all_.least(value); }
  double sum(double value) const override { return all_.sum(value); }
  void add_up(std::vector<Vec3>& values) const override {
    if (!values.empty()) all_.add_up({values.front().data(), 3 * values.size()});
  }
  bool is_first(bool mine) const override {
    const int rank = all_.rank();
    return all_.least(mine ? rank : all_.count()) == rank;
  }

private:
  bool has(std::int32_t layer, std::int32_t end) const { return layer >= piece_.begin && layer < end; }
  const Processes& all_;
  const hexmesh::LatticePiece& piece_;
  int layer_voxels_;
};

}  // namespace

Piece::Piece(const Processes& all, const hexmesh::LatticeReader& file, const hexmesh::Lattice& outline, int level,
             std::size_t num_cells, std::int32_t margin)
    : Piece(all, file, outline, level, first_rows_of(all, file, level, num_cells), margin) {}

Piece::Piece(const Processes& all, const hexmesh::LatticeReader& file, const hexmesh::Lattice& outline, int level,
             const std::vector<std::uint64_t>& first_rows, std::int32_t margin)
    : all_(all), level_(level), margin_(margin), layers_(all, first_rows) {
  all.all_or_none([&] {
    piece_ = file.read_layers(outline, level, first_rows, layers_.begin(all.rank()), layers_.end(all.rank()), margin);
  });
  hexmesh::Level& cells = piece_->lattice.levels[static_cast<std::size_t>(level)];
  const auto first = cells.element.begin() + static_cast<std::ptrdiff_t>(piece_->first_cell);
  elements_in_file_.assign(first, first + static_cast<std::ptrdiff_t>(piece_->num_own_cells));
  all.all_or_none([&] { file.read_elements(piece_->lattice, level, cells.element); });
  const Index3 low = {0, 0, piece_->low};
  keys_ = keyed_cells(cells, low);
  mesh_ = std::make_unique<Mesh>(keys_.make_mesh(low, piece_->lattice.cell_edges(level), piece_->lattice.corner()));
  share_ =
      std::make_unique<LayersShare>(all, *piece_, outline.levels[static_cast<std::size_t>(level)].voxels_per_cell[2]);
}

hexmesh::CellLocator Piece::locator() const {
  return {lattice().voxels, level().voxels_per_cell, level().cells, level().split.owners};
}

hexmesh::Lattice Piece::with_finer_levels(const hexmesh::LatticeReader& file, const hexmesh::Lattice& outline) const {
  hexmesh::Lattice out = lattice();
  for (int n = 0; n < level_; ++n) {
    std::size_t num_cells = 0;
    all_.all_or_none([&] { num_cells = file.num_cells(n); });
    const std::vector<std::uint64_t> first_rows = first_rows_of(all_, file, n, num_cells);
    const Index3& voxels_per_cell = outline.level(n).voxels_per_cell;
    const std::int32_t layers = hexmesh::coarser_extent(outline.voxels.extent(), voxels_per_cell)[2];
    const auto layer = [&](std::int32_t of_piece) {
      return std::min((piece_->low + of_piece) * level().voxels_per_cell[2] / voxels_per_cell[2], layers);
    };
    const std::int32_t end = std::min(piece_->end + margin_, piece_->num_layers);
    all_.all_or_none([&] {
      out.level(n) = std::move(file.read_layers(outline, n, first_rows, layer(0), layer(end), 0).lattice.level(n));
    });
  }
  return out;
}

std::vector<Piece::Holder> Piece::holders_of(const std::vector<Index3>& voxels) const {
  const std::int32_t layer_voxels = level().voxels_per_cell[2];
  const hexmesh::CellLocator cells = locator();
  return ask<Holder>(
      all_, voxels, [&](const Index3& voxel) { return layers_.process_of(voxel[2] / layer_voxels); },
      [&](const Index3& voxel) {
        const Index3 here = {voxel[0], voxel[1], voxel[2] - piece_->low * layer_voxels};
        return cell(hexmesh::as_size(cells.cell_of_voxel(here)));
      });
}

std::vector<Index3> Piece::some_voxels() const {
  const hexmesh::Grid& voxels = lattice().voxels;
  const hexmesh::CellLocator cells = locator();
  std::vector<bool> has_material(65536);
  for (const hexmesh::LatticeSegment& s : lattice().segments) has_material[s.segment.label] = s.material.has_value();
  std::vector<Index3> out(level().cells.size());
  for (std::size_t n = lattice().labels.size(); n-- > 0;)
    if (has_material[lattice().labels[n]]) {
      const Index3 voxel = voxels.index(n);
      out[hexmesh::as_size(cells.cell_of_voxel(voxel))] = {voxel[0], voxel[1],
                                                           voxel[2] + piece_->low * level().voxels_per_cell[2]};
    }
  return out;
}

}  // namespace hexsolver::mpi
