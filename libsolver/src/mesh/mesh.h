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
#include "mesh/hanging_nodes.h"

namespace hexsolver {

using hexmesh::CellMatrix;
using hexmesh::CellVector;
using hexmesh::NodeGradients;
using hexmesh::NodeWeights;

using FloatNodeVector = Eigen::VectorXf;  ///< likewise, where digits do not matter

using hexmesh::CellNodes;

/// Cells and their nodes: those of one level, or of several levels side by side (a graded mesh).
///
/// Where small cells meet a larger one, some of their corners stand inside its edges and faces. These hang: they move
/// as the nodes around them say, u_hanging = sum of w u, so that the field of displacements has no gap. A field is
/// given at the free nodes; `spread` adds the hanging ones and `collect`, its transpose, takes forces off them. All
/// numbers of nodes from num_nodes() on are of hanging ones.
class Mesh {
public:
  /// @param cells   sorted, i fastest
  /// @param edges   columns = edge vectors of a cell [mm]
  /// @param corner  position of node (0, 0, 0) [mm]
  Mesh(std::vector<Index3> cells, const Mat3& edges, const Vec3& corner);
  /// @param numbering  of the nodes; several may stand at one index, as several cells may
  Mesh(std::vector<Index3> cells, hexmesh::NodeNumbering numbering, const Mat3& edges, const Vec3& corner);
  /// Of cells of several sizes, two cells that touch differing by one size at most.
  /// @param cells   those of each size sorted, i fastest; the index of a cell counts cells of its size
  /// @param sizes   finest first
  /// @param split   where several cells stand at one index, or do not share its node; else nullptr
  Mesh(std::vector<Index3> cells, std::vector<CellsOfSize> sizes, const Vec3& corner,
       const SplitNodes* split = nullptr);

  std::size_t num_cells() const noexcept { return cells_.size(); }
  std::size_t num_nodes() const noexcept { return numbering_.nodes.size() - num_hanging(); }  ///< those that are free
  std::size_t num_dofs() const noexcept { return 3 * num_nodes(); }
  std::size_t num_hanging() const noexcept { return hanging_begin_.empty() ? 0 : hanging_begin_.size() - 1; }
  std::size_t num_all_nodes() const noexcept { return numbering_.nodes.size(); }

  const std::vector<Index3>& cells() const noexcept { return cells_; }
  const std::vector<CellNodes>& cell_nodes() const noexcept { return numbering_.cell_nodes; }
  std::size_t node(std::size_t cell, std::size_t corner) const {
    return static_cast<std::size_t>(numbering_.cell_nodes[cell][corner]);
  }
  /// Index of each node, hanging ones behind the others; it counts edges of the finest cells.
  const std::vector<Index3>& nodes() const noexcept { return numbering_.nodes; }
  const Mat3& edges() const noexcept { return sizes_.front().edges; }  ///< of the finest cells

  const std::vector<CellsOfSize>& sizes() const noexcept { return sizes_; }  ///< finest first
  bool is_graded() const noexcept { return sizes_.size() > 1; }
  bool is_graded_and_split() const noexcept { return is_graded_and_split_; }
  std::size_t size_of(std::size_t cell) const noexcept { return hexsolver::size_of(cell, sizes_); }  ///< of sizes()
  std::size_t end_of_size(std::size_t size) const noexcept {  ///< behind its last cell
    return hexsolver::end_of_size(size, num_cells(), sizes_);
  }
  const Mat3& edges(std::size_t cell) const noexcept { return sizes_[size_of(cell)].edges; }

  /// f(free node, weight) for what the corner of a cell is made of: itself, or what it hangs on.
  template <class F>
  void for_each_free(std::size_t cell, std::size_t corner, F&& f) const {
    for_each_free(node(cell, corner), f);
  }
  template <class F>
  void for_each_free(std::size_t node, F&& f) const {  ///< likewise of a node
    if (node < num_nodes())
      f(static_cast<std::int32_t>(node), 1.0);
    else
      for_each_support(node - num_nodes(), f);
  }

  /// f(number of a hanging node, free node, weight) for all that nodes hang on.
  template <class F>
  void for_each_support(F&& f) const {
    for (std::size_t h = 0; h < num_hanging(); ++h)
      for_each_support(h, [&](std::int32_t n, double weight) { f(h, n, weight); });
  }

  /// all = the field at all nodes
  template <class Scalar>
  void spread(const Eigen::Matrix<Scalar, Eigen::Dynamic, 1>& free,
              Eigen::Matrix<Scalar, Eigen::Dynamic, 1>& all) const {
    all.resize(3 * static_cast<Eigen::Index>(num_all_nodes()));
    all.head(free.size()) = free;
    for (std::size_t h = 0; h < num_hanging(); ++h) all.template segment<3>(free.size() + 3 * h) = hanging(h, free);
  }

  /// Forces on hanging nodes go to those they hang on, which come first.
  template <class Scalar>
  void pass_on(Eigen::Matrix<Scalar, Eigen::Dynamic, 1>& forces) const {
    for_each_support([&](std::size_t h, std::int32_t n, double weight) {
      forces.template segment<3>(3 * Eigen::Index{n}) +=
          static_cast<Scalar>(weight) * forces.template segment<3>(3 * static_cast<Eigen::Index>(num_nodes() + h));
    });
  }

  /// Forces on all nodes become those on the free ones.
  template <class Scalar>
  void collect(Eigen::Matrix<Scalar, Eigen::Dynamic, 1>& forces) const {
    if (num_hanging() == 0) return;  // a resize to the size it has reallocates
    pass_on(forces);
    forces.conservativeResize(static_cast<Eigen::Index>(num_dofs()));
  }

  /// Blocks of the diagonal of a stiffness at all nodes become nearly those at the free ones: what couples a node with
  /// those that hang on it is left out.
  void collect_blocks(std::vector<Mat3>& blocks) const {
    for_each_support([&](std::size_t h, std::int32_t n, double weight) {
      blocks[hexmesh::as_size(n)] += weight * weight * blocks[num_nodes() + h];
    });
    blocks.resize(num_nodes());
  }

  /// Rest position of a node [mm].
  Vec3 position(std::size_t node) const {
    return corner_ + edges() * Vec3(nodes()[node][0], nodes()[node][1], nodes()[node][2]);
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

  static constexpr std::size_t batch_size = 8;
  /// Cells next to each other in one layer, at most eight.
  struct Batch {
    std::size_t first = 0, count = 0;
    std::size_t end() const noexcept { return first + count; }
    /// Of eight cells in at most two rows: how many are in the first; else 0.
    int split = 0;
    /// Then the node 2 r of a lane in the first row is rows[0][r] + lane, in the second rows[1][r] + lane, and 2 r + 1
    /// the one after it. The nodes of all eight lanes of each row may be added to: no other batch has them at once.
    std::array<std::array<std::int32_t, 4>, 2> rows{};
    bool is_row() const noexcept { return split == batch_size; }
  };
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

  /// @param x  of the free nodes or of all
  template <class Scalar>
  Eigen::Matrix<Scalar, 24, 1> gather(std::size_t cell, const Eigen::Matrix<Scalar, Eigen::Dynamic, 1>& x) const {
    Eigen::Matrix<Scalar, 24, 1> v;
    for (int a = 0; a < 8; ++a) {
      const std::size_t n = node(cell, a);
      v.template segment<3>(3 * a) =
          3 * static_cast<Eigen::Index>(n) < x.size() ? x.template segment<3>(3 * n) : hanging(n - num_nodes(), x);
    }
    return v;
  }

  /// The value of a field at a point of a cell: sum_a w_a u_a; as gather().
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

  double diameter() const;  ///< of the box of the cells, from the lattice's corner on [mm]

  std::size_t bytes() const;  ///< of memory

private:
  /// f(free node, weight) for those that a hanging node hangs on.
  template <class F>
  void for_each_support(std::size_t hanging, F&& f) const {
    for (std::int32_t e = hanging_begin_[hanging]; e < hanging_begin_[hanging + 1]; ++e)
      f(support_nodes_[static_cast<std::size_t>(e)], support_weights_[static_cast<std::size_t>(e)]);
  }
  /// A field at a hanging node.
  template <class Scalar>
  Eigen::Matrix<Scalar, 3, 1> hanging(std::size_t number, const Eigen::Matrix<Scalar, Eigen::Dynamic, 1>& x) const {
    Eigen::Matrix<Scalar, 3, 1> sum = Eigen::Matrix<Scalar, 3, 1>::Zero();
    for_each_support(number, [&](std::int32_t n, double weight) {
      sum += static_cast<Scalar>(weight) * x.template segment<3>(3 * Eigen::Index{n});
    });
    return sum;
  }
  void cut_into_batches();
  void set_hanging(const std::vector<HangingNode>& hanging);

  /// f(begin, end) for the cells of each layer, in parallel: every second layer, then those between.
  template <class F>
  void for_each_slab(F&& f) const {
    for (std::size_t size = 0; size < sizes_.size(); ++size)
      for (std::size_t color = 0; color < 2; ++color) {
#pragma omp parallel for schedule(dynamic) if (num_cells() >= worth_threads)
        for (std::size_t s = slabs_of_size_[size] + color; s < slabs_of_size_[size + 1]; s += 2)
          f(slabs_[s].first, slabs_[s].second);
      }
  }
  /// Numbers of nodes, from one to another, that no slab but one has among those that are walked at once.
  using NodeRange = std::pair<std::int32_t, std::int32_t>;
  std::vector<NodeRange> nodes_of_slabs() const;
  Batch make_batch(std::size_t first, std::size_t count, const NodeRange& of_slab) const;

  std::vector<Index3> cells_;
  hexmesh::NodeNumbering numbering_;
  std::vector<CellsOfSize> sizes_;
  Vec3 corner_;
  std::vector<std::int32_t> hanging_begin_, support_nodes_;  ///< rows of what each hanging node hangs on
  std::vector<double> support_weights_;
  std::vector<Batch> batches_;
  std::vector<std::int32_t> batch_of_;                      ///< cell
  std::vector<std::pair<std::size_t, std::size_t>> slabs_;  ///< ranges of cells, one layer k each, gaps kept empty
  std::vector<std::size_t> slabs_of_size_;                  ///< the first of each size, and one behind the last
  bool is_graded_and_split_ = false;
};

/// Products of matrices of cells, whose vectors are of all nodes, with vectors of the free ones.
template <class Vector>
struct OfAllNodes {
  Vector all, product;  ///< space

  /// y = C^T M C x, C = spread: multiply(from, to) is M, which may write to each entry.
  template <class Multiply>
  void apply(const Mesh& mesh, const Vector& x, Vector& y, const Multiply& multiply) {
    if (mesh.num_hanging() == 0) {
      multiply(x, y);
      return;
    }
    mesh.spread(x, all);
    multiply(all, product);
    mesh.pass_on(product);
    y = product.head(x.size());
  }
};

}  // namespace hexsolver
