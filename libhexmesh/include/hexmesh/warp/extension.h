// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>
#include <vector>

#include "hexmesh/result/result.h"

namespace hexmesh {

/// Fields of nodes continued from the material, for those who look at all nodes.
///
/// A corner of a nearly empty cell moves without meaning: only what it gives to the material counts. Here a node that
/// sees less than a twentieth of a cell's material (the integral of its shape function, over a cell's volume) takes the
/// affine field that fits the material of the cells around it best, by least squares, near places counting most. An
/// affine field is continued exactly; what all other nodes have stays.
class NodeExtension {
public:
  /// @param result  its cells, nodes and labels; kept are only weights
  explicit NodeExtension(const Result& result);

  bool is_empty() const { return rows_.empty() && slivers_.empty(); }  ///< whether nothing needs it
  std::size_t num_nodes() const { return rows_.size(); }

  std::vector<Vec3> extended(std::vector<Vec3> field) const;

  /// Of a field of cells: those with less than a tenth of material take the mean around, by volume; the cells whose
  /// nodes they share, and themselves.
  std::vector<double> without_slivers(std::vector<double> of_cells) const;

private:
  /// A value made of others.
  struct Row {
    std::int32_t index = 0;
    std::vector<std::pair<std::int32_t, double>> weights;
  };
  template <class Value>
  static std::vector<Value> replaced(const std::vector<Row>& rows, std::vector<Value> values, const Value& zero);

  std::vector<Row> rows_, slivers_;  ///< of nodes, and of cells
};

}  // namespace hexmesh
