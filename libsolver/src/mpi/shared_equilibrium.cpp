// SPDX-License-Identifier: Apache-2.0
#include "hexsolver/shared_equilibrium.h"

#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>

#include "../conclude.h"
#include "../error_estimator.h"
#include "../level_problem.h"
#include "../load_steps.h"
#include "../stopwatch.h"
#include "shared_newton.h"

namespace hexsolver::mpi {
namespace {

using hexmesh::Error;
using hexmesh::ErrorKind;
using hexmesh::Lattice;

/// A level and the best state found on it.
struct Solved {
  std::unique_ptr<SharedLevel> level;
  OwnedVec u, remaining;
  double load_fraction = 0;
  NewtonReport newton;
};

/// Newton with automatic load cut-back, from `state.u` if it has a start.
void solve_with_cutback(Solved& state, const NewtonOptions& options, bool has_start, const SolveProgress& progress) {
  SharedLevel& level = *state.level;
  LoadSteps steps(largest_turning_step(level.scene()), has_start);
  OwnedVec good = level.make_vector();
  state.remaining = level.make_vector();
  for (bool goes_on = true; goes_on;) {
    const double target = steps.target();
    OwnedVec trial = level.make_vector();
    check(VecCopy(steps.from_start() ? state.u : good, trial));
    level.set_progress({target});
    NewtonReport report =
        minimize(level, options, trial, state.remaining, [&](int iteration, double residual, int linear) {
          if (progress) progress(level.level(), target, iteration, residual, linear);
        });
    if (report.converged) good = std::move(trial);
    goes_on = steps.add(std::move(report));
  }
  state.u = std::move(good);
  state.load_fraction = steps.reached();
  state.newton = std::move(steps).total();
}

/// From the coarsest level to the mechanical one, each from the one before.
class NestedIteration {
public:
  NestedIteration(const Processes& all, const hexmesh::LatticeReader& file, const Lattice& outline, const Scene& scene,
                  SolveReport& report, const SolveProgress& progress)
      : all_(all),
        file_(file),
        outline_(outline),
        scene_(scene),
        coarse_scene_(for_coarser_levels(scene)),
        report_(report),
        progress_(progress) {}

  Solved run() {
    std::vector<std::size_t> num_cells;
    int finest = 0;
    all_.all_or_none([&] {
      for (int n = 0; n < static_cast<int>(outline_.levels.size()); ++n) num_cells.push_back(file_.num_cells(n));
      finest = finest_level(scene_, num_cells);
    });
    const Stopwatch set_up;
    auto mechanical = std::make_unique<SharedLevel>(all_, file_, outline_, scene_, finest);
    all_.all_or_none([&] { warn_of_conflicts(*mechanical); });
    report_.setup_seconds = set_up.seconds();
    const Stopwatch solve;
    Solved best;
    for (int number = first_nested_level(num_cells, finest); number >= finest; --number) {
      const Stopwatch watch;
      Solved next;
      try {
        next.level = number == finest ? std::move(mechanical)
                                      : std::make_unique<SharedLevel>(all_, file_, outline_, coarse_scene_, number);
      } catch (const SharedError& e) {
        if (e.kind() != ErrorKind::geometry) throw;
        best = {};  // a coarser level that cannot be set up is no start for the next
        continue;
      }
      solve_level(next, best, number == finest);
      add_report(next, best, watch.seconds());
      best = std::move(next);
    }
    report_.solve_seconds = solve.seconds();
    report_.converged = best.newton.converged;
    report_.reason = best.newton.reason;
    report_.load_fraction = best.load_fraction;
    report_.relative_residual = best.newton.relative_residual;
    return best;
  }

private:
  void warn_of_conflicts(const SharedLevel& level) {
    const std::vector<std::string> warnings = check_conflicts(level.constraints().local(), level.level(), scene_);
    report_.warnings.insert(report_.warnings.end(), warnings.begin(), warnings.end());
  }

  void solve_level(Solved& next, const Solved& coarser, bool is_finest) {
    const bool has_start = coarser.level && coarser.newton.converged;
    next.u = next.level->make_vector();
    start_ = next.level->make_vector();
    if (has_start) {
      const auto merge = outline_.levels[static_cast<std::size_t>(coarser.level->level())].merge;
      next.level->prolongate(*coarser.level, merge, coarser.u, next.u);
      check(VecCopy(next.u, start_));
    }
    NewtonOptions options;
    options.tolerance = is_finest ? scene_.tolerance : std::max(scene_.tolerance, nested_tolerance);
    solve_with_cutback(next, options, has_start, progress_);
  }

  void add_report(const Solved& now, const Solved& coarser, double seconds) {
    report_.levels.push_back({now.level->level(),
                              now.level->num_cells(),
                              static_cast<std::size_t>(now.level->nodes().num_all()),
                              seconds,
                              now.newton,
                              {}});
    if (now.newton.converged)
      report_.levels.back().error.algebraic_mm = now.level->size_in_material(now.remaining).mean;
    std::optional<ElasticCells::Size> difference;
    if (coarser.level && coarser.newton.converged && now.newton.converged) {
      check(VecAYPX(start_, -1, now.u));
      difference = now.level->size_in_material(start_);
    }
    estimator_.add(difference, report_.levels);
    for (Effect& e : report_.effects)
      if (e.name == error_estimate_name && difference) e.active = true;
  }

  const Processes& all_;
  const hexmesh::LatticeReader& file_;
  const Lattice& outline_;
  const Scene& scene_;
  Scene coarse_scene_;
  SolveReport& report_;
  const SolveProgress& progress_;
  ErrorEstimator estimator_;
  OwnedVec start_;  ///< the coarser solution on the level being solved
};

void report_state(const Solved& solved, const Scene& scene, SolveReport& report) {
  const SharedLevel& level = *solved.level;
  const SharedConstraints& held = level.constraints();
  report.strain_energy_n_mm = level.strain_energy(solved.u);
  report.forces = level.forces();
  const OwnedVec gradient = level.make_vector();
  level.gradient(solved.u, gradient);
  report_constraints(held.local(), scene, held.values_of(solved.u), held.values_of(gradient), report);
  if (report.converged)
    if (const std::string limit = level.limit_reached(solved.u); !limit.empty()) report.warnings.push_back(limit);
}

std::vector<hexmesh::ConditionPoints> condition_points(const SharedConstraints& held, const Scene& scene, Vec field) {
  const NodeVector u = held.values_of(field);
  std::vector<hexmesh::ConditionPoints> out;
  for (const Condition& c : scene.conditions) out.push_back({c.name, {}, {}, c.axes});
  add_condition_points(held.local(), held.mesh(), u, out);
  return out;
}

double peak_memory_mb() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024;
}

}  // namespace

Run::Run(const std::vector<std::string>& petsc_options) : petsc_options_(petsc_options) {
  std::vector<std::string> words = {"hexsolve-mpi"};
  words.insert(words.end(), petsc_options.begin(), petsc_options.end());
  std::vector<char*> pointers;
  for (std::string& word : words) pointers.push_back(word.data());
  pointers.push_back(nullptr);
  int count = static_cast<int>(words.size());
  char** values = pointers.data();
  check(PetscInitialize(&count, &values, nullptr, nullptr));
  set_default_options();
}

Run::~Run() { PetscFinalize(); }

std::vector<std::string> Run::unused_options() const {
  PetscInt count = 0;
  char **names = nullptr, **values = nullptr;
  check(PetscOptionsLeftGet(nullptr, &count, &names, &values));
  std::vector<std::string> out;
  for (PetscInt n = 0; n < count; ++n)
    if (const std::string name = std::string("-") + names[n];
        std::find(petsc_options_.begin(), petsc_options_.end(), name) != petsc_options_.end())
      out.push_back(name);
  check(PetscOptionsLeftRestore(nullptr, &count, &names, &values));
  return out;
}

bool Run::is_first() const { return Processes(PETSC_COMM_WORLD).is_first(); }

void Run::abort(int code) const {
  MPI_Abort(PETSC_COMM_WORLD, code);
  std::abort();
}

void Run::on_first(const std::function<void()>& f) const {
  const Processes all(PETSC_COMM_WORLD);
  all.all_or_none([&] {
    if (all.is_first()) f();
  });
}

std::string Run::of_first(const std::string& text) const { return Processes(PETSC_COMM_WORLD).of_first(text); }

void check_is_shareable(const Scene& scene) {
  const auto refuse = [](const std::string& what) {
    throw Error(ErrorKind::input, what +
                                      " is not for several processes, expected an equilibrium of a level without it "
                                      "(or hexsolve)");
  };
  if (scene.dynamics) refuse("solve.kind = \"dynamics\"");
  if (scene.finds_strain) refuse("solve.strain = \"auto\"");
  if (scene.accuracy) refuse("solve.accuracy_mm");
  if (scene.budget) refuse("solve.budget_s");
  if (scene.islands != Islands::error) refuse("solve.islands other than \"error\"");
  if (!scene.contacts.empty()) refuse("[[contact]]");
}

void solve_equilibrium(const Run&, const std::filesystem::path& lattice, const Scene& scene,
                       const std::filesystem::path& result, SolveReport& report, std::vector<ProcessReport>& processes,
                       const std::function<void(hexmesh::Result&)>& finish, const SolveProgress& progress) {
  const Processes all(PETSC_COMM_WORLD);
  std::unique_ptr<hexmesh::LatticeReader> file;
  std::optional<Lattice> outline;
  all.all_or_none([&] {
    file = std::make_unique<hexmesh::LatticeReader>(lattice);
    outline = with_overrides(file->outline(), scene);
    report.warnings = check_single_points(scene);
  });
  report.effects = list_effects(scene);
  report.elasticity = scene.elasticity;
  const Solved solved = NestedIteration(all, *file, *outline, scene, report, progress).run();
  solved.level->set_progress({solved.load_fraction});
  report_state(solved, scene, report);
  const hexmesh::ResultRows rows = solved.level->result_rows(solved.u, report);

  ProcessReport own = solved.level->holding();
  own.peak_memory_mb = peak_memory_mb();
  processes = all.gather(std::vector<ProcessReport>{own});
  hexmesh::Result common{outline->voxels, {}, {}};
  common.level = solved.level->level();
  common.voxels_per_cell = outline->levels[static_cast<std::size_t>(common.level)].voxels_per_cell;
  for (const auto& [name, values] : rows.part.cell_fields) common.cell_fields[name];
  common.conditions = condition_points(solved.level->constraints(), scene, solved.u);
  common.history = outline->history;
  const std::size_t num_points = all.sum(rows.part.surface_displacement.size());
  all.all_or_none([&] {
    if (!all.is_first()) return;
    finish(common);
    hexmesh::begin_result(common, lattice, solved.level->num_cells(),
                          static_cast<std::size_t>(solved.level->nodes().num_all()), num_points, result);
  });
  all.in_turn([&] { hexmesh::write_result_rows(rows, result); });
}

}  // namespace hexsolver::mpi
