// SPDX-License-Identifier: Apache-2.0
// The least program that solves a lattice for small strain with displaced patches: what hexsolve's costs are held
// against where a scene asks for no more.
//
//   elastic_only LATTICE RESULT {x y z radius dx dy dz}...
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>

#include "constraints/select_points.h"
#include "constraints/supports.h"
#include "hexmesh/core/sha256.h"
#include "hexmesh/file/lattice_file.h"
#include "hexmesh/file/result_file.h"
#include "newton/minimize.h"
#include "selection/selection.h"
#include "terms/cell_measures.h"
#include "terms/make_elastic_cells.h"

using namespace hexsolver;

namespace {

/// One level; its parts refer to each other.
struct Problem {
  Problem(const hexmesh::Lattice& lattice, const Scene& scene, int level)
      : hierarchy(
            Mesh(lattice.levels[static_cast<std::size_t>(level)].cells, lattice.cell_edges(level), lattice.corner()),
            lattice.corner()) {
    Selector selector({lattice, level}, hierarchy.meshes[0]);
    std::vector<ConstraintPoint> points = select_points(scene, selector);
    if (!free_parts(hierarchy.meshes[0], points).empty()) std::exit(4);
    constraints = std::make_unique<const Constraints>(hierarchy.meshes[0], std::move(points));
  }
  void form_cells(const hexmesh::Lattice& lattice, int level) {
    potential = std::make_unique<Potential>(hierarchy.meshes[0]);
    auto cells = make_elastic_cells(hierarchy.meshes[0], {lattice, level}, {.elasticity = Elasticity::cauchy});
    elastic = cells.get();
    potential->add(std::move(cells));
  }
  Hierarchy hierarchy;
  std::unique_ptr<const Constraints> constraints;
  std::unique_ptr<Potential> potential;
  const ElasticCells* elastic = nullptr;
};

std::vector<Vec3> to_points(const NodeVector& u) {
  std::vector<Vec3> out;
  for (Eigen::Index n = 0; n < u.size(); n += 3) out.emplace_back(u.segment<3>(n));
  return out;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 4) return 2;
  Scene scene;
  for (int a = 3; a + 6 < argc; a += 7) {
    const auto number = [&](int n) { return std::atof(argv[a + n]); };
    Condition c;
    c.selection.balls = {{{number(0), number(1), number(2)}, number(3)}};
    c.by = {number(4), number(5), number(6)};
    scene.conditions.push_back(c);
  }
  const hexmesh::Lattice lattice =
      hexmesh::read_lattice(argv[1], {}, hexmesh::Elements::stored, hexmesh::Voxels::left_out);
  int first = 0;
  while (first + 1 < static_cast<int>(lattice.levels.size()) &&
         lattice.levels[static_cast<std::size_t>(first) + 1].cells.size() >= 8)
    ++first;
  std::unique_ptr<Problem> coarser;
  NodeVector u;
  for (int level = first; level >= 0; --level) {
    auto problem = std::make_unique<Problem>(lattice, scene, level);
    problem->form_cells(lattice, level);
    const Mesh& mesh = problem->hierarchy.meshes[0];
    NodeVector start = NodeVector::Zero(static_cast<Eigen::Index>(mesh.num_dofs()));
    if (coarser)
      Prolongation(mesh, coarser->hierarchy.meshes[0],
                   hexmesh::merge_cells(mesh.cells(), lattice.levels[static_cast<std::size_t>(level) + 1].merge))
          .prolongate(u, start);
    u = std::move(start);
    NewtonOptions options;
    options.tolerance = level == 0 ? 1e-8 : 1e-4;
    const NewtonOutcome newton = minimize(problem->hierarchy, *problem->potential, *problem->constraints, options, u);
    if (!newton.converged) return 5;
    problem->elastic->size_in_material(newton.algebraic_error.value());
    coarser = std::move(problem);
  }
  NodeVector gradient, magnitude;
  coarser->potential->gradient(u, gradient, magnitude);
  const std::vector<Vec3> reactions = coarser->constraints->multipliers(gradient);
  hexmesh::Result result = hexmesh::rest_state(lattice, 0);
  hexmesh::Sha256 conditions;
  for (int a = 3; a < argc; ++a) conditions.add(argv[a], std::strlen(argv[a]));
  result.history = {hexmesh::content_checksum(argv[1]), conditions.digits()};
  const NodeVector rest = Eigen::Map<const NodeVector>(result.nodes[0].data(), u.size());
  result.displacement = to_points(u);
  const CellMeasures measures = measure_cells(*coarser->elastic, u);
  for (std::size_t c = 0; c < coarser->elastic->mesh().num_cells(); ++c)
    result.cell_fields["strain_energy_density"].push_back(coarser->elastic->cell_energy(c, u));
  result.cell_fields["von_mises_stress"] = measures.von_mises_stress;
  result.cell_fields["pressure"] = measures.pressure;
  result.cell_fields["smoothed_pressure"] = measures.smoothed_pressure;
  result.cell_fields["rotation_degrees"] = measures.rotation_degrees;
  result.cell_fields["young_modulus"] = measures.young_modulus;
  result.cell_fields["poisson_ratio"] = measures.poisson_ratio;
  for (std::size_t d = 0; d < 3; ++d)
    result.cell_fields["principal_stretch_" + std::to_string(d + 1)] = measures.principal_stretch[d];
  const Mesh& mesh = coarser->hierarchy.meshes[0];
  for (std::size_t c = 0; c < scene.conditions.size(); ++c)
    result.conditions.push_back({"condition " + std::to_string(c), {}, {}});
  for (const ConstraintPoint& p : with_face_centers(coarser->constraints->points())) {
    auto& condition = result.conditions[static_cast<std::size_t>(p.condition)];
    condition.points.push_back(mesh.interpolate(p.cell, p.weights, rest));
    condition.displacement.push_back(coarser->constraints->displacement(p, u));
  }
  hexmesh::write_result(result, argv[2], argv[1]);
  std::printf("%g N mm, %zu reactions\n", coarser->elastic->energy(u), reactions.size());
}
