// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/format.h>

#include <concepts>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "equilibrium/error_estimator.h"
#include "equilibrium/load_steps.h"
#include "hexsolver/equilibrium/equilibrium.h"
#include "match/matching.h"

namespace hexsolver {

/// The solution of a coarser level that another one starts from.
template <class Level>
struct CoarseStart {
  const Level* level = nullptr;
  const typename Level::Vector* u = nullptr;
  std::optional<double> rotating_above;  ///< cells rotate only where their parents do by more [rad]; nothing: all
};

/// How many cells of a level rotate; nothing where all do.
using RotatingCells = std::optional<std::size_t>;

/// One level under a scene, on one process or on many. Members are called by all processes at once.
template <class Level>
concept EquilibriumLevel = requires(Level level, const Level& other, typename Level::Vector& u, const Scene& scene,
                                    const CoarseStart<Level>* start, NewtonOptions options, NewtonProgress progress) {
  { other.level() } -> std::same_as<int>;
  { other.level_of_largest() } -> std::same_as<int>;  ///< of its cells
  { other.num_cells() } -> std::same_as<std::size_t>;
  { other.num_nodes() } -> std::same_as<std::size_t>;
  { other.diameter() } -> std::same_as<double>;  ///< of the box of the body [mm]
  /// Warnings. @throws Error{geometry} of incompatible conditions and of obstacles deep inside the body
  { other.check(scene) } -> std::same_as<std::vector<std::string>>;
  /// Form the elements; with a start u = that, prolongated. Before this there is no potential.
  { level.build(Elasticity::cauchy, start, u) } -> std::same_as<RotatingCells>;
  { other.make_zero() } -> std::same_as<typename Level::Vector>;
  { other.make_start() } -> std::same_as<typename Level::Vector>;  ///< where load steps begin
  other.prolongate(other, u, u);                                   ///< (coarser level, field there, field here)
  { level.measures(u) } -> std::same_as<LevelMeasures>;
  level.set_progress(Progress{});
  {
    level.attach(u, PullMode{})
    } -> std::same_as<bool>;  ///< find what each match pulls to, and frictions; whether there is any
  { other.round_limits(Aim::look) } -> std::same_as<RoundLimits>;
  { other.gone_through(u) } -> std::same_as<std::optional<std::string>>;  ///< an obstacle through the surface
  level.keep(u);                                                          ///< a load step ends there
  { other.largest_load_step() } -> std::same_as<double>;
  { level.minimize(options, u, progress) } -> std::same_as<NewtonOutcomeOf<typename Level::Vector>>;
  /// Of a field in the material; parts held by springs only where asked.
  { other.size_in_material(u, true) } -> std::same_as<ElasticCells::Size>;
  { other.mean_deformation(u) } -> std::same_as<double>;  ///< of the material, beside the rigid motion next to u [mm]
  /// Of SquaresOfTurns the part of cells that are rotated by an angle at most.
  { other.share_of_turns(0.1, u) } -> std::same_as<double>;
  { other.limit_reached(u, true) } -> std::same_as<std::string>;  ///< see ElasticCells
  /// What balances in u and is not what was asked: an obstacle that went through the surface, a match that is far.
  { other.why_no_solution(u) } -> std::same_as<std::optional<std::string>>;
  other.add_effect_seconds(std::declval<SolveReport&>());
};

/// A level and the best state found on it.
template <class Level>
struct Solved {
  std::unique_ptr<Level> level;
  LoadedState<typename Level::Vector> state;
  std::vector<std::optional<typename Level::Vector>> coarser;  ///< solutions of the levels before, coarse to fine, here

  bool converged() const { return level && state.newton.converged; }
  /// From another state on this level.
  typename Level::Vector change_from(const typename Level::Vector& u) const {
    typename Level::Vector change = level->make_zero();
    set_sum(change, state.u, -1, u);
    return change;
  }
};

/// Why what converged is no solution: it is not what was asked, or what matches pull to moves on.
template <EquilibriumLevel Level>
std::optional<std::string> why_refused(const Solved<Level>& best, const Scene& scene,
                                       std::vector<std::string>& warnings) {
  const double little = scene.matches.empty() ? 1e-3 : 1e-2;
  if (!best.converged()) return {};
  if (auto why = best.level->why_no_solution(best.state.u)) return why;
  constexpr double nothing = 1e-6;
  const double moving = best.state.newton.moving;
  if (moving == 0 || (scene.matches.empty() && moving < nothing)) return {};
  const std::string by = fmt::format("by {:.2g} % of its displacement when rounds end", 100 * moving);
  const std::string what = scene.matches.empty()
                               ? "obstacles do not settle, or nothing stops the body: it still moves " + by
                               : "what matches pull to still moves the body " + by + "; a larger trust_mm pulls less";
  if (moving > little) return what;
  warnings.push_back(what);
  return {};
}

}  // namespace hexsolver
