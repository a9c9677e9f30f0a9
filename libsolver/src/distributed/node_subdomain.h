// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <compare>
#include <vector>

#include "distributed/processes.h"
#include "mesh/subdomain.h"

namespace hexsolver::mpi {

/// What all processes call a node of one level of multigrid. On the finest level its place; on others a corner of a
/// cell: the first, in the order of the whole body, of those that are this node.
struct NodeName {
  std::uint64_t place = 0;  ///< sort_key() of the index in the whole: of the node, or the cell
  std::int32_t number = 0;  ///< among the cells there
  std::int32_t corner = 0;
  auto operator<=>(const NodeName&) const = default;
};

/// The nodes that this process has in common with others, and with whom. Sums over nodes go straight from process to
/// process.
class NodeSubdomain final : public Subdomain {
public:
  /// @param names  of the nodes of this process; distinct. `all` must outlive this
  /// @param low    where its mesh begins in the whole
  NodeSubdomain(const Processes& all, const std::vector<NodeName>& names, const Index3& low);

  void add_up(NodeVector& v) const override;
  void add_up(FloatNodeVector& v) const override;
  void add_up(std::vector<Mat3>& of_nodes) const override;
  double sum(double value) const override { return all_.sum(value); }
  double largest(double value) const override { return all_.largest(value); }
  void sum(std::span<double> values) const override { all_.add_up(values); }
  void sum(std::span<float> values) const override { all_.add_up(values); }

  /// Tell others of shared nodes: f(node, value) for what each other process says of a node.
  /// @param value_of  node -> value
  template <class T, class ValueOf, class F>
  void tell(const ValueOf& value_of, const F& f) const {
    std::vector<std::vector<T>> to(static_cast<std::size_t>(all_.count()));
    for (const Neighbour& n : neighbours_)
      for (const std::int32_t node : n.nodes) to[static_cast<std::size_t>(n.rank)].push_back(value_of(node));
    const std::vector<std::vector<T>> from = all_.exchange(to);
    for (const Neighbour& n : neighbours_)
      for (std::size_t at = 0; at < n.nodes.size(); ++at) f(n.nodes[at], from[static_cast<std::size_t>(n.rank)][at]);
  }

private:
  struct Neighbour {
    int rank;
    std::vector<std::int32_t> nodes;  ///< in the order of their names
  };
  template <class Real>
  struct Space {
    std::vector<Real> own, sent, received;
  };
  template <class Real>
  void add_up(Real* values, std::size_t per_node, Space<Real>& space) const;

  const Processes& all_;
  std::vector<Neighbour> neighbours_;  ///< by rank
  mutable Space<double> doubles_;
  mutable Space<float> floats_;
};

}  // namespace hexsolver::mpi
