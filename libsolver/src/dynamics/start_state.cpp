// SPDX-License-Identifier: Apache-2.0
#include "dynamics/start_state.h"

#include <fmt/format.h>

#include "hexmesh/core/error.h"
#include "hexmesh/file/result_file.h"
#include "mesh/points.h"

namespace hexsolver {

StartState read_start_state(const std::filesystem::path& path, const LevelProblem& problem, const OnLevel* on_level) {
  const hexmesh::Lattice& lattice = problem.cells().lattice();
  const hexmesh::Result before = hexmesh::read_result(path);
  const auto fail = [&](const std::string& what) {
    throw hexmesh::Error(hexmesh::ErrorKind::input, fmt::format("dynamics.start is '{}', {}", path.string(), what));
  };
  if (!before.rest_displacement.empty())
    fail("of a lattice under load, expected a result of one at rest (solve.reference = \"rest\")");
  if (before.cell_fields.contains("prestretch_1"))
    fail("of a scene with a [[prestress]], which a motion does not have, expected a result of one without");
  const std::vector<Index3>& cells = lattice.level(problem.level()).cells;
  const std::vector<Index3>& nodes = on_level ? on_level->numbering().nodes : problem.mesh().nodes();
  const auto is_same_place = [&](std::size_t n) {
    const Vec3 place =
        lattice.corner() + lattice.cell_edges(problem.level()) * Vec3(nodes[n][0], nodes[n][1], nodes[n][2]);
    return (before.nodes[n] - place).norm() < 1e-6 * before.voxels.spacing().norm();
  };
  if (before.cells != cells || before.level != problem.level() || !is_same_place(0) ||
      !is_same_place(before.nodes.size() - 1))
    fail(fmt::format("level {} of {} cells, expected a result of this lattice at level {} of {} cells", before.level,
                     before.cells.size(), problem.level(), cells.size()));
  const auto at_mesh = [&](const std::vector<Vec3>& field) -> NodeVector {
    return on_level ? on_level->sampled(to_field(field)) : to_field(field);
  };
  StartState out{at_mesh(before.displacement), {}};
  if (!before.velocity.empty()) out.velocity = at_mesh(before.velocity);
  return out;
}

}  // namespace hexsolver
