// SPDX-License-Identifier: Apache-2.0
#include "constraints/held_nodes.h"

#include <algorithm>

#include "constraints/cluster.h"

namespace hexsolver {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

bool is_corner(const Mesh& mesh, std::int32_t cell, std::int32_t node) {
  const CellNodes& corners = mesh.cell_nodes()[static_cast<std::size_t>(cell)];
  return std::find(corners.begin(), corners.end(), node) != corners.end();
}

}  // namespace

HeldNodes::HeldNodes(const Mesh& mesh, const std::vector<ConstraintPoint>& points, std::vector<std::size_t> members,
                     std::size_t axis)
    : mesh_(&mesh), members_(std::move(members)), axis_(axis), fit_(mesh, points, members_) {
  for (const std::size_t p : members_) is_soft_ = is_soft_ || points[p].is_soft;
  std::map<std::int32_t, Node> nodes;
  for (std::size_t n = 0; n < members_.size(); ++n) {
    const ConstraintPoint& p = points[members_[n]];
    for_each_weight(mesh, p, [&](std::int32_t node, double weight) {
      Node& of = nodes[node];
      of.points.emplace_back(n, weight);
      of.weight += weight;
      of.of_condition[p.condition] += weight;
      if (is_corner(mesh, p.cell, node)) of.cell = p.cell;
    });
  }
  const bool some_are_elsewhere =  // what hanging corners of cells of points hang on
      std::any_of(nodes.begin(), nodes.end(), [](const auto& node) { return node.second.cell < 0; });
  for (std::size_t c = 0; c < mesh.num_cells() && some_are_elsewhere; ++c)
    for (const std::int32_t node : mesh.cell_nodes()[c])
      if (const auto found = nodes.find(node); found != nodes.end() && found->second.cell < 0)
        found->second.cell = static_cast<std::int32_t>(c);
  // Of all that each sees, which grows with the size of the cells around it squared, the part that is in the patch.
  std::vector<std::int32_t> numbers;
  for (const auto& [node, of] : nodes) numbers.push_back(node);
  const VectorXd sizes = sizes_around(mesh, numbers);
  std::vector<double> parts;
  for (const auto& [node, of] : nodes) {
    const auto n = static_cast<Index>(parts.size());
    parts.push_back(sizes.size() > 0 ? of.weight / (sizes[n] * sizes[n]) : of.weight);
  }
  const double largest = *std::max_element(parts.begin(), parts.end());
  const double cutoff = is_soft_ ? Constraints::cutoff_of_large_soft_patches : Constraints::cutoff_of_points;
  std::size_t n = 0;
  for (auto& [node, of] : nodes)
    if (parts[n++] >= cutoff * largest) nodes_.emplace_back(node, std::move(of));
}

void HeldNodes::hold(std::map<std::int32_t, ConstraintPoint>& held) const {
  for (const auto& [node, of] : nodes_) {
    ConstraintPoint& point = held.try_emplace(node, ConstraintPoint{0, of.cell, {}, Vec3::Zero(), {}}).first->second;
    const CellNodes& corners = mesh_->cell_nodes()[point.cell];
    point.weights = NodeWeights::Unit(std::find(corners.begin(), corners.end(), node) - corners.begin());
    point.condition = std::max_element(of.of_condition.begin(), of.of_condition.end(), [](auto& a, auto& b) {
                        return a.second < b.second;
                      })->first;
    point.axes[axis_] = true;
  }
}

void HeldNodes::find(const std::map<std::int32_t, std::size_t>& number) {
  for (auto& [node, of] : nodes_) of.held = number.at(node);
}

void HeldNodes::prescribe(const std::vector<ConstraintPoint>& points, std::vector<ConstraintPoint>& held) const {
  const VectorXd values = prescribed(points, members_, axis_);
  const AffineFit::Coefficients affine = fit_.of(values);
  VectorXd misfit = values;
  for (std::size_t n = 0; n < members_.size(); ++n)
    misfit[n] -= fit_.at(mesh_->rest_position(points[members_[n]].cell, points[members_[n]].weights), affine);
  for (const auto& [node, of] : nodes_) {
    double mean = 0;
    for (const auto& [n, weight] : of.points) mean += weight / of.weight * misfit[n];
    held[of.held].value[axis_] = fit_.at(mesh_->position(node), affine) + mean;
  }
}

}  // namespace hexsolver
