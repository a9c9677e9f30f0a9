// SPDX-License-Identifier: Apache-2.0
#include "distributed/part_constraints.h"

#include "constraints/support_springs.h"

namespace hexsolver::mpi {

PartConstraints::PartConstraints(const Processes& all, const Constraints& whole,
                                 const std::vector<CellNodes>& cell_nodes, std::size_t num_nodes,
                                 std::vector<ConstraintPoint> own, std::vector<Node> nodes,
                                 std::vector<std::int32_t> in_whole)
    : all_(all),
      whole_(whole),
      cell_nodes_(cell_nodes),
      num_values_(3 * static_cast<Eigen::Index>(num_nodes)),
      own_(std::move(own)),
      nodes_(std::move(nodes)),
      in_whole_(std::move(in_whole)) {
  MPI_Comm_split(all.comm(), nodes_.empty() ? MPI_UNDEFINED : 0, all.rank(), &holders_);
}

PartConstraints::~PartConstraints() {
  if (holders_ != MPI_COMM_NULL) MPI_Comm_free(&holders_);
}

template <class Vector>
void PartConstraints::project(Vector& v, Vector& values) const {
  if (holders_ == MPI_COMM_NULL) return;
  values.setZero(num_values_);
  for (const Node& n : nodes_)
    if (n.is_own)
      values.template segment<3>(3 * Eigen::Index{n.of_held}) = v.template segment<3>(3 * Eigen::Index{n.of_part});
  Processes(holders_).add_up(std::span(values.data(), static_cast<std::size_t>(values.size())));
  whole_.project(values);
  for (const Node& n : nodes_)
    v.template segment<3>(3 * Eigen::Index{n.of_part}) = values.template segment<3>(3 * Eigen::Index{n.of_held});
}

void PartConstraints::for_each_held_entry(const std::function<void(Eigen::Index, Eigen::Index, double)>& f) const {
  const auto at = [&](Eigen::Index value) {
    return 3 * Eigen::Index{in_whole_[static_cast<std::size_t>(value / 3)]} + value % 3;
  };
  whole_.for_each_held_entry(
      [&](Eigen::Index row, Eigen::Index column, double value) { f(at(row), at(column), value); });
}

void PartConstraints::complete(std::vector<SupportSprings>& of_conditions) const {
  std::vector<SupportSprings> all;
  for (const ConstraintPoint& p : whole_.held()) {
    const auto condition = static_cast<std::size_t>(p.condition);
    all.resize(std::max(all.size(), condition + 1));
    all[condition].add(p, cell_nodes_[static_cast<std::size_t>(p.cell)], 0);
  }
  of_conditions.resize(all.size());
  for (std::size_t c = 0; c < all.size(); ++c) all[c].raise_stiffness(all_.largest(of_conditions[c].stiffness()));
  of_conditions = std::move(all);
}

}  // namespace hexsolver::mpi
