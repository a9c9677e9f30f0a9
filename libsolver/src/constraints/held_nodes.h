// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <utility>
#include <vector>

#include "constraints/affine_fit.h"

namespace hexsolver {

/// The nodes that are held in place of the points of a cluster with too many nodes, along one axis: each where the
/// affine fit of the points, and the mean misfit of its own, puts it.
class HeldNodes {
public:
  /// @param mesh     must outlive this
  /// @param members  numbers of the points of the cluster
  HeldNodes(const Mesh& mesh, const std::vector<ConstraintPoint>& points, std::vector<std::size_t> members,
            std::size_t axis);

  const std::vector<std::size_t>& members() const noexcept { return members_; }
  /// Whether some of these are: springs hold what of all is not held here.
  bool is_soft() const noexcept { return is_soft_; }

  /// Add the nodes to those that are held, or the axis to those that are.
  void hold(std::map<std::int32_t, ConstraintPoint>& held) const;

  /// @param number  of each node among `held`
  void find(const std::map<std::int32_t, std::size_t>& number);

  /// Put the nodes where the values of `points` say.
  void prescribe(const std::vector<ConstraintPoint>& points, std::vector<ConstraintPoint>& held) const;

private:
  struct Node {
    std::vector<std::pair<std::size_t, double>> points;  ///< numbers in members_, weights
    double weight = 0;                                   ///< their sum
    std::map<std::int32_t, double> of_condition;
    std::int32_t cell = -1;
    std::size_t held = 0;  ///< number in held()
  };
  const Mesh* mesh_;
  std::vector<std::size_t> members_;
  std::size_t axis_;
  bool is_soft_ = false;
  AffineFit fit_;
  std::vector<std::pair<std::int32_t, Node>> nodes_;
};

}  // namespace hexsolver
