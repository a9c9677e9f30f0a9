// SPDX-License-Identifier: Apache-2.0
#include "methods.h"

#include <malloc.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <numeric>

#include "experiments.h"
#include "hexmesh/core/memory.h"
#include "hexmesh/tetra/mesh_body.h"
#include "hexsolver/equilibrium/equilibrium.h"
#include "statistics.h"

namespace hextools {

using hexmesh::Vec3;
using hexsolver::Elasticity;
using hexsolver::TetLaw;

namespace {

/// By how much the process grew at most since this was made [MB]; 0 where the system does not tell.
class Memory {
public:
  Memory() {
    malloc_trim(0);
    hexmesh::use_large_pages();
    std::ofstream("/proc/self/clear_refs") << 5;  // forget the peak
    start_ = value("VmRSS:");
  }
  double growth_mb() const { return std::max(0.0, value("VmHWM:") - start_) / 1024; }

private:
  static double value(const std::string& key) {
    std::ifstream status("/proc/self/status");
    for (std::string word; status >> word;)
      if (double kb = 0; word == key && status >> kb) return kb;
    return 0;
  }
  double start_ = 0;
};

/// Nothing: what the scene takes by itself.
std::optional<hexsolver::Stiffness> stiffness_of(Method::Kind kind) {
  switch (kind) {
    case Method::Kind::uniform_cells:
      return hexsolver::Stiffness::uniform;
    case Method::Kind::condensed_cells:
      return hexsolver::Stiffness::condensed;
    case Method::Kind::graded_cells:
      return {};
    default:
      return hexsolver::Stiffness::exact;
  }
}

Outcome run_cells(const Method& method, const Experiment& experiment) {
  Outcome out;
  hexmesh::Lattice lattice = experiment.lattice;
  out.mesh_seconds = seconds_of([&] { lattice = hexmesh::build_levels(std::move(lattice)); });
  hexsolver::Scene scene = experiment.scene;
  scene.elasticity = method.law;
  scene.finds_strain = false;
  scene.error_estimation = hexsolver::ErrorEstimation::off;  // tetrahedra have none
  scene.tolerance = method.tolerance;
  scene.stiffness = stiffness_of(method.kind);
  scene.grading = method.kind == Method::Kind::graded_cells ? hexsolver::Grading::scene : hexsolver::Grading::off;
  if (method.law == Elasticity::green_lagrange) scene.volumetric = hexsolver::Volumetric::full;
  hexsolver::SolveReport report;
  std::shared_ptr<const hexmesh::Result> result;
  const double seconds = seconds_of([&] {
    hexsolver::Outcome outcome = hexsolver::solve_equilibrium(lattice, scene, method.level);
    result = std::make_shared<hexmesh::Result>(std::move(outcome.result));
    report = std::move(outcome.report);
  });
  out.setup_seconds = report.setup_seconds;
  out.solve_seconds = seconds - report.setup_seconds;
  out.converged = report.converged;
  out.reason = report.reason;
  out.elements = report.levels.back().cells;
  out.nodes = report.levels.back().nodes;
  for (const hexsolver::LevelReport& l : report.levels) {
    out.newton_iterations += l.newton.iterations;
    out.linear_iterations += l.newton.linear_iterations;
  }
  out.strain_energy = report.strain_energy_n_mm;
  for (const hexsolver::ConditionReport& c : report.conditions) out.held += c.points;
  out.at = [result](const std::vector<Vec3>& places) { return displacement_at(*result, places); };
  return out;
}

TetLaw tet_law(const Method& method) {
  switch (method.law) {
    case Elasticity::cauchy:
      return TetLaw::cauchy;
    case Elasticity::green_lagrange:
      return TetLaw::green_lagrange;
    default:
      return method.fast ? TetLaw::corotational_qr : TetLaw::corotational;
  }
}

Outcome run_tets(const Method& method, const Experiment& experiment) {
  Outcome out;
  auto mesh = std::make_shared<hexmesh::TetMesh>();
  out.mesh_seconds = seconds_of([&] {
    *mesh = method.mesh ? *method.mesh : mesh_for(experiment, method.size, method.kind != Method::Kind::tets);
    if (method.kind == Method::Kind::quadratic_tets && !mesh->is_quadratic()) *mesh = quadratic(std::move(*mesh));
  });
  hexsolver::TetReport report;
  auto u = std::make_shared<std::vector<Vec3>>();
  const double seconds = seconds_of([&] {
    const auto problem = hexsolver::make_tet_problem(*mesh, experiment.lattice, experiment.scene);
    *u = hexsolver::solve_tets(problem, {tet_law(method), method.solver, method.tolerance}, report);
    out.held = std::accumulate(problem.points.begin(), problem.points.end(), std::size_t{0});
  });
  out.solve_seconds = report.solve_seconds;
  out.setup_seconds = seconds - report.solve_seconds;
  out.converged = report.converged;
  out.reason = report.reason;
  out.elements = mesh->size();
  out.nodes = mesh->points.size();
  out.newton_iterations = report.newton_iterations;
  out.linear_iterations = report.linear_iterations;
  out.strain_energy = report.strain_energy;
  out.tets = mesh;
  out.at = [mesh, u](const std::vector<Vec3>& places) { return displacement_at(*mesh, *u, places); };
  return out;
}

}  // namespace

std::string law_name(Elasticity law) {
  if (law == Elasticity::cauchy) return "cauchy";
  return law == Elasticity::corotational ? "corotational" : "green-lagrange";
}

std::string Method::name() const {
  if (kind == Kind::cells) return "cells";
  if (kind == Kind::condensed_cells) return "cells, condensed";
  if (kind == Kind::graded_cells) return "cells, graded";
  if (kind == Kind::uniform_cells) return "uniform cells";
  std::string name = kind == Kind::quadratic_tets ? "quadratic tetrahedra"
                     : kind == Kind::graded_tets  ? "tetrahedra, graded"
                                                  : "tetrahedra";
  if (!mesh_name.empty()) name = mesh_name;
  if (fast) name += ", QR";
  return name + (solver == hexsolver::TetLinearSolver::cholesky ? ", Cholesky" : ", CG");
}

std::vector<Vec3> displacement_at(const hexmesh::TetMesh& mesh, const std::vector<Vec3>& u,
                                  const std::vector<Vec3>& places) {
  const hexmesh::TetField field(mesh);
  std::vector<Vec3> out;
  for (const Vec3& p : places) out.push_back(field.at(p, u));
  return out;
}

std::vector<Vec3> surface_centers(const hexmesh::Lattice& lattice) {
  std::vector<Vec3> out;
  for (const hexmesh::ExposedFace& f : hexmesh::exposed_faces(lattice))
    out.push_back(lattice.voxels.position(hexmesh::face_index(f)));
  return out;
}

hexsolver::Dynamics paper_dynamics(double duration, int iterations) {
  hexsolver::Dynamics d;
  d.step = 0.02;
  d.duration = duration;
  d.solver = hexsolver::StepSolver::cg;
  d.solver_iterations = iterations;
  d.newton_iterations = 1;
  return d;
}

Outcome run(const Method& method, const Experiment& experiment) {
  const Memory memory;
  Outcome out = method.is_cells() ? run_cells(method, experiment) : run_tets(method, experiment);
  out.dofs = 3 * out.nodes;
  out.memory_mb = memory.growth_mb();
  return out;
}

double filled_volume(const hexmesh::Lattice& lattice) {
  return static_cast<double>(lattice.levels.front().cells.size()) * lattice.voxels.voxel_volume();
}

double size_of_tets(const hexmesh::Lattice& lattice, double count) {
  constexpr double volume_of_one = 0.23;  // of edges 1, as Delaunay refinement leaves them on average
  return std::cbrt(filled_volume(lattice) / (volume_of_one * count));
}

hexmesh::TetMesh mesh_for(const Experiment& experiment, double size, bool graded) {
  hexmesh::TetSizes sizes{size};
  if (graded)
    for (const hexsolver::Condition& c : experiment.scene.conditions)
      for (const hexsolver::Ball& b : c.selection.balls)
        sizes.finer.push_back({b.center, b.radius, hexsolver::size_at_supports(experiment.scene, size)});
  return hexmesh::mesh_body(experiment.lattice, sizes);
}

}  // namespace hextools
