// SPDX-License-Identifier: Apache-2.0
#include "equilibrium/refinement.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "newton/level_equations.h"

namespace hexsolver {
namespace {

/// Of the error, what the cells that are divided tell: of what they tell a part is left.
double told_by_divided(double part_allowed) {
  constexpr double left = 0.4, least = 0.6, most = 0.85;
  return std::clamp((1 - part_allowed) / (1 - left), least, most);
}

/// What forces along a field, as large everywhere in the material, do to the body in a state.
struct Dual {
  NodeVector weights;    ///< z, as it is displaced
  NodeVector reactions;  ///< K z - forces: of its supports
};

Dual solve_dual(LocalLevel& level, const NodeVector& state, const NodeVector& field) {
  constexpr double tolerance = 0.05;  // of weights
  LevelProblem& problem = level.mutable_problem();
  const Mesh& mesh = problem.mesh();
  NodeVector load = NodeVector::Zero(3 * static_cast<Eigen::Index>(mesh.num_all_nodes()));
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
    if (!problem.islands().empty() && problem.islands()[c]) continue;
    const ElementModel& model = problem.elastic().model(c);
    const Vec3 mean = mesh.interpolate(static_cast<std::int32_t>(c), model.mean_shape, field);
    const double size = mean.norm();
    if (!(size > 0)) continue;
    CellVector of_cell;
    for (int a = 0; a < 8; ++a) of_cell.segment<3>(3 * a) = model.volume * model.mean_shape[a] / size * mean;
    mesh.scatter_add(c, of_cell, load);
  }
  mesh.collect(load);
  problem.potential().move_to(state);
  LevelEquations equations(problem.hierarchy(), problem.potential(), problem.constraints());
  equations.linearize(state, Hessian::projected, false);
  Dual out{level.make_zero(), level.make_zero()};
  NodeVector free = load;
  problem.constraints().project(free);
  equations.solve(free, {tolerance}, out.weights);
  equations.apply(out.weights, out.reactions);
  out.reactions -= load;
  NodeVector rest = out.reactions;  // of equations that are not solved to the end
  problem.constraints().project(rest);
  out.reactions -= rest;
  return out;
}

/// What a cell cannot follow of two fields of its children: K = sum L^T K_child L and b = sum L^T K_child v say how
/// near it comes to v, and the energy of the rest is sum v^T K_child v - b^T K^-1 b.
class Remainder {
public:
  void add(const CellMatrix& stiffness, const CellMatrix& in_parent, const std::array<CellVector, 2>& fields) {
    of_parent_ += in_parent.transpose() * stiffness * in_parent;
    for (std::size_t f = 0; f < 2; ++f) {
      const CellVector forces = stiffness * fields[f];
      energies_[f] += fields[f].dot(forces);
      forces_[f] += in_parent.transpose() * forces;
    }
  }

  /// Of each field [N mm], or as it counts.
  std::array<double, 2> energies() const {
    constexpr double rounding = 1e-9;  // K lets rigid motions be, and more where children are few
    const CellMatrix k = of_parent_ + rounding * of_parent_.trace() / 24 * CellMatrix::Identity();
    const Eigen::LDLT<CellMatrix> factor(k);
    std::array<double, 2> out;
    for (std::size_t f = 0; f < 2; ++f)
      out[f] = std::max(0.0, energies_[f] - forces_[f].dot(CellVector(factor.solve(forces_[f]))));
    return out;
  }

private:
  CellMatrix of_parent_ = CellMatrix::Zero();
  std::array<CellVector, 2> forces_ = {CellVector::Zero(), CellVector::Zero()};
  std::array<double, 2> energies_{};
};

/// L: of the nodes of a cell, those of its child in a slot.
CellMatrix interpolation_to(int slot, const Index3& factor) {
  CellMatrix out = CellMatrix::Zero();
  for (int corner = 0; corner < 8; ++corner) {
    const NodeWeights weights = hexmesh::weights_in_parent(slot, corner, factor);
    for (int a = 0; a < 8; ++a) out.block<3, 3>(3 * corner, 3 * a) = weights[a] * Mat3::Identity();
  }
  return out;
}

using Children = std::vector<std::vector<std::size_t>>;

/// By cell, of the two fields. Cells of level 0, which are not divided, follow them.
std::vector<std::array<double, 2>> find_remainders(const LevelProblem& coarse, const LevelProblem& fine,
                                                   const Children& children,
                                                   const std::array<const NodeVector*, 2>& fields) {
  const hexmesh::Lattice& lattice = coarse.cells().lattice();
  std::vector<std::array<double, 2>> out(children.size());
#pragma omp parallel for schedule(dynamic, 16)
  for (std::size_t parent = 0; parent < children.size(); ++parent) {
    const int level = coarse.cells().place(parent).level;
    if (level == 0) continue;
    const Index3& factor = lattice.level(level).merge;
    Remainder remainder;
    for (const std::size_t child : children[parent]) {
      const auto [below, number] = fine.cells().place(child);
      const int slot = hexmesh::slot_in_parent(lattice.level(below).cells[hexmesh::as_size(number)], factor);
      remainder.add(fine.potential().cell_hessian(child), interpolation_to(slot, factor),
                    {fine.mesh().gather(child, *fields[0]), fine.mesh().gather(child, *fields[1])});
    }
    out[parent] = remainder.energies();
  }
  return out;
}

/// By cell, the work of forces on the nodes of its children in a field [N mm], or as it counts.
std::vector<double> find_works(const Mesh& fine, const Children& children, const NodeVector& forces,
                               const NodeVector& field) {
  std::vector<double> sharing(fine.num_nodes());
  const auto for_each_corner = [&](std::size_t cell, auto&& f) {
    for (std::size_t corner = 0; corner < 8; ++corner) fine.for_each_free(cell, corner, f);
  };
  for (std::size_t c = 0; c < fine.num_cells(); ++c)
    for_each_corner(c, [&](std::int32_t n, double weight) { sharing[hexmesh::as_size(n)] += weight; });
  std::vector<double> out;
  for (const std::vector<std::size_t>& of_cell : children) {
    double& work = out.emplace_back();
    for (const std::size_t child : of_cell)
      for_each_corner(child, [&](std::int32_t n, double weight) {
        const Eigen::Index at = 3 * Eigen::Index{n};
        work += weight / sharing[hexmesh::as_size(n)] * forces.segment<3>(at).dot(field.segment<3>(at));
      });
  }
  return out;
}

}  // namespace

std::vector<bool> find_cells_to_divide(const LocalLevel& of, LocalLevel& halved, const NodeVector& u,
                                       const NodeVector& change, const Scene& scene, double part) {
  const LevelProblem& fine = halved.problem();
  const Dual dual = solve_dual(halved, u, change);
  NodeVector reactions, magnitude;
  fine.potential().gradient(u, reactions, magnitude);
  Children children(of.num_cells());
  const std::vector<std::int32_t> parents = holders(fine.cells(), of.problem().cells());
  for (std::size_t c = 0; c < parents.size(); ++c) children[hexmesh::as_size(parents[c])].push_back(c);
  const auto remainders = find_remainders(of.problem(), fine, children, {&change, &dual.weights});
  const auto by_supports = find_works(fine.mesh(), children, dual.reactions, change),
             of_supports = find_works(fine.mesh(), children, reactions, change);
  std::vector<double> of_displacement, of_energy;
  for (std::size_t c = 0; c < children.size(); ++c) {
    const auto [error, weight] = remainders[c];
    const bool stays = of.problem().cells().place(c).level == 0;
    of_displacement.push_back(stays ? 0 : std::sqrt(error * weight) + std::abs(by_supports[c]));
    of_energy.push_back(stays ? 0 : error + std::abs(of_supports[c]));
  }
  std::vector<double> parts(children.size());
  const auto add = [&](const std::vector<double>& of_cells) {
    const double sum = std::accumulate(of_cells.begin(), of_cells.end(), 0.0);
    for (std::size_t c = 0; c < parts.size() && sum > 0; ++c) parts[c] += of_cells[c] / sum;
  };
  if (scene.accuracy) add(of_displacement);
  if (scene.reaction_accuracy) add(of_energy);
  std::vector<std::size_t> order(parts.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return parts[a] > parts[b]; });
  const double enough = told_by_divided(part) * std::accumulate(parts.begin(), parts.end(), 0.0);
  std::vector<bool> divide(parts.size());
  double told = 0;
  for (const std::size_t c : order) {
    if (told >= enough && told > 0) break;
    divide[c] = true;
    told += parts[c];
  }
  return divide;
}

}  // namespace hexsolver
