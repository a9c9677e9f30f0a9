// SPDX-License-Identifier: Apache-2.0
#include "distributed/shared_equilibrium.h"

#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>

#include "constraints/select_points.h"
#include "distributed/shared_equations.h"
#include "distributed/shared_result.h"
#include "equilibrium/nested_iteration.h"
#include "hexmesh/file/lattice_file.h"
#include "level/condition_reports.h"
#include "level/level_problem.h"
#include "level/make_result.h"
#include "match/rigid_alignment.h"
#include "newton/minimize.h"

namespace hexsolver::mpi {
namespace {

using hexmesh::Error;
using hexmesh::ErrorKind;
using hexmesh::Lattice;

/// A level that many processes solve; see the concept EquilibriumLevel.
class DistributedLevel {
public:
  using Vector = OwnedVec;

  DistributedLevel(const Processes& all, const hexmesh::LatticeReader& file, const Lattice& outline, const Scene& scene,
                   int level, const Matchings& matchings)
      : outline_(outline), shared_(all, file, outline, scene, level, matchings) {}

  const SharedLevel& shared() const noexcept { return shared_; }

  int level() const { return shared_.level(); }
  int level_of_largest() const { return level(); }
  std::size_t num_cells() const { return shared_.num_cells(); }
  std::size_t num_nodes() const { return static_cast<std::size_t>(shared_.nodes().num_all()); }
  double diameter() const { return shared_.diameter(); }
  std::vector<std::string> check(const Scene& scene) const {
    std::vector<std::string> warnings;
    shared_.all().all_or_none([&] { warnings = check_conflicts(shared_.constraints().local(), level(), scene); });
    return warnings;
  }
  RotatingCells build(Elasticity elasticity, const CoarseStart<DistributedLevel>* start, OwnedVec& u);
  OwnedVec make_zero() const { return shared_.make_vector(); }
  bool attach(const OwnedVec& u, const PullMode& mode) { return shared_.attach_matches(u, mode); }
  RoundLimits round_limits(Aim /*aim*/) const { return {}; }
  std::optional<std::string> gone_through(const OwnedVec& /*u*/) const { return {}; }
  void keep(const OwnedVec& /*u*/) {}  // what has friction is for one process
  OwnedVec make_start() const {
    OwnedVec start = make_zero();
    shared_.put_own(start_of(shared_.scene(), shared_.mesh()), start);
    return start;
  }
  void set_progress(const Progress& progress) { shared_.set_progress(progress); }
  double largest_load_step() const { return largest_turning_step(shared_.scene()); }
  NewtonOutcomeOf<OwnedVec> minimize(const NewtonOptions& options, OwnedVec& u, const NewtonProgress& progress) {
    SharedEquations equations(shared_);
    equations.set_limits(options.max_linear_iterations, options.interrupt);
    NewtonOutcomeOf<OwnedVec> outcome = hexsolver::minimize(equations, options, u, progress);
    outcome.seconds += equations.seconds();
    return outcome;
  }
  void prolongate(const DistributedLevel& coarser, const OwnedVec& from, OwnedVec& to) const {
    shared_.prolongate(coarser.shared(), outline_.levels[static_cast<std::size_t>(coarser.level())].merge, from, to);
  }
  LevelMeasures measures(const OwnedVec& u) {
    const OwnedVec gradient = shared_.make_vector();
    shared_.gradient(u, gradient);
    const SharedConstraints& held = shared_.constraints();
    return {shared_.strain_energy(u),
            reactions(held.local(), shared_.scene(), held.values_of(u), held.values_of(gradient))};
  }
  ElasticCells::Size size_in_material(const OwnedVec& field, bool /*with_islands*/) const {
    return shared_.size_in_material(field);
  }
  double mean_deformation(const OwnedVec& u) const { return shared_.mean_deformation(u); }
  double share_of_turns(double angle, const OwnedVec& u) const { return shared_.share_of_turns(angle, u); }
  std::string limit_reached(const OwnedVec& u, bool nearly) const { return shared_.limit_reached(u, nearly); }
  std::optional<std::string> why_no_solution(const OwnedVec& u) const {
    return hexsolver::why_missed(shared_.matches(), shared_.part_of(u));
  }
  void add_effect_seconds(SolveReport& report) const { hexsolver::add_effect_seconds(shared_.potential(), report); }

private:
  const Lattice& outline_;
  SharedLevel shared_;
};

RotatingCells DistributedLevel::build(Elasticity elasticity, const CoarseStart<DistributedLevel>* start, OwnedVec& u) {
  if (!start) {
    shared_.build_potential(elasticity, {});
    return {};
  }
  const SharedLevel& coarser = start->level->shared();
  const Index3& merge = outline_.levels[static_cast<std::size_t>(coarser.level())].merge;
  std::vector<bool> rotating;
  RotatingCells num_rotating;
  if (start->rotating_above) {
    rotating = shared_.cells_rotated_by(*start->rotating_above, coarser, merge, *start->u);
    num_rotating = shared_.all().sum(static_cast<std::size_t>(std::count(rotating.begin(), rotating.end(), true)));
  }
  shared_.build_potential(elasticity, std::move(rotating));
  shared_.prolongate(coarser, merge, *start->u, u);
  return num_rotating;
}

void report_state(const SharedLevel& level, const OwnedVec& u, const Scene& scene, SolveReport& report) {
  const SharedConstraints& held = level.constraints();
  report.strain_energy_n_mm = level.strain_energy(u);
  const Arms arms(level.outline(), report.elasticity);
  const std::vector<BalanceReport::Row> loads = level.loads(u, arms);
  report_matches(level.matches(), start_of(scene, level.mesh()), level.part_of(u), report);
  report.pose = scene.pose;
  for (std::size_t n = 0; n < level.num_loads(); ++n)
    report.forces.push_back({n < scene.forces.size() ? scene.forces[n].name : loads[n].name, loads[n].force_n});
  const OwnedVec gradient = level.make_vector();
  level.gradient(u, gradient);
  report_constraints(held.local(), scene, held.mesh(), held.values_of(u), held.values_of(gradient), arms, report);
  report_balance(scene, arms, loads, report);
  if (!level.is_linear() && report.load_fraction > 0)
    warn_of_rounding(level.rounding(), level.inner_forces(u), loads, report.warnings);
  if (report.converged)
    if (const std::string limit = level.limit_reached(u, false); !limit.empty()) report.warnings.push_back(limit);
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
  if (scene.islands != Islands::error) refuse("solve.islands other than \"error\"");
  if (!scene.contacts.empty()) refuse("[[contact]]");
  if (follows(scene)) refuse("[[force]] with follows = true");
  if (scene.loaded) refuse("solve.reference = \"loaded\"");
  if (!scene.prestresses.empty()) refuse("[[prestress]]");
  if (scene.is_graded()) refuse("solve.grading = \"scene\"");
}

SolveReport solve_equilibrium(const Run&, const std::filesystem::path& lattice, const Scene& as_written,
                              const std::filesystem::path& result, std::vector<ProcessReport>& processes,
                              const std::function<void(hexmesh::Result&, const SolveReport&)>& finish,
                              const SolveProgress& progress) {
  const Processes all(PETSC_COMM_WORLD);
  std::unique_ptr<hexmesh::LatticeReader> file;
  std::optional<Lattice> outline;
  Matchings matchings;
  Scene scene = as_written;
  SolveReport report;
  NestedIteration<DistributedLevel>::Levels levels;
  int finest = 0;
  all.all_or_none([&] {
    file = std::make_unique<hexmesh::LatticeReader>(lattice, source_of_elements(scene));
    outline = with_overrides(file->outline(), scene);
    report.warnings = check_single_points(scene);
    check_contrast(*outline);
    if (!scene.matches.empty()) {
      matchings = make_matchings(scene, with_overrides(hexmesh::read_lattice(lattice, {-1}, hexmesh::Elements::formed,
                                                                             hexmesh::Voxels::surface_only),
                                                       scene));
      scene = placed(scene, matchings);
    }
    for (int n = 0; n < static_cast<int>(outline->levels.size()); ++n) levels.num_cells.push_back(file->num_cells(n));
    levels.averages = averages_of(*outline);
    levels.unseen = unseen_by_cycle(*outline);
    finest = finest_level(scene, levels.num_cells);
    check_open_ended(scene, levels.num_cells, finest);
  });
  report.effects = list_effects(scene);
  report.elasticity = scene.elasticity;
  levels.make = [&](int n, const Scene& of_level) {
    return std::make_unique<DistributedLevel>(all, *file, *outline, of_level, n, matchings);
  };
  levels.agree = [&](bool mine) { return all.sum(all.is_first() && mine ? 1.0 : 0.0) > 0; };  // on what the first says
  Solved<DistributedLevel> best = NestedIteration<DistributedLevel>(levels, scene, finest, report, progress).run();
  best.level->set_progress({best.state.load_fraction});
  const SharedLevel& level = best.level->shared();
  const OwnedVec& u = best.state.u;
  report_state(level, u, scene, report);
  const hexmesh::ResultRows rows = result_rows(level, u, report);

  ProcessReport own = level.holding();
  own.peak_memory_mb = peak_memory_mb();
  processes = all.gather(std::vector<ProcessReport>{own});
  hexmesh::Result common{outline->voxels, {}, outline->segments};
  common.level = level.level();
  common.voxels_per_cell = outline->levels[static_cast<std::size_t>(common.level)].voxels_per_cell;
  for (const auto& [name, values] : rows.part.cell_fields) common.cell_fields[name];
  common.conditions = condition_points(level.constraints(), scene, u);
  common.history = outline->history;
  common.parting = outline->parting;
  all.all_or_none([&] {
    if (!all.is_first()) return;
    common.owners = file->owners(common.level);
    finish(common, report);
    hexmesh::begin_result(common, lattice, level.num_cells(), static_cast<std::size_t>(level.nodes().num_all()),
                          result);
  });
  all.in_turn([&] { hexmesh::write_result_rows(rows, result); });
  return report;
}

}  // namespace hexsolver::mpi
