// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <cmath>
#include <map>

#include "hexsolver/dynamics/motion.h"
#include "measurements.h"

namespace hextools::paper {
namespace {

using hexmesh::Lattice;
using hexmesh::Vec3;
using hexsolver::Elasticity;
using hexsolver::Scene;

int level_with(const Lattice& lattice, double cells) {
  int best = 0;
  const auto off = [&](int level) {
    return std::abs(
        std::log(static_cast<double>(lattice.levels[static_cast<std::size_t>(level)].cells.size()) / cells));
  };
  for (int l = 1; l < static_cast<int>(lattice.levels.size()); ++l)
    if (off(l) < off(best)) best = l;
  return best;
}

double steps_per_second(const Experiment& e, const Method& method) {
  if (method.is_cells()) {
    Scene scene = e.scene;
    scene.dynamics = paper_dynamics(1e4, 10);
    hexsolver::Motion motion(e.lattice, scene, method.level);
    return 1 / seconds_of_one([&] { motion.step(); });
  }
  const auto problem = hexsolver::make_tet_problem(*method.mesh, e.lattice, e.scene);
  hexsolver::TetMotion motion(problem, hexsolver::TetLaw::corotational_qr, 0.02, 10, {});
  return 1 / seconds_of_one([&] { motion.step(); });
}

struct PulledLiver {
  double mean, min, max, deviation, fps;  ///< distances [mm], and steps per second, 0 if none are given
};

// By tetrahedra of the mesh and Poisson's ratio: coarse cells, fine cells, co-rotational tetrahedra, Cauchy tetrahedra.
// clang-format off
const std::map<std::pair<int, double>, std::array<PulledLiver, 4>> pulled_livers = {
    {{929, 0.3}, {{{0.64, 0.05, 2.74, 0.5, 70}, {0.61, 0.07, 1.95, 0.38, 15},
                   {0.29, 0.01, 1.08, 0.29, 40}, {1.96, 0.08, 6.42, 1.55, 0}}}},
    {{6725, 0.3}, {{{0.65, 0.04, 1.84, 0.35, 43}, {0.98, 0.04, 1.7, 0.36, 13},
                    {0.07, 0, 0.27, 0.07, 5}, {2.09, 0.04, 7.4, 1.77, 0}}}},
    {{929, 0.4}, {{{0.8, 0.05, 3.24, 0.73, 70}, {0.66, 0.06, 2.4, 0.49, 15},
                   {0.24, 0.03, 0.77, 0.19, 40}, {1.94, 0.1, 6.36, 1.54, 0}}}},
    {{6725, 0.4}, {{{0.64, 0.04, 1.89, 0.3, 43}, {1.15, 0.04, 2.18, 0.42, 13},
                    {0.01, 0, 0.02, 0, 5}, {2.08, 0.03, 7.12, 1.73, 0}}}}};
// clang-format on

/// The methods of the columns of `pulled_livers`.
std::array<Method, 4> methods_on(const Experiment& e, const hexmesh::TetMesh& mesh) {
  std::array<Method, 4> methods;
  methods[0].level = level_with(e.lattice, 242);
  methods[1].level = level_with(e.lattice, 1346);
  methods[2].kind = methods[3].kind = Method::Kind::tets;
  methods[2].mesh = methods[3].mesh = &mesh;
  methods[3].law = Elasticity::cauchy;
  return methods;
}

/// Rows of one mesh. @param limits  solutions of voxels by law
void add_rows(std::vector<Row>& rows, const Experiment& e, double poisson, int tets,
              const std::map<Elasticity, Outcome>& limits, const hexmesh::TetMesh& mesh) {
  Method on_mesh{Method::Kind::tets, Elasticity::green_lagrange};
  on_mesh.mesh = &mesh;
  const Outcome ansys = run(on_mesh, e);
  const std::vector<Vec3> theirs = ansys.at(mesh.points);
  const std::array<Method, 4> methods = methods_on(e, mesh);
  const std::array<const char*, 4> names = {"coarse cells", "fine cells", "co-rotational tetrahedra",
                                            "Cauchy tetrahedra"};
  for (std::size_t m = 0; m < methods.size(); ++m) {
    const Outcome o = run(methods[m], e);
    const std::vector<Vec3> ours = o.at(mesh.points), limit = limits.at(methods[m].law).at(mesh.points);
    const Distances as_published = distances(ours, theirs), of_limit = distances(limit, theirs);
    const double to_limit = distances(ours, limit).mean;
    const PulledLiver& p = pulled_livers.at({tets, poisson})[m];
    Row row = {{"case", fmt::format("nu {}, {} tetrahedra: {} ({}) [mm]", poisson, mesh.size(), names[m], o.elements)},
               {"paper", p.mean},
               {"ours", ansys.converged ? Row(as_published.mean) : Row()},
               {"reference", ansys.converged ? Row(of_limit.mean) : Row()}};
    row["to_limit_mm"] = to_limit;
    row["ours_min"] = as_published.min;
    row["ours_max"] = as_published.max;
    row["ours_std"] = as_published.deviation;
    row["paper_steps_per_second"] = p.fps > 0 ? Row(p.fps) : Row();
    row["ours_steps_per_second"] = m < 3 ? Row(steps_per_second(e, methods[m])) : Row();
    row["reading"] = fmt::format(
        "{}measured as published, to Green-Lagrange on these tetrahedra; the reference is what the voxels of the "
        "same law give so; to those it is {:.2f} mm",
        !ansys.converged ? "Green-Lagrange has no solution on these tetrahedra; "
        : !o.converged   ? "NOT CONVERGED; "
                         : "",
        to_limit);
    rows.push_back(std::move(row));
  }
}

}  // namespace

std::vector<Row> table2(const Console& console) {
  std::vector<Row> rows;
  for (const double poisson : {0.3, 0.4}) {
    const Experiment e = liver_experiment(poisson);
    std::map<Elasticity, Outcome> limits;
    for (const Elasticity law : {Elasticity::cauchy, Elasticity::corotational})
      limits[law] = run({Method::Kind::cells, law}, e);
    for (const int tets : {929, 6725}) {
      const hexmesh::TetMesh mesh = mesh_for(e, size_of_tets(e.lattice, tets), false);
      add_rows(rows, e, poisson, tets, limits, mesh);
      console.note(fmt::format("table2: nu {}, {} tetrahedra done", poisson, mesh.size()));
    }
  }
  return rows;
}

}  // namespace hextools::paper
