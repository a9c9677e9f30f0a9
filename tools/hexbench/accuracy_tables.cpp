// SPDX-License-Identifier: Apache-2.0
#include "accuracy_tables.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <map>

#include "cli/node_values.h"
#include "experiments.h"
#include "hexmesh/core/error.h"
#include "hexmesh/lattice/embedded_points.h"
#include "hexmesh/tetra/tet_file.h"
#include "hexsolver/dynamics/motion.h"
#include "mesh/mesh.h"

namespace hextools {
namespace {

using hexmesh::Error;
using hexmesh::ErrorKind;
using hexmesh::Vec3;
using hexsolver::Elasticity;
using hexsolver::TetLinearSolver;

constexpr double slow_seconds = 2;
constexpr double reference_tolerance = 1e-7;

/// A converged solution at places where others are compared with it.
struct Reference {
  Outcome outcome;
  std::vector<Vec3> all, surface;      ///< nodes, or centres of voxels and of their exposed faces [mm]
  std::vector<Vec3> u_all, u_surface;  ///< [mm]
};

Reference voxel_reference(const Experiment& e, Elasticity law) {
  Method method{Method::Kind::cells, law};
  method.tolerance = reference_tolerance;
  Reference r{run(method, e)};
  r.all = material_points(e.lattice);
  r.surface = surface_centers(e.lattice);
  return r;
}

Reference tet_reference(const Experiment& e, Elasticity law, double size) {
  Method method{Method::Kind::quadratic_tets, law};
  method.size = size;
  method.tolerance = reference_tolerance;
  Reference r{run(method, e)};
  r.all = r.outcome.tets->points;
  const std::vector<bool> on_surface = hexmesh::surface_nodes(*r.outcome.tets);
  for (std::size_t n = 0; n < r.all.size(); ++n)
    if (on_surface[n]) r.surface.push_back(r.all[n]);
  return r;
}

/// Both references of a law, and what is known about them.
struct References {
  std::optional<Reference> voxels, tets;  ///< those that converged
  double law_difference =
      -1;  ///< mean distance to the law of the largest strains, at nodes or voxels; < 0: unknown [mm]
};

/// One method with the times of its runs.
struct Entry {
  Method method;
  std::string error;  ///< why it cannot be run
  Outcome outcome;
  std::vector<double> mesh, setup, solve, total;

  void add_time(const Outcome& o) {
    mesh.push_back(o.mesh_seconds);
    setup.push_back(o.setup_seconds);
    solve.push_back(o.solve_seconds);
    total.push_back(o.total_seconds());
  }
};

class AccuracyBench {
public:
  AccuracyBench(const Experiment& experiment, const AccuracyOptions& options, const Console& console)
      : e_(experiment), o_(options), console_(console) {}

  AccuracyTables run_all() {
    for (const std::string& file : o_.meshes) {
      const hexmesh::InputFile input(file);
      meshes_.push_back(std::make_unique<hexmesh::TetMesh>(hexmesh::read_tetrahedra(input.path())));
    }
    describe();
    for (const std::string& law : o_.laws) find_references(law_named(law));
    find_law_differences();
    for (const std::string& law : o_.laws) add_methods(law_named(law));
    run_entries();
    for (const Entry& entry : entries_) tables_.equilibria.push_back(row(entry));
    if (!o_.iterations.empty()) add_motions();
    return std::move(tables_);
  }

private:
  static Elasticity law_named(const std::string& name) {
    for (const Elasticity law : {Elasticity::cauchy, Elasticity::corotational, Elasticity::green_lagrange})
      if (law_name(law) == name) return law;
    throw Error(ErrorKind::usage, fmt::format("--laws '{}', expected cauchy, corotational or green-lagrange", name));
  }

  void describe() {
    std::size_t cells = e_.lattice.levels.front().cells.size();
    tables_.about = {{"threads", omp_get_max_threads()},
                     {"repeats", o_.repeats},
                     {"voxels", cells},
                     {"voxel_mm", e_.lattice.voxels.spacing().mean()},
                     {"volume_ml", filled_volume(e_.lattice) / 1000},
                     {"references", Row::array()}};
  }

  std::vector<int> levels() const {
    std::vector<int> out;
    for (int l = static_cast<int>(e_.lattice.levels.size()) - 1; l >= 0; --l) {
      const auto cells = static_cast<double>(e_.lattice.levels[static_cast<std::size_t>(l)].cells.size());
      if (cells >= 20 && cells <= o_.most_elements) out.push_back(l);
    }
    return out;
  }

  /// Three times as many tetrahedra from one size to the next.
  std::vector<double> sizes() const {
    std::vector<double> out;
    for (double count = 300; count <= o_.most_elements; count *= 3) out.push_back(size_for(count));
    return out;
  }
  double size_for(double count) const { return size_of_tets(e_.lattice, count); }

  void find_references(Elasticity law) {
    References& r = references_[law];
    const auto note = [&](const char* name, const Reference& reference) {
      const Outcome& o = reference.outcome;
      tables_.about["references"].push_back({{"law", law_name(law)},
                                             {"reference", name},
                                             {"converged", o.converged},
                                             {"reason", o.reason},
                                             {"elements", o.elements},
                                             {"nodes", o.nodes},
                                             {"seconds", o.total_seconds()}});
      console_.note(fmt::format("reference, {}, {}: {} nodes, {:.3g} s{}", law_name(law), name, o.nodes,
                                o.total_seconds(), o.converged ? "" : ", not converged: " + o.reason));
      return o.converged;
    };
    Reference voxels = voxel_reference(e_, law);
    if (note("voxels", voxels)) {
      voxels.u_all = voxels.outcome.at(voxels.all);
      voxels.u_surface = voxels.outcome.at(voxels.surface);
      r.voxels = std::move(voxels);
    }
    Reference tets = tet_reference(e_, law, size_for(o_.reference_tets));
    if (!note("quadratic tetrahedra", tets)) return;
    tets.u_all = tets.outcome.at(tets.all);
    tets.u_surface = tets.outcome.at(tets.surface);
    // How far the reference itself is off: against elements 1.6 times as long.
    Reference coarser = tet_reference(e_, law, size_for(o_.reference_tets / 4));
    Row& about = tables_.about["references"].back();
    if (coarser.outcome.converged)
      about["from_a_quarter_as_many_mm"] = distances(coarser.outcome.at(tets.all), tets.u_all).mean;
    if (r.voxels) about["from_voxels_mm"] = distances(r.voxels->outcome.at(tets.all), tets.u_all).mean;
    r.tets = std::move(tets);
  }

  /// To the law that is exact for the largest strains among those asked.
  void find_law_differences() {
    const auto& [law_of_most, exact] = *references_.rbegin();
    tables_.about["law_difference_to"] = law_name(law_of_most);
    for (auto& [law, r] : references_) {
      if (exact.tets && r.tets)
        r.law_difference = distances(r.tets->u_all, exact.tets->outcome.at(r.tets->all)).mean;
      else if (exact.voxels && r.voxels)
        r.law_difference = distances(r.voxels->u_all, exact.voxels->u_all).mean;
    }
  }

  void add_methods(Elasticity law) {
    for (const double tolerance : o_.tolerances) {
      for (const int level : levels())
        for (const Method::Kind kind : {Method::Kind::cells, Method::Kind::condensed_cells, Method::Kind::graded_cells,
                                        Method::Kind::uniform_cells}) {
          const bool is_condensed = kind == Method::Kind::condensed_cells,
                     is_uniform = kind == Method::Kind::uniform_cells;
          if (level == 0 && (is_uniform || is_condensed)) continue;
          if (is_uniform && tolerance != o_.tolerances.back()) continue;
          if (is_condensed && law == Elasticity::green_lagrange) continue;
          Method m{kind, law};
          m.level = level;
          m.tolerance = tolerance;
          entries_.push_back({m});
        }
      for (const TetLinearSolver solver : {TetLinearSolver::cholesky, TetLinearSolver::conjugate_gradients}) {
        // A direct solution of a linear problem knows no tolerance.
        if (law == Elasticity::cauchy && solver == TetLinearSolver::cholesky && tolerance != o_.tolerances.back())
          continue;
        for (const double size : sizes())
          for (const Method::Kind kind : {Method::Kind::tets, Method::Kind::graded_tets})
            for (const bool fast : {false, true}) {
              if (fast && (law != Elasticity::corotational || kind != Method::Kind::tets)) continue;
              Method m{kind, law, fast};
              m.size = size;
              m.solver = solver;
              m.tolerance = tolerance;
              entries_.push_back({m});
            }
        for (std::size_t n = 0; n < meshes_.size(); ++n) {
          Method m{meshes_[n]->is_quadratic() ? Method::Kind::quadratic_tets : Method::Kind::tets, law};
          m.mesh = meshes_[n].get();
          m.mesh_name = std::filesystem::path(o_.meshes[n]).filename().string();
          m.solver = solver;
          m.tolerance = tolerance;
          entries_.push_back({m});
        }
      }
    }
  }

  void run_entries() {
    for (int pass = 0; pass <= o_.repeats; ++pass)
      for (Entry& entry : entries_) {
        const bool is_slow = pass > 0 && entry.total.front() > slow_seconds;
        if (is_slow || !entry.error.empty()) continue;
        try {
          Outcome outcome = run(entry.method, e_);
          if (pass == 1) entry = {entry.method, {}, std::move(entry.outcome)};  // forget the first run's times
          entry.add_time(outcome);
          if (pass == 0) {
            entry.outcome = std::move(outcome);
            console_.note(fmt::format("{}, {}: {} nodes, {:.3g} s{}", law_name(entry.method.law), entry.method.name(),
                                      entry.outcome.nodes, entry.total.front(),
                                      entry.outcome.converged ? "" : ", " + entry.outcome.reason));
          }
        } catch (const Error& error) {
          if (error.kind() == ErrorKind::usage) throw;
          entry.error = error.what();
        }
      }
  }

  void add_errors(Row& row, const Outcome& outcome, Elasticity law) const {
    const References& r = references_.at(law);
    if (r.tets) {
      add_to(row, "to_tets_mm", distances(outcome.at(r.tets->all), r.tets->u_all));
      add_to(row, "to_tets_surface_mm", distances(outcome.at(r.tets->surface), r.tets->u_surface));
    }
    if (r.voxels) {
      add_to(row, "to_voxels_mm", distances(outcome.at(r.voxels->all), r.voxels->u_all));
      add_to(row, "to_voxels_surface_mm", distances(outcome.at(r.voxels->surface), r.voxels->u_surface));
    }
    if (r.law_difference >= 0) row["law_difference_mm"] = r.law_difference;
  }

  Row row(const Entry& entry) const {
    const Method& m = entry.method;
    const Outcome& o = entry.outcome;
    Row row = {{"method", m.name()}, {"law", law_name(m.law)}, {"tolerance", m.tolerance}};
    row["level"] = m.is_cells() ? Row(m.level) : Row();
    row["size_mm"] = m.mesh ? Row() : Row(m.is_cells() ? e_.lattice.cell_size(m.level).mean() : m.size);
    row["converged"] = o.converged;
    if (!entry.error.empty() || !o.converged) row["reason"] = entry.error.empty() ? o.reason : entry.error;
    if (!entry.error.empty()) return row;
    row["elements"] = o.elements;
    row["nodes"] = o.nodes;
    row["dofs"] = o.dofs;
    row["held"] = o.held;
    row["strain_energy_n_mm"] = o.strain_energy;
    row["newton"] = o.newton_iterations;
    row["linear"] = o.linear_iterations;
    row["mesh_s"] = median(entry.mesh);
    row["setup_s"] = median(entry.setup);
    row["solve_s"] = median(entry.solve);
    row["total_s"] = median(entry.total);
    row["total_s_min"] = *std::min_element(entry.total.begin(), entry.total.end());
    row["total_s_max"] = *std::max_element(entry.total.begin(), entry.total.end());
    row["runs"] = entry.total.size();
    row["memory_mb"] = o.memory_mb;
    if (o.converged) add_errors(row, o, m.law);
    return row;
  }

  /// The scene as a motion: the displacements are reached in the first half, then the body comes to rest.
  hexsolver::Scene as_motion(int iterations) const {
    hexsolver::Scene scene = e_.scene;
    scene.elasticity = Elasticity::corotational;
    scene.finds_strain = false;
    scene.dynamics = paper_dynamics(motion_steps * motion_step, iterations);
    scene.damping = motion_damping;
    for (hexsolver::Condition& c : scene.conditions)
      if (!c.turn) c.history = hexsolver::History{{{0, Vec3::Zero()}, {scene.dynamics->duration / 2, c.by}}};
    return scene;
  }

  bool has_mass() const {
    return std::all_of(e_.lattice.materials.begin(), e_.lattice.materials.end(),
                       [](const auto& m) { return m.material.density > 0; });
  }

  /// Steps per second with a fixed number of iterations, and how far the motion ends from equilibrium.
  void add_motions() {
    if (!has_mass()) {
      console_.warning("no steps per second: a material has no density");
      return;
    }
    constexpr double most_cells = 20000;
    const auto add = [&](Row row, double seconds, const Outcome& outcome) {
      row["steps_per_second"] = motion_steps / seconds;
      add_errors(row, outcome, Elasticity::corotational);
      tables_.motions.push_back(std::move(row));
    };
    for (const int iterations : o_.iterations) {
      for (const int level : levels()) {
        if (static_cast<double>(e_.lattice.levels[static_cast<std::size_t>(level)].cells.size()) > most_cells) continue;
        hexsolver::Motion motion(e_.lattice, as_motion(iterations), level);
        const double seconds = seconds_of([&] {
          for (int n = 0; n < motion_steps; ++n) motion.step();
        });
        Outcome outcome;
        outcome.at = [&](const std::vector<Vec3>& places) {
          const hexmesh::CellLocator locator = motion.locator();
          std::vector<Vec3> u;
          hexmesh::EmbeddedPoints(locator, motion.cell_nodes(), places)
              .interpolate(values_of(motion.displacement()), u);
          return u;
        };
        add({{"method", "cells"},
             {"iterations", iterations},
             {"elements", motion.mesh().num_cells()},
             {"nodes", motion.mesh().num_nodes()}},
            seconds, outcome);
      }
      for (const bool fast : {false, true})
        for (const double size : sizes()) {
          const hexmesh::TetMesh mesh = mesh_for(e_, size, false);
          if (static_cast<double>(mesh.size()) > most_cells / 2) continue;
          const auto problem = hexsolver::make_tet_problem(mesh, e_.lattice, e_.scene);
          hexsolver::TetMotion motion(problem,
                                      fast ? hexsolver::TetLaw::corotational_qr : hexsolver::TetLaw::corotational,
                                      motion_step, iterations, motion_damping);
          const double seconds = seconds_of([&] {
            for (int n = 0; n < motion_steps; ++n) motion.step();
          });
          const std::vector<Vec3> u = motion.displacement();
          Outcome outcome;
          outcome.at = [&](const std::vector<Vec3>& places) { return displacement_at(mesh, u, places); };
          add({{"method", fast ? "tetrahedra, QR" : "tetrahedra"},
               {"iterations", iterations},
               {"elements", mesh.size()},
               {"nodes", mesh.points.size()}},
              seconds, outcome);
        }
    }
  }

  static constexpr int motion_steps = 100;
  static constexpr double motion_step = 0.02;                      // s
  static constexpr hexsolver::Damping motion_damping = {5, 0.01};  // 1/s, s

  const Experiment& e_;
  const AccuracyOptions& o_;
  const Console& console_;
  std::vector<std::unique_ptr<hexmesh::TetMesh>> meshes_;
  std::map<Elasticity, References> references_;
  std::vector<Entry> entries_;
  AccuracyTables tables_;
};

}  // namespace

AccuracyTables bench_accuracy(const Experiment& experiment, const AccuracyOptions& options, const Console& console) {
  return AccuracyBench(experiment, options, console).run_all();
}

}  // namespace hextools
