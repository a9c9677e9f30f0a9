// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "mesh/mesh_cells.h"

namespace hexsolver {

/// Graded cells seen from all cells of their finest level, in which every field of theirs can be told exactly.
class OnLevel {
public:
  /// @param mesh  of the cells; must outlive this
  OnLevel(const MeshCells& cells, const Mesh& mesh);

  /// Of cells that may be alike, which tell themselves: null.
  static std::unique_ptr<const OnLevel> of(const MeshCells& cells, const Mesh& mesh);

  const hexmesh::NodeNumbering& numbering() const noexcept { return numbering_; }  ///< of the level

  /// Of each cell of the level, the value of the one that it is in.
  std::vector<double> values(const std::vector<double>& of_graded) const;

  /// A field at the nodes of the level.
  void tell(const NodeVector& u, NodeVector& of_level) const;

  /// Of a field at the nodes of the level that graded cells have told, the values at the free nodes: where a corner of
  /// a partly filled cell is none of these nodes, as a cell of the level inside it goes on.
  NodeVector sampled(const NodeVector& of_level) const;

  /// Forces on the free nodes as forces on the nodes of the level, the transpose of sampled(): of the same work on all
  /// that graded cells tell, of the same sum and moment.
  NodeVector forces(const NodeVector& of_graded) const;

private:
  /// f(node of the level, weight) of a free node.
  template <class F>
  void for_each_weight(std::size_t free_node, F&& f) const;

  const Mesh& mesh_;
  hexmesh::NodeNumbering numbering_;
  std::vector<std::int32_t> cell_of_;  ///< graded cell of each cell of the level
  struct Place {
    std::int32_t cell = -1;
    NodeWeights weights;
  };
  std::vector<Place> places_;    ///< of the nodes of the level
  std::vector<Place> on_level_;  ///< of the free nodes, in cells of the level
};

}  // namespace hexsolver
