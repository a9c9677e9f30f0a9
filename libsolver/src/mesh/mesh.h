// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <omp.h>

#include <Eigen/Core>
#include <type_traits>
#include <vector>

#include "hexmesh/lattice/lattice.h"
#include "hexmesh/lattice/merge.h"
#include "hexmesh/lattice/nodes.h"
#include "hexsolver/core/vectors.h"

namespace hexsolver {

using hexmesh::CellMatrix;
using hexmesh::CellVector;
using hexmesh::NodeGradients;
using hexmesh::NodeWeights;

using FloatNodeVector = Eigen::VectorXf;  ///< likewise, where digits do not matter

using hexmesh::CellNodes;

/// The cells of one level and their nodes.
class Mesh {
public:
  /// @param cells   sorted, i fastest
  /// @param edges   columns = edge vectors of a cell [mm]
  /// @param corner  position of node (0, 0, 0) [mm]
  Mesh(std::vector<Index3> cells, const Mat3& edges, const Vec3& corner);
  /// @param numbering  of the nodes; several may stand at one index, as several cells may
  Mesh(std::vector<Index3> cells, hexmesh::NodeNumbering numbering, const Mat3& edges, const Vec3& corner);

  std::size_t num_cells() const noexcept { return cells_.size(); }
  std::size_t num_nodes() const noexcept { return numbering_.nodes.size(); }
  std::size_t num_dofs() const noexcept { return 3 * numbering_.nodes.size(); }

  const std::vector<Index3>& cells() const noexcept { return cells_; }
  const std::vector<CellNodes>& cell_nodes() const noexcept { return numbering_.cell_nodes; }
  std::size_t node(std::size_t cell, std::size_t corner) const {
    return static_cast<std::size_t>(numbering_.cell_nodes[cell][corner]);
  }
  const std::vector<Index3>& nodes() const noexcept { return numbering_.nodes; }  ///< lattice index of each node
  const Mat3& edges() const noexcept { return edges_; }

  /// Rest position of a node [mm].
  Vec3 position(std::size_t node) const {
    return corner_ + edges_ * Vec3(nodes()[node][0], nodes()[node][1], nodes()[node][2]);
  }

  Vec3 rest_position(std::int32_t cell, const NodeWeights& weights) const {
    Vec3 x = Vec3::Zero();
    for (int a = 0; a < 8; ++a) x += weights[a] * position(node(cell, a));
    return x;
  }

  /// f(cell) for every cell, in parallel: no two cells at once share a node, and the order in which the cells of a
  /// node come is the same for any number of threads.
  static constexpr std::size_t worth_threads = 500;  ///< fewer cells take less time than the threads to wake up
  template <class F>
  void for_each_cell(F&& f) const {
    for_each_slab([&](std::size_t begin, std::size_t end) {
      for (std::size_t c = begin; c < end; ++c) f(c);
    });
  }

  /// Cells next to each other in one layer, at most eight.
  struct Batch {
    std::size_t first = 0, count = 0;
    std::size_t end() const noexcept { return first + count; }
    /// Eight in a row: then their nodes 2 r are rows[r], rows[r] + 1, ..., and 2 r + 1 those after them.
    bool is_row = false;
    std::array<std::int32_t, 4> rows{};
  };
  static constexpr std::size_t batch_size = 8;
  const std::vector<Batch>& batches() const noexcept { return batches_; }
  std::size_t batch_of(std::size_t cell) const { return static_cast<std::size_t>(batch_of_[cell]); }
  std::size_t lane_of(std::size_t cell) const { return cell - batches_[batch_of(cell)].first; }  ///< in its batch

  /// f(number) for every batch, as for_each_cell().
  template <class F>
  void for_each_batch(F&& f) const {
    for_each_slab([&](std::size_t begin, std::size_t end) {
      if (begin == end) return;
      for (std::size_t b = batch_of(begin); b <= batch_of(end - 1); ++b) f(b);
    });
  }

  template <class Scalar>
  Eigen::Matrix<Scalar, 24, 1> gather(std::size_t cell, const Eigen::Matrix<Scalar, Eigen::Dynamic, 1>& x) const {
    Eigen::Matrix<Scalar, 24, 1> v;
    for (int a = 0; a < 8; ++a) v.template segment<3>(3 * a) = x.template segment<3>(3 * node(cell, a));
    return v;
  }

  /// The value of a field at a point of a cell: sum_a w_a u_a.
  template <class Scalar>
  Vec3 interpolate(std::int32_t cell, const NodeWeights& weights,
                   const Eigen::Matrix<Scalar, Eigen::Dynamic, 1>& u) const {
    const CellVector v = gather(cell, u).template cast<double>();
    return Eigen::Map<const Eigen::Matrix<double, 3, 8>>(v.data()) * weights;
  }

  template <class Scalar>
  void scatter_add(std::size_t cell, const std::type_identity_t<Eigen::Matrix<Scalar, 24, 1>>& v,
                   Eigen::Matrix<Scalar, Eigen::Dynamic, 1>& y) const {
    for (int a = 0; a < 8; ++a) y.template segment<3>(3 * node(cell, a)) += v.template segment<3>(3 * a);
  }

  std::size_t bytes() const;  ///< of memory

private:
  /// f(begin, end) for the cells of each layer, in parallel: every second layer, then those between.
  template <class F>
  void for_each_slab(F&& f) const {
    for (std::size_t color = 0; color < 2; ++color) {
#pragma omp parallel for schedule(dynamic) if (num_cells() >= worth_threads)
      for (std::size_t s = color; s < slabs_.size(); s += 2) f(slabs_[s].first, slabs_[s].second);
    }
  }
  Batch make_batch(std::size_t first, std::size_t count) const;

  std::vector<Index3> cells_;
  hexmesh::NodeNumbering numbering_;
  Mat3 edges_;
  Vec3 corner_;
  std::vector<Batch> batches_;
  std::vector<std::int32_t> batch_of_;                      ///< cell
  std::vector<std::pair<std::size_t, std::size_t>> slabs_;  ///< ranges of cells, one layer k each, gaps kept empty
};

}  // namespace hexsolver
