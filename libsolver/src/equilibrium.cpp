// SPDX-License-Identifier: Apache-2.0
#include "hexsolver/equilibrium.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <memory>

#include "hexmesh/core/error.h"
#include "hexmesh/lattice/element_tree.h"
#include "hexmesh/lattice/locator.h"
#include "hexsolver/cell_measures.h"
#include "hexsolver/selection.h"
#include "hexsolver/supports.h"

namespace hexsolver {
namespace {

using hexmesh::Error;
using hexmesh::ErrorKind;
using hexmesh::Lattice;
using hexmesh::Result;

constexpr std::size_t coarsest_nested_cells = 64;
constexpr std::size_t default_most_cells = 20000;
constexpr double smallest_load_step = 1.0 / 64;
/// Coarser levels only provide a start.
constexpr double nested_tolerance = 1e-4;
/// Where points cannot come closer than this part of the largest prescribed displacement, conditions contradict.
constexpr double conflict_fraction = 0.05;

class Stopwatch {
public:
  double seconds() const { return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count(); }

private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

/// A level ready to be solved. Its parts refer to each other: it stays where it was made.
struct Problem {
  Problem(const Problem&) = delete;
  Problem& operator=(const Problem&) = delete;
  Problem(const Lattice& lattice, const Scene& scene, int number)
      : level(number),
        hierarchy(
            Mesh(lattice.levels[static_cast<std::size_t>(number)].cells, lattice.cell_edges(number), lattice.corner()),
            lattice.corner()),
        selector(lattice, number, mesh()),
        constraints(mesh(), select_points(scene, selector)),
        forces(external_forces(scene, lattice, number, mesh(), selector, force_totals)) {}

  const Mesh& mesh() const { return hierarchy.meshes.front(); }

  int level;
  Hierarchy hierarchy;
  Selector selector;
  Constraints constraints;
  std::vector<Vec3> force_totals;  ///< of each [[force]], then of gravity [N]
  NodeVector forces;               ///< on the nodes [N]; empty if there are none
};

std::vector<hexmesh::Element> scene_elements(const Lattice& lattice, const Scene& scene, int level) {
  std::vector<hexmesh::Element> elements = hexmesh::form_elements(lattice, level);
  if (scene.stiffness == Stiffness::uniform)
    for (hexmesh::Element& e : elements) e = hexmesh::spread_evenly(e);
  return elements;
}

Elastic make_elastic(const Lattice& lattice, const Scene& scene, const Problem& problem) {
  const hexmesh::Level& level = lattice.levels[static_cast<std::size_t>(problem.level)];
  const hexmesh::ElementMatrices matrices(lattice.cell_edges(problem.level));
  const std::vector<hexmesh::Element> elements = scene_elements(lattice, scene, problem.level);
  std::vector<ElementModel> models(elements.size());
#pragma omp parallel for schedule(static)
  for (std::size_t e = 0; e < models.size(); ++e)
    models[e] = make_element_model(matrices, elements[e], scene.volumetric);
  return Elastic(problem.mesh(), level.element, std::move(models), scene.strain);
}

double largest_prescribed(const Scene& scene) {
  double largest = 0;
  for (const Condition& c : scene.conditions) largest = std::max(largest, c.by.norm());
  return largest;
}

/// Distance of each condition's worst point from its prescribed place.
std::vector<double> misfits(const Constraints& constraints, const Scene& scene, const NodeVector& u, double fraction) {
  std::vector<double> worst(scene.conditions.size());
  for (const ConstraintPoint& p : constraints.points()) {
    Vec3 miss = fraction * p.value - constraints.displacement(p, u);
    for (int d = 0; d < 3; ++d)
      if (!p.axes[static_cast<std::size_t>(d)]) miss[d] = 0;
    double& w = worst[static_cast<std::size_t>(p.condition)];
    w = std::max(w, miss.norm());
  }
  return worst;
}

void check_supports(const Problem& problem, const Scene& scene) {
  const std::vector<std::string> free = free_motions(problem.mesh(), problem.constraints.points());
  if (!free.empty()) {
    const std::size_t shown = std::min<std::size_t>(free.size(), 3);
    throw Error(ErrorKind::geometry,
                fmt::format("missing supports at level {}: {}{}, expected every part held", problem.level,
                            fmt::join(free.begin(), free.begin() + static_cast<std::ptrdiff_t>(shown), "; "),
                            free.size() > shown ? fmt::format("; and {} more", free.size() - shown) : ""));
  }
  std::vector<double> miss(scene.conditions.size());
  const std::vector<double> of_point = problem.constraints.contradiction();
  for (std::size_t p = 0; p < of_point.size(); ++p) {
    double& worst = miss[static_cast<std::size_t>(problem.constraints.held()[p].condition)];
    worst = std::max(worst, of_point[p]);
  }
  std::vector<std::string> conflicting;
  for (std::size_t c = 0; c < miss.size(); ++c)
    if (miss[c] > conflict_fraction * largest_prescribed(scene))
      conflicting.push_back(
          fmt::format("'{}' ({}, misses by {:.3g} mm)", scene.conditions[c].name, scene.conditions[c].where, miss[c]));
  if (!conflicting.empty())
    throw Error(ErrorKind::geometry,
                fmt::format("conditions contradict each other at level {}: {}, expected displacements that the cells "
                            "can follow (a finer level, or patches farther apart)",
                            problem.level, fmt::join(conflicting, " and ")));
}

/// Newton with automatic load cut-back from u.
NewtonReport solve_level(const Problem& problem, Elastic& elastic, const NewtonOptions& options, bool has_start,
                         NodeVector& u, double& fraction, const SolveProgress& progress) {
  NewtonReport total;
  double reached = 0, step = 1;
  NodeVector good = NodeVector::Zero(u.size());
  while (true) {
    const double target = std::min(1.0, reached + step);
    NodeVector trial = has_start ? u : good;
    NewtonReport report = minimize(problem.hierarchy, elastic, problem.constraints, problem.forces, target, options,
                                   trial, [&](int iteration, double residual, int linear) {
                                     if (progress) progress(problem.level, target, iteration, residual, linear);
                                   });
    total.iterations += report.iterations;
    total.linear_iterations += report.linear_iterations;
    total.relative_residual = report.relative_residual;
    total.reason = report.reason;
    if (report.converged) {
      good = std::move(trial);
      reached = target;
      if (reached == 1) break;
      step = std::min(2 * step, 1 - reached);
    } else if (!has_start) {
      step /= 2;
      if (step < smallest_load_step) break;
    }
    has_start = false;
  }
  total.converged = reached == 1;
  if (!total.converged) total.reason = fmt::format("stopped at {:.3g} of the load: {}", reached, total.reason);
  u = std::move(good);
  fraction = reached;
  return total;
}

std::vector<Vec3> to_points(const NodeVector& u) {
  std::vector<Vec3> out(static_cast<std::size_t>(u.size() / 3));
  for (std::size_t n = 0; n < out.size(); ++n) out[n] = u.segment<3>(3 * static_cast<Eigen::Index>(n));
  return out;
}

Result make_result(const Lattice& lattice, const Scene& scene, const Problem& problem, const Elastic& elastic,
                   const NodeVector& u) {
  const hexmesh::Level& level = lattice.levels[static_cast<std::size_t>(problem.level)];
  const Mesh& mesh = problem.mesh();
  Result r = hexmesh::rest_state(lattice, problem.level);
  r.displacement = to_points(u);

  const double cell_volume = lattice.cell_size(problem.level).prod();
  std::vector<double>& density = r.cell_fields["strain_energy_density"];
  density = elastic.cell_energies(u);
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) density[c] /= level.fill(c) * cell_volume;

  const hexmesh::CellLocator locator(lattice.voxels, level.voxels_per_cell, level.cells);
  for (const Vec3& p : lattice.surface.points) {
    const hexmesh::Embedding e = locator.locate_position(p);
    const NodeWeights weights = hexmesh::shape_functions(e.local);
    Vec3 moved = Vec3::Zero();
    for (int a = 0; a < 8 && e.cell >= 0; ++a)
      moved += weights[a] * r.displacement[static_cast<std::size_t>(
                                mesh.cell_nodes()[static_cast<std::size_t>(e.cell)][static_cast<std::size_t>(a)])];
    r.surface_displacement.push_back(moved);
  }

  for (const Condition& c : scene.conditions) r.conditions.push_back({c.name, {}, {}});
  for (const ConstraintPoint& p : problem.constraints.points()) {
    const CellNodes& nodes = mesh.cell_nodes()[static_cast<std::size_t>(p.cell)];
    Vec3 position = Vec3::Zero();
    for (int a = 0; a < 8; ++a)
      position += p.weights[a] * r.nodes[static_cast<std::size_t>(nodes[static_cast<std::size_t>(a)])];
    auto& condition = r.conditions[static_cast<std::size_t>(p.condition)];
    condition.points.push_back(position);
    condition.displacement.push_back(problem.constraints.displacement(p, u));
  }
  return r;
}

void add_measures(CellMeasures measures, Result& result, SolveReport& report) {
  report.min_jacobian = measures.min_jacobian;
  report.inverted_cells = measures.inverted_cells;
  for (std::size_t d = 0; d < 3; ++d)
    result.cell_fields[fmt::format("principal_stretch_{}", d + 1)] = std::move(measures.principal_stretch[d]);
  result.cell_fields["rotation_degrees"] = std::move(measures.rotation_degrees);
  result.cell_fields["von_mises_stress"] = std::move(measures.von_mises_stress);
}

void report_conditions(const Scene& scene, const Problem& problem, const Elastic& elastic, const NodeVector& u,
                       SolveReport& report) {
  NodeVector gradient, magnitude;
  elastic.gradient(u, gradient, magnitude);
  if (problem.forces.size() > 0) gradient -= report.load_fraction * problem.forces;
  for (std::size_t n = 0; n < problem.force_totals.size(); ++n)
    report.forces.push_back(
        {n < scene.forces.size() ? scene.forces[n].name : "gravity", report.load_fraction * problem.force_totals[n]});
  const std::vector<Vec3> forces = problem.constraints.multipliers(gradient);
  const std::vector<double> miss = misfits(problem.constraints, scene, u, report.load_fraction);
  for (std::size_t c = 0; c < scene.conditions.size(); ++c)
    report.conditions.push_back({scene.conditions[c].name, 0, miss[c], Vec3::Zero()});
  for (const ConstraintPoint& p : problem.constraints.points())
    ++report.conditions[static_cast<std::size_t>(p.condition)].points;
  for (std::size_t p = 0; p < forces.size(); ++p)
    report.conditions[static_cast<std::size_t>(problem.constraints.held()[p].condition)].reaction_n += forces[p];
  report.kept_directions = problem.constraints.num_kept();
  report.constraint_violation_mm = problem.constraints.violation(u, report.load_fraction);
}

}  // namespace

int mechanical_level(const Scene& scene, const Lattice& lattice) {
  const int count = static_cast<int>(lattice.levels.size());
  if (scene.level) {
    if (*scene.level >= count)
      throw Error(ErrorKind::input, fmt::format("solve.level is {}, expected 0 to {}", *scene.level, count - 1));
    return *scene.level;
  }
  for (int level = 0; level < count; ++level)
    if (lattice.levels[static_cast<std::size_t>(level)].cells.size() <= default_most_cells) return level;
  return count - 1;
}

Result solve_equilibrium(const Lattice& lattice, const Scene& scene, int level, SolveReport& report,
                         const SolveProgress& progress) {
  const Stopwatch setup;
  Problem finest(lattice, scene, level);
  check_supports(finest, scene);
  report.setup_seconds = setup.seconds();

  const Stopwatch solve;
  int start = level;
  for (int coarser = level + 1; coarser < static_cast<int>(lattice.levels.size()); ++coarser)
    if (lattice.levels[static_cast<std::size_t>(coarser)].cells.size() >= coarsest_nested_cells) start = coarser;

  // Lattice nodes of a coarser level are other points: there the faces stand for them.
  Scene coarse_scene = scene;
  const auto by_faces = [](Selection& s) {
    if (s.on == SurfacePoints::nodes) s.on = SurfacePoints::faces;
  };
  for (Condition& c : coarse_scene.conditions) by_faces(c.selection);
  for (Force& f : coarse_scene.forces) by_faces(f.selection);

  NodeVector u;
  std::unique_ptr<const Problem> previous;
  for (int number = start; number >= level; --number) {
    const Stopwatch watch;
    std::unique_ptr<const Problem> coarse;
    if (number != level) coarse = std::make_unique<const Problem>(lattice, coarse_scene, number);
    const Problem& problem = coarse ? *coarse : finest;
    Elastic elastic = make_elastic(lattice, scene, problem);

    const bool has_start = previous && u.size() > 0;
    if (has_start) {
      const Index3& merge = lattice.levels[static_cast<std::size_t>(previous->level)].merge;
      NodeVector fine;
      Prolongation(problem.mesh(), previous->mesh(), merge).prolongate(u, fine);
      u = std::move(fine);
    } else {
      u = NodeVector::Zero(static_cast<Eigen::Index>(problem.mesh().num_dofs()));
    }
    NewtonOptions options;
    options.tolerance = number == level ? scene.tolerance : std::max(scene.tolerance, nested_tolerance);
    NewtonReport newton = solve_level(problem, elastic, options, has_start, u, report.load_fraction, progress);
    report.levels.push_back({number, problem.mesh().num_cells(), problem.mesh().num_nodes(), watch.seconds(), newton});
    if (number != level) {
      // A coarse level that fails says nothing about the fine one: that starts from rest.
      if (!newton.converged) u.resize(0);
      previous = std::move(coarse);
      continue;
    }
    report.converged = newton.converged;
    report.reason = newton.reason;
    report.relative_residual = newton.relative_residual;
    report.solve_seconds = solve.seconds();
    report.strain_energy_n_mm = elastic.energy(u);
    report_conditions(scene, problem, elastic, u, report);
    Result result = make_result(lattice, scene, problem, elastic, u);
    add_measures(measure_cells(lattice, level, problem.mesh(), scene.strain, u), result, report);
    return result;
  }
  throw std::logic_error("no level was solved");
}

Lattice with_overrides(Lattice lattice, const Scene& scene) {
  if (scene.materials.empty()) return lattice;
  for (const auto& [name, change] : scene.materials) {
    const auto found = std::find_if(lattice.segments.begin(), lattice.segments.end(),
                                    [&, &wanted = name](const auto& s) { return s.segment.name == wanted; });
    if (found == lattice.segments.end() || !found->material)
      throw Error(ErrorKind::input,
                  fmt::format("[material.{}]: the lattice has no such segment with a material", name));
    const auto apply = [&change = change](hexmesh::Material& m) {
      if (change.young_kpa) m.young = *change.young_kpa * 1e-3;
      if (change.poisson) m.poisson = *change.poisson;
      if (change.density_kg_m3) m.density = *change.density_kg_m3 * 1e-12;
    };
    apply(*found->material);
    hexmesh::check_material(*found->material, name);
    for (hexmesh::VoxelMaterial& m : lattice.materials)
      if (m.label == found->segment.label) apply(m.material);
  }
  return lattice;
}

std::string example_scene(const Lattice& lattice) {
  // Extreme points of the surface, each at least three patch radii from those chosen before.
  constexpr double radius = 10;
  struct Place {
    const char* name;
    Vec3 towards;
  };
  const std::array<Place, 8> places = {{{"left end", {1, 0, 0}},
                                        {"right end", {-1, 0, 0}},
                                        {"back", {0, 1, 0}},
                                        {"lower end", {0, 0, -1}},
                                        {"upper end", {0, 0, 1}},
                                        {"front", {0, -1, 0}},
                                        {"lower right", {-1, 0, -1}},
                                        {"upper right", {-1, 0, 1}}}};
  std::vector<std::pair<std::string, Vec3>> chosen;
  const std::vector<hexmesh::ExposedFace> faces = hexmesh::exposed_faces(lattice);
  for (const Place& place : places) {
    const hexmesh::ExposedFace* best = nullptr;
    double most = 0;
    for (const hexmesh::ExposedFace& face : faces) {
      const double along = lattice.voxels.position(hexmesh::face_index(face)).dot(place.towards);
      if (!best || along > most + 1e-9) {
        best = &face;
        most = along;
      }
    }
    const Vec3 point = lattice.voxels.position(hexmesh::face_index(*best));
    const bool apart = std::all_of(chosen.begin(), chosen.end(),
                                   [&](const auto& c) { return (c.second - point).norm() > 3 * radius; });
    if (apart && chosen.size() < 4) chosen.emplace_back(place.name, point);
  }
  if (chosen.size() < 4)
    throw Error(ErrorKind::geometry, fmt::format("the body is too small for four patches of {} mm", radius));

  std::string text =
      "# Three places on the surface held, a fourth pulled by 40 mm: the displacement-driven liver experiment of\n"
      "# Nesme, Faure, Payan, \"Accurate interactive animation of deformable models at arbitrary resolution\" (2010).\n"
      "# Positions are patient LPS in mm. radius_mm = 0 takes the one nearest point, as in the paper.\n"
      "[solve]\nkind = \"equilibrium\"\nstrain = \"corotational\"   # or \"cauchy\"\n"
      "volumetric = \"mean\"        # or \"full\", the paper's\ntolerance = 1e-8\n";
  for (std::size_t n = 1; n < 4; ++n)
    text += fmt::format("\n[[fix]]\nname = \"{}\"\npoint_mm = [{:.3f}, {:.3f}, {:.3f}]\nradius_mm = {:g}\n",
                        chosen[n].first, chosen[n].second[0], chosen[n].second[1], chosen[n].second[2], radius);
  text += fmt::format(
      "\n[[displace]]\nname = \"{}\"\npoint_mm = [{:.3f}, {:.3f}, {:.3f}]\nradius_mm = {:g}\n"
      "by_mm = [0.0, -28.284271, -28.284271]   # 40 mm to the front and down\n",
      chosen[0].first, chosen[0].second[0], chosen[0].second[1], chosen[0].second[2], radius);
  return text;
}

}  // namespace hexsolver
