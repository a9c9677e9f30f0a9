// SPDX-License-Identifier: Apache-2.0
#include "hexsolver/equilibrium.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "conclude.h"
#include "error_estimator.h"
#include "hexmesh/core/error.h"
#include "hexsolver/rotation.h"
#include "level_problem.h"
#include "load_steps.h"
#include "stopwatch.h"

namespace hexsolver {
namespace {

using hexmesh::Error;
using hexmesh::ErrorKind;
using hexmesh::Lattice;
using hexmesh::Result;

/// The algebraic error is to be at most this part of the accuracy asked.
constexpr double algebraic_part = 0.1;

/// A level and the best state found on it.
struct Solved {
  std::unique_ptr<LevelProblem> problem;
  NodeVector u;
  double load_fraction = 0;
  NewtonReport newton;
};

/// Newton with automatic load cut-back, from `state.u` if it has a start.
void solve_with_cutback(Solved& state, NewtonOptions options, bool has_start, const SolveProgress& progress) {
  const LevelProblem& problem = *state.problem;
  LoadSteps steps(problem.largest_load_step(), has_start);
  NodeVector good, failed;  // the state reached, empty at rest; one that was not
  for (bool goes_on = true; goes_on;) {
    const double target = steps.target();
    options.estimate_remaining = target == 1;
    NodeVector trial = steps.from_start() ? std::move(state.u) : good;
    if (trial.size() == 0) trial = NodeVector::Zero(static_cast<Eigen::Index>(problem.mesh().num_dofs()));
    state.problem->set_progress({target});
    NewtonReport report = minimize(problem.hierarchy(), state.problem->potential(), problem.constraints(), options,
                                   trial, [&](int iteration, double residual, int linear) {
                                     if (progress) progress(problem.level(), target, iteration, residual, linear);
                                   });
    if (report.converged)
      good = std::move(trial);
    else if (!report.interrupted && !steps.from_start())
      failed = std::move(trial);
    goes_on = steps.add(std::move(report));
  }
  if (good.size() == 0) good = NodeVector::Zero(static_cast<Eigen::Index>(problem.mesh().num_dofs()));
  state.load_fraction = steps.reached();
  state.newton = std::move(steps).total();
  if (!state.newton.converged) {
    for (const NodeVector* state_seen : {&good, &failed}) {
      const std::string limit = state_seen->allFinite() && state_seen->size() == good.size()
                                    ? problem.elastic().limit_reached(*state_seen, true)
                                    : "";
      if (limit.empty()) continue;
      state.newton.reason += "; " + limit;
      break;
    }
  }
  state.u = std::move(good);
}

/// Of the box of a body [mm].
double diameter(const Mesh& mesh) {
  return (mesh.edges().cwiseAbs() * Vec3(hexmesh::extent_of(mesh.cells())[0], hexmesh::extent_of(mesh.cells())[1],
                                         hexmesh::extent_of(mesh.cells())[2]))
      .norm();
}

class NestedIteration {
public:
  NestedIteration(const Lattice& lattice, const Scene& scene, int finest, SolveReport& report,
                  const SolveProgress& progress)
      : lattice_(lattice),
        scene_(scene),
        coarse_scene_(for_coarser_levels(scene)),
        finest_(finest),
        report_(report),
        progress_(progress) {
    report_.effects = list_effects(scene);
    report_.elasticity = scene.elasticity;
  }

  /// @returns the mechanical level
  Solved run() {
    std::unique_ptr<LevelProblem> finest;
    if (!is_open_ended()) {
      const Stopwatch setup;
      finest = std::make_unique<LevelProblem>(lattice_, scene_, finest_);
      level_warnings_ = check_level(*finest, scene_);
      report_.setup_seconds = setup.seconds();
    }
    const Stopwatch solve;
    if (scene_.finds_strain) find_strain();
    Solved best;
    for (int level = first_nested_level(lattice_, finest_); level >= finest_; --level) {
      if (best.problem && !has_time_for(level)) break;
      const Stopwatch watch;
      Solved next;
      std::vector<std::string> warnings;
      try {
        next.problem = level == finest_ && finest
                           ? std::move(finest)
                           : std::make_unique<LevelProblem>(lattice_, level == finest_ ? scene_ : coarse_scene_, level);
        if (is_open_ended()) warnings = check_level(*next.problem, scene_);
      } catch (const Error& e) {
        if (e.kind() != ErrorKind::geometry || (level == finest_ && !best.problem)) throw;
        if (is_open_ended() && best.problem) {
          report_.warnings.push_back(fmt::format("level {} was not solved: {}", level, e.what()));
          break;
        }
        best = {};  // a coarser level that cannot be set up is no start for the next
        continue;
      }
      solve_level(next, best);
      if (best.problem && is_open_ended() && !next.newton.converged && best.newton.converged) {
        report_.warnings.push_back(
            fmt::format("level {} is not used: {}", level,
                        next.newton.interrupted ? "it was begun and the budget ended it" : next.newton.reason));
        break;
      }
      if (is_open_ended()) level_warnings_ = std::move(warnings);
      add_report(next, best, watch.seconds());
      best = std::move(next);
      if (is_accurate()) break;
    }
    report_.solve_seconds = solve.seconds();
    report_.warnings.insert(report_.warnings.end(), level_warnings_.begin(), level_warnings_.end());
    conclude(best);
    return best;
  }

private:
  const hexmesh::Level& level(int number) const { return lattice_.levels[static_cast<std::size_t>(number)]; }
  bool is_open_ended() const { return scene_.accuracy || scene_.budget; }

  /// The next level is expected to cost as much per cell as the last, and a third more.
  bool has_time_for(int next) const {
    if (!scene_.budget) return true;
    const LevelReport& last = report_.levels.back();
    const double growth =
        static_cast<double>(level(next).cells.size()) / static_cast<double>(level(last.level).cells.size());
    return clock_.seconds() + 4.0 / 3 * growth * last.seconds <= *scene_.budget;
  }

  void solve_level(Solved& next, const Solved& coarser) {
    const Mesh& mesh = next.problem->mesh();
    const bool has_start = coarser.problem && coarser.newton.converged;
    hexmesh::Merge merge;
    if (has_start) merge = hexmesh::merge_cells(mesh.cells(), level(coarser.problem->level()).merge);
    next.problem->build_potential(report_.elasticity, turning_cells(*next.problem, coarser, merge));
    if (has_start) Prolongation(mesh, coarser.problem->mesh(), merge).prolongate(coarser.u, next.u);
    merge = {};
    start_ = next.u;

    NewtonOptions options;
    const bool is_only_a_start = next.problem->level() != finest_ && !scene_.budget;
    options.tolerance =
        is_only_a_start || scene_.accuracy ? std::max(scene_.tolerance, nested_tolerance) : scene_.tolerance;
    if (scene_.budget && coarser.problem) options.interrupt = [this] { return clock_.seconds() > *scene_.budget; };
    solve_with_cutback(next, options, has_start, progress_);
    while (scene_.accuracy && next.newton.converged && options.tolerance > scene_.tolerance) {
      const std::optional<double> error = algebraic_error(next);
      if (error && *error <= algebraic_part * *scene_.accuracy) break;
      options.tolerance = std::max(scene_.tolerance, 0.1 * options.tolerance);
      const Solved before{nullptr, next.u, next.load_fraction, next.newton};
      solve_with_cutback(next, options, true, progress_);
      next.newton.iterations += before.newton.iterations;
      next.newton.linear_iterations += before.newton.linear_iterations;
      next.newton.seconds += before.newton.seconds;
      if (next.newton.converged) continue;
      next.u = before.u;
      next.load_fraction = before.load_fraction;
      next.newton = before.newton;
      break;
    }
  }

  void find_strain() {
    try {
      compare_strains();
    } catch (const Error& e) {
      if (e.kind() != ErrorKind::geometry) throw;
      explain_rotation(true, fmt::format("not compared: {}", e.what()));  // a coarse level, which need not be fit
    }
  }

  /// Solve a coarse level with and without rotations and see what they change.
  void compare_strains() {
    constexpr std::size_t most_cells = 2000;
    constexpr double default_part = 0.01;  // of the mean displacement, where no accuracy is asked
    int number = first_nested_level(lattice_, finest_);
    while (number > finest_ && level(number - 1).cells.size() <= most_cells) --number;
    std::array<Solved, 2> with;
    for (const Elasticity elasticity : {Elasticity::cauchy, Elasticity::corotational}) {
      Solved& state = with[elasticity == Elasticity::corotational];
      state.problem = std::make_unique<LevelProblem>(lattice_, number == finest_ ? scene_ : coarse_scene_, number);
      state.problem->build_potential(elasticity);
      NewtonOptions options;
      options.tolerance = nested_tolerance;
      solve_with_cutback(state, options, false, progress_);
    }
    const ElasticCells& cells = with[0].problem->elastic();
    const double change = cells.size_in_material(with[1].u - with[0].u).mean;
    const double allowed = scene_.accuracy.value_or(default_part * cells.size_in_material(with[0].u).mean);
    angle_without_effect_ = std::sqrt(allowed / diameter(with[0].problem->mesh()));
    const bool turns = !with[1].newton.converged || change > allowed;
    report_.elasticity = turns ? Elasticity::corotational : Elasticity::cauchy;
    explain_rotation(turns,
                     fmt::format("on level {} turning cells changes the displacement by {:.2g} mm on average, {} "
                                 "{:.2g} mm",
                                 number, change, turns ? "more than" : "at most", allowed));
  }

  /// A cell that turns by w without being turned takes w^2 / 2 for strain, which over the length of the body moves its
  /// end by w^2 / 2 times that: half of what is allowed, for the largest w that is left out.
  /// @param merge  of the cells of `next` into those of `coarser`
  std::vector<bool> turning_cells(const LevelProblem& next, const Solved& coarser, const hexmesh::Merge& merge) {
    const bool chooses = scene_.finds_strain && report_.elasticity == Elasticity::corotational &&
                         scene_.rotation == Rotation::polar && coarser.problem && coarser.newton.converged;
    if (!chooses) return {};
    std::vector<bool> turning(next.mesh().num_cells());
    for (std::size_t parent = 0; parent < merge.children.size(); ++parent) {
      const Mat3 f = coarser.problem->elastic().mean_gradient(parent, coarser.u);
      const bool turns = rotation_angle(polar_decomposition(f).rotation) > angle_without_effect_;
      for (const std::int32_t child : merge.children[parent])
        if (child >= 0) turning[static_cast<std::size_t>(child)] = turns;
    }
    count_turning(next, turning);
    return turning;
  }

  void count_turning(const LevelProblem& problem, const std::vector<bool>& turning) {
    for (Effect& e : report_.effects)
      if (e.name == "rotation") {
        e.why = e.why.substr(0, e.why.find("; on level"));
        e.why += fmt::format("; on level {} {} of {} cells turn", problem.level(),
                             std::count(turning.begin(), turning.end(), true), turning.size());
      }
  }

  void explain_rotation(bool active, const std::string& why) {
    for (Effect& e : report_.effects)
      if (e.name == "rotation") {
        e.active = active;
        e.why = "solve.strain = \"auto\": " + why;
      }
  }

  static std::optional<double> algebraic_error(const Solved& state) {
    if (state.newton.remaining.size() == 0) return {};
    return state.problem->elastic().size_in_material(state.newton.remaining).mean;
  }

  void add_report(Solved& now, const Solved& coarser, double seconds) {
    const LevelProblem& problem = *now.problem;
    const std::optional<double> algebraic = algebraic_error(now);
    now.newton.remaining.resize(0);
    report_.levels.push_back(
        {problem.level(), problem.mesh().num_cells(), problem.mesh().num_nodes(), seconds, now.newton, {}});
    report_.levels.back().error.algebraic_mm = algebraic;
    std::optional<ElasticCells::Size> difference;
    if (coarser.problem && coarser.newton.converged && now.newton.converged)
      difference = problem.elastic().size_in_material(now.u - start_, problem.islands());
    estimator_.add(difference, report_.levels);
    for (Effect& e : report_.effects)
      if (e.name == error_estimate_name && difference) e.active = true;
    add_effect_seconds(problem, report_);
  }

  bool is_accurate() const {
    if (!scene_.accuracy) return false;
    const LevelReport& last = report_.levels.back();
    return last.newton.converged && last.error.mean_mm && *last.error.mean_mm <= *scene_.accuracy;
  }

  void conclude(const Solved& best) {
    report_.converged = best.newton.converged;
    report_.reason = best.newton.reason;
    for (const PenaltyContact* contact : best.problem->contacts())
      if (report_.converged && contact->state(best.u).is_inside) {
        report_.converged = false;
        report_.reason = fmt::format("the ball of {} went through the surface; a larger stiffness_n_mm holds it off",
                                     contact->name());
      }
    if (report_.converged && scene_.accuracy) {
      const auto& error = report_.levels.back().error.mean_mm;
      report_.accuracy_missed = !is_accurate();
      report_.reason =
          fmt::format("the estimated error of level {} is {}, accuracy_mm = {:g} was asked", best.problem->level(),
                      error ? fmt::format("{:.2g} mm", *error) : "unknown", *scene_.accuracy);
    }
    if (scene_.budget && report_.levels.size() == 1 && clock_.seconds() > *scene_.budget)
      report_.warnings.push_back(fmt::format("budget_s = {:g} is less than the first level takes", *scene_.budget));
  }

  const Lattice& lattice_;
  const Scene& scene_;
  Scene coarse_scene_;
  int finest_;
  SolveReport& report_;
  const SolveProgress& progress_;
  Stopwatch clock_;
  std::vector<std::string> level_warnings_;  ///< of the last level that counts
  ErrorEstimator estimator_;
  double angle_without_effect_ = 0;  ///< of cells that need not turn, with strain = "auto" [rad]
  NodeVector start_;                 ///< the coarser solution on the level being solved
};

}  // namespace

int finest_level(const Scene& scene, const Lattice& lattice) {
  std::vector<std::size_t> num_cells;
  for (const hexmesh::Level& level : lattice.levels) num_cells.push_back(level.cells.size());
  return finest_level(scene, num_cells);
}

int finest_level(const Scene& scene, const std::vector<std::size_t>& num_cells) {
  constexpr std::size_t default_most_cells = 20000;
  const int count = static_cast<int>(num_cells.size());
  if (scene.level) {
    if (*scene.level >= count)
      throw Error(ErrorKind::input, fmt::format("solve.level is {}, expected 0 to {}", *scene.level, count - 1));
    return *scene.level;
  }
  if (scene.accuracy || scene.budget) return 0;
  for (int level = 0; level < count; ++level)
    if (num_cells[static_cast<std::size_t>(level)] <= default_most_cells) return level;
  return count - 1;
}

Result solve_equilibrium(const Lattice& whole, const Scene& scene, int level, SolveReport& report,
                         const SolveProgress& progress) {
  report.warnings = check_single_points(scene);
  check_open_ended(scene, whole, level);
  const std::optional<Lattice> rest = without_islands(whole, scene, level, report.dropped_cells);
  const Lattice& lattice = rest ? *rest : whole;
  if (rest) warn_of_dropped_cells(whole, level, report);
  NestedIteration nested(lattice, scene, level, report, progress);
  const Solved solved = nested.run();
  const LevelProblem& problem = *solved.problem;
  report.load_fraction = solved.load_fraction;
  report.relative_residual = solved.newton.relative_residual;
  solved.problem->set_progress({solved.load_fraction});
  report.bytes = {{"lattice", hexmesh::bytes_of(lattice)},
                  {"meshes", problem.hierarchy().bytes()},
                  {"multigrid", solved.newton.preconditioner_bytes}};
  hexmesh::Result result = conclude(lattice, problem, solved.u, report);
  result.labels = whole.labels;  // with the islands that were left out
  return result;
}

}  // namespace hexsolver
