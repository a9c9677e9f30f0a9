// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "hexmesh/lattice/lattice.h"
#include "hexmesh/lattice/locator.h"

namespace hexmesh {

inline constexpr int most_voxels_tied = 8;  ///< see Parting::gaps
inline constexpr int most_nodes_tied = 16;  ///< likewise

/// Carries what holds voxels together from level to level: cells of one parent that no chain of shared nodes links
/// become parents of their own, and parents share a node where their children do (see merge.h).
class Splitter {
public:
  /// At level 0. @pre the lattice has level 0, labels and something that parts
  explicit Splitter(const Lattice& lattice);

  /// Go on to the next level.
  Merge merge(const std::vector<Index3>& cells, const Index3& factor);

  /// Of the level reached.
  SplitCells split(const std::vector<Index3>& cells) const;

private:
  void find_crumbs(const std::vector<Index3>& voxels, const CellLocator& voxel_at);

  NodeNumbering numbering_;
  std::vector<bool> is_small_;              ///< of each cell, whether its part of the body is no body of its own
  std::vector<bool> is_crumb_;              ///< of each cell; empty: none
  std::vector<std::int32_t> part_;          ///< of each cell, the part that it moves with; of crumbs -1
  std::vector<std::int32_t> cell_of_;       ///< of each voxel with material
  std::vector<std::int64_t> voxel_offset_;  ///< likewise, in the lattice's box
};

}  // namespace hexmesh
