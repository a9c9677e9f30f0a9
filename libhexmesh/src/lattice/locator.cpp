// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/lattice/locator.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace hexmesh {

Vec3 local_in_cell(const Vec3& voxel_index, const Index3& cell, const Index3& voxels_per_cell) {
  Vec3 local;
  for (int d = 0; d < 3; ++d) local[d] = (voxel_index[d] + 0.5) / voxels_per_cell[d] - cell[d];
  return local;
}

CellLocator::CellLocator(const Grid& voxels, const Index3& voxels_per_cell, std::span<const Index3> cells)
    : voxels_(voxels),
      voxels_per_cell_(voxels_per_cell),
      cells_(cells),
      extent_(coarser_extent(voxels.extent(), voxels_per_cell)) {
  number_.assign(count_in(extent_), -1);
  for (std::size_t n = cells.size(); n-- > 0;) number_[offset_in(extent_, cells[n])] = static_cast<std::int32_t>(n);
}

CellLocator::CellLocator(const Grid& voxels, const Index3& voxels_per_cell, std::span<const Index3> cells,
                         const VoxelOwners& owners)
    : CellLocator(voxels, voxels_per_cell, cells) {
  if (!owners.empty()) owners_ = &owners;
}

std::int32_t CellLocator::choose(std::int32_t cell, const Index3& voxel) const {
  if (owners_ == nullptr || !shares_index(cell)) return cell;
  Index3 low, high, home;
  for (std::size_t d = 0; d < 3; ++d) {
    low[d] = cells_[cell][d] * voxels_per_cell_[d];
    high[d] = std::min(low[d] + voxels_per_cell_[d], voxels_.extent()[d]) - 1;
    home[d] = std::clamp(voxel[d], low[d], high[d]);
  }
  std::int32_t nearest = -1;
  double least = std::numeric_limits<double>::infinity();
  Index3 v;
  for (int shell = 0; nearest < 0 || shell * voxels_.spacing().minCoeff() <= least; ++shell) {
    bool is_beyond = true;
    for (v[2] = std::max(low[2], home[2] - shell); v[2] <= std::min(high[2], home[2] + shell); ++v[2])
      for (v[1] = std::max(low[1], home[1] - shell); v[1] <= std::min(high[1], home[1] + shell); ++v[1])
        for (v[0] = std::max(low[0], home[0] - shell); v[0] <= std::min(high[0], home[0] + shell); ++v[0]) {
          const Vec3 from(v[0] - home[0], v[1] - home[1], v[2] - home[2]);
          if (from.lpNorm<Eigen::Infinity>() < shell) continue;
          is_beyond = false;
          const double distance = from.cwiseProduct(voxels_.spacing()).norm();
          if (!(distance < least)) continue;
          if (const std::int32_t owner = owners_->of(static_cast<std::int64_t>(voxels_.offset(v))); owner >= 0) {
            nearest = owner;
            least = distance;
          }
        }
    if (is_beyond) break;
  }
  return nearest < 0 ? cell : nearest;
}

std::int32_t CellLocator::cell_at(const Index3& c) const {
  return is_in(extent_, c) ? number_[offset_in(extent_, c)] : -1;
}

Embedding CellLocator::embed(std::int32_t cell, const Vec3& voxel_index) const {
  return {cell, local_in_cell(voxel_index, cells_[cell], voxels_per_cell_)};
}

std::int32_t CellLocator::cell_of_voxel(const Index3& voxel) const {
  if (!voxels_.contains(voxel)) return -1;
  const std::int32_t cell = cell_at(coarser_index(voxel, voxels_per_cell_));
  return cell < 0 ? cell : choose(cell, voxel);
}

Embedding CellLocator::in_cell_of_voxel(const Index3& voxel, const Vec3& voxel_index) const {
  const std::int32_t cell = cell_of_voxel(voxel);
  return cell < 0 ? Embedding{} : embed(cell, voxel_index);
}

Embedding CellLocator::locate(const Vec3& voxel_index) const {
  Index3 home;
  for (int d = 0; d < 3; ++d) {
    const double c = std::floor((voxel_index[d] + 0.5) / voxels_per_cell_[d]);
    if (!(std::abs(c) < 1e6)) return {};
    home[d] = static_cast<std::int32_t>(c);
  }
  const Index3 voxel = nearest_voxel(voxel_index);
  if (const std::int32_t cell = cell_at(home); cell >= 0) return embed(choose(cell, voxel), voxel_index);

  // Shell after shell around the home cell; a cell in shell r is at least r - 1 shortest edges away.
  Vec3 size;
  for (int d = 0; d < 3; ++d) size[d] = voxels_per_cell_[d] * voxels_.spacing()[d];
  // Nothing lies beyond the box, which may be far smaller than what is in reach, or far away.
  const double most =
      std::max({extent_[0], extent_[1], extent_[2]}) + Vec3(home[0], home[1], home[2]).cwiseAbs().maxCoeff();
  const int reach = std::max(2, static_cast<int>(std::min(most, std::ceil(embedding_reach / size.minCoeff()))));
  const auto from = [&](int d, int shell) { return std::max(-shell, -home[d]); };
  const auto to = [&](int d, int shell) { return std::min(shell, extent_[d] - 1 - home[d]); };
  Embedding nearest;
  double least = std::numeric_limits<double>::infinity();
  for (int shell = 1; shell <= reach && (shell - 1) * size.minCoeff() < least; ++shell)
    for (int k = from(2, shell); k <= to(2, shell); ++k)
      for (int j = from(1, shell); j <= to(1, shell); ++j) {
        const bool on_shell = std::max(std::abs(j), std::abs(k)) == shell;
        for (int i = on_shell ? from(0, shell) : -shell; i <= (on_shell ? to(0, shell) : shell);
             i += on_shell ? 1 : 2 * shell) {
          const std::int32_t cell = cell_at({home[0] + i, home[1] + j, home[2] + k});
          if (cell < 0) continue;
          const Embedding e = embed(choose(cell, voxel), voxel_index);
          if (distance(e) < least) {
            least = distance(e);
            nearest = e;
          }
        }
      }
  return least <= std::max(embedding_reach, 2 * size.maxCoeff()) ? nearest : Embedding{};
}

double CellLocator::distance(const Embedding& e) const {
  Vec3 outside;
  for (int d = 0; d < 3; ++d)
    outside[d] = std::max({0.0, -e.local[d], e.local[d] - 1}) * voxels_per_cell_[d] * voxels_.spacing()[d];
  return outside.norm();
}

}  // namespace hexmesh
