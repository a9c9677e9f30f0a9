// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "constraints/constraints.h"
#include "distributed/processes.h"

namespace hexsolver::mpi {

/// What is held, as the multigrid of a process's part of the body sees it. The points held are known to all processes;
/// projections are done by those that have nodes of theirs.
class PartConstraints final : public HeldDirections {
public:
  /// A node of the cells that hold points.
  struct Node {
    std::int32_t of_held, of_part;  ///< its numbers
    bool is_own;                    ///< counted by this process
  };

  /// Called by all processes at once; all must outlive this.
  /// @param whole       of all points, on the mesh of the cells that hold them
  /// @param cell_nodes  of that mesh
  /// @param own         points of whole.held() in cells of this process, which are numbered as in its part
  /// @param nodes       that this process has
  /// @param in_whole    numbers of all nodes of that mesh in the one that is solved at once; empty if none is
  PartConstraints(const Processes& all, const Constraints& whole, const std::vector<CellNodes>& cell_nodes,
                  std::size_t num_nodes, std::vector<ConstraintPoint> own, std::vector<Node> nodes,
                  std::vector<std::int32_t> in_whole);
  ~PartConstraints() override;
  PartConstraints(const PartConstraints&) = delete;
  PartConstraints& operator=(const PartConstraints&) = delete;

  const std::vector<ConstraintPoint>& held() const noexcept override { return own_; }
  void project(NodeVector& v) const override { project(v, double_values_); }
  void project(FloatNodeVector& v) const override { project(v, float_values_); }
  void for_each_held_entry(const std::function<void(Eigen::Index, Eigen::Index, double)>& f) const override;
  void complete(std::vector<SupportSprings>& of_conditions) const override;

private:
  template <class Vector>
  void project(Vector& v, Vector& values) const;

  const Processes& all_;
  const Constraints& whole_;
  const std::vector<CellNodes>& cell_nodes_;
  Eigen::Index num_values_;
  std::vector<ConstraintPoint> own_;
  std::vector<Node> nodes_;
  std::vector<std::int32_t> in_whole_;
  MPI_Comm holders_ = MPI_COMM_NULL;  ///< processes that have nodes
  mutable NodeVector double_values_;
  mutable FloatNodeVector float_values_;
};

}  // namespace hexsolver::mpi
