// SPDX-License-Identifier: Apache-2.0
#include "distributed/assembled_matrix.h"

#include <bit>

#include "constraints/support_springs.h"

namespace hexsolver::mpi {
namespace {

/// The direction from corner a of a cell to its corner b as a bit, one of 27.
std::uint32_t direction_between(int a, int b) {
  int direction = 0;
  for (int d = 2; d >= 0; --d) direction = 3 * direction + hexmesh::corner_bit(b, d) - hexmesh::corner_bit(a, d) + 1;
  return std::uint32_t{1} << direction;
}

/// Directions from a node to its neighbours, of the cells around it: bit a of `cells` is the one that the node is
/// corner a of.
std::uint32_t neighbours_of(unsigned cells) {
  std::uint32_t out = 0;
  for (int a = 0; a < 8; ++a)
    if (cells >> a & 1)
      for (int b = 0; b < 8; ++b) out |= direction_between(a, b);
  return out;
}

}  // namespace

AssembledMatrix::AssembledMatrix(const SharedLevel& level) : level_(level) {
  make_room();
  const std::vector<ConstraintPoint>& held = level.held_in_part().held();
  for (std::size_t p = 0; p < held.size(); ++p) points_of_cell_[static_cast<std::size_t>(held[p].cell)].push_back(p);

  // Rigid motions, which algebraic multigrid is to leave alone.
  NodeVector positions(static_cast<Eigen::Index>(level.mesh().num_dofs()));
  for (std::size_t n = 0; n < level.mesh().num_nodes(); ++n)
    positions.segment<3>(3 * static_cast<Eigen::Index>(n)) = level.mesh().position(n);
  const OwnedVec places = level.make_vector();
  level.put_own(positions, places);
  MatNullSpace rigid = nullptr;
  check(MatNullSpaceCreateRigidBody(places, &rigid));
  check(MatSetNearNullSpace(matrix_, rigid));
  check(MatNullSpaceDestroy(&rigid));
}

/// Rows of three for each node, with room for its neighbours.
void AssembledMatrix::make_room() {
  const Mesh& mesh = level_.mesh();
  const SharedNodes& shared_nodes = level_.nodes();
  // Which cells there are around each node: here, and of all processes.
  NodeVector cells = NodeVector::Zero(static_cast<Eigen::Index>(mesh.num_dofs()));
  for (const CellNodes& nodes : mesh.cell_nodes())
    for (std::size_t a = 0; a < 8; ++a) {
      double& around = cells[3 * Eigen::Index{nodes[a]}];
      around = static_cast<unsigned>(around) | 1U << a;  // of several at one index once
    }
  const OwnedVec shared = level_.make_vector();
  level_.copies().add_to(cells, shared);
  NodeVector all_cells;
  level_.copies().get(shared, all_cells);
  // Of neighbours in cells of this process it is known who owns them.
  std::vector<std::uint32_t> own_directions(mesh.num_nodes());
  for (const CellNodes& nodes : mesh.cell_nodes())
    for (std::size_t a = 0; a < 8; ++a)
      for (std::size_t b = 0; b < 8; ++b)
        if (shared_nodes.owns(shared_nodes.numbers()[static_cast<std::size_t>(nodes[b])]))
          own_directions[static_cast<std::size_t>(nodes[a])] |=
              direction_between(static_cast<int>(a), static_cast<int>(b));
  std::vector<PetscInt> here(static_cast<std::size_t>(3 * shared_nodes.num_own())), elsewhere(here.size());
  for (std::size_t n = 0; n < mesh.num_nodes(); ++n) {
    const PetscInt number = shared_nodes.numbers()[n];
    if (!shared_nodes.owns(number)) continue;
    const auto at = 3 * static_cast<Eigen::Index>(n);
    const int neighbours = std::popcount(neighbours_of(static_cast<unsigned>(all_cells[at])));
    const int own = std::popcount(own_directions[n]);
    const bool sees_all = cells[at] == all_cells[at];
    for (PetscInt d = 0; d < 3; ++d) {
      const auto row = static_cast<std::size_t>(3 * (number - shared_nodes.first_own()) + d);
      here[row] = 3 * (sees_all ? own : neighbours);
      elsewhere[row] = 3 * (neighbours - own);
    }
  }
  check(MatCreateAIJ(level_.all().comm(), 3 * shared_nodes.num_own(), 3 * shared_nodes.num_own(), PETSC_DETERMINE,
                     PETSC_DETERMINE, 0, here.data(), 0, elsewhere.data(), matrix_.address()));
  check(MatSetBlockSize(matrix_, 3));
  check(
      MatSetOption(matrix_, MAT_NEW_NONZERO_ALLOCATION_ERR, PETSC_FALSE));  // neighbours at one index are counted once
  check(MatSetOption(matrix_, MAT_SYMMETRIC, PETSC_TRUE));
  check(MatSetOption(matrix_, MAT_SYMMETRY_ETERNAL, PETSC_TRUE));
}

void AssembledMatrix::assemble() {
  const Mesh& mesh = level_.mesh();
  const Potential& potential = level_.potential();
  const HeldDirections& constraints = level_.held_in_part();
  if (!has_weights_)
    support_weights_ = support_weights(constraints, points_of_cell_, mesh.cell_nodes(),
                                       [&](std::size_t cell) { return potential.cell_hessian(cell).trace(); });
  has_weights_ = true;
  check(MatZeroEntries(matrix_));
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
    CellMatrix k = potential.cell_hessian(c);
    if (const auto found = points_of_cell_.find(c); found != points_of_cell_.end())
      for (const std::size_t m : found->second) {
        const ConstraintPoint& p = constraints.held()[m];
        add_spring(p, support_weights_[static_cast<std::size_t>(p.condition)], k);
      }
    std::array<PetscInt, 8> at{};
    for (std::size_t a = 0; a < 8; ++a) at[a] = level_.nodes().numbers()[mesh.node(c, a)];
    check(MatSetValuesBlocked(matrix_, 8, at.data(), 8, at.data(), k.data(), ADD_VALUES));  // symmetric
  }
  check(MatAssemblyBegin(matrix_, MAT_FINAL_ASSEMBLY));
  check(MatAssemblyEnd(matrix_, MAT_FINAL_ASSEMBLY));
}

}  // namespace hexsolver::mpi
