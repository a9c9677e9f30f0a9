// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <vector>

#include "hexmesh/lattice/lattice.h"

namespace hexmesh {

/// Forms the elements of a lattice from the materials of its voxels: w_parent = sum_c T_c w_child, level by level,
/// which is K_parent = sum_c L_c^T K_c L_c for every matrix of element.h.
///
/// An element is formed when it is asked for; those that many cells share are kept, so that all levels together cost
/// about one visit of every voxel and memory stays small where every cell is unique.
class ElementTree {
public:
  /// @param lattice  must outlive the tree; its levels' children must be there up to the levels asked for
  explicit ElementTree(const Lattice& lattice);

  /// One element of a level.
  Element form(int level, std::int32_t element);

  /// All elements of a level.
  std::vector<Element> form_all(int level);

private:
  void add_voxel(Element& parent, std::int32_t material, int slot) const;

  struct Kept {
    bool keeps = false;
    std::vector<Element> elements;
    std::vector<bool> known;
  };

  const Lattice& lattice_;
  std::vector<Kept> kept_;                      ///< per level
  std::array<Element::Weights, 8> voxel_fill_;  ///< of a full voxel in each slot of level 1
};

/// All elements of one level.
std::vector<Element> form_elements(const Lattice& lattice, int level);

}  // namespace hexmesh
