// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "equilibrium/choose_strain.h"
#include "equilibrium/equilibrium_level.h"
#include "hexmesh/core/error.h"
#include "hexsolver/equilibrium/equilibrium.h"
#include "level/checks.h"
#include "level/coarser_levels.h"
#include "level/make_result.h"

namespace hexsolver {

/// From the coarsest level to the mechanical one, each from the one before. With an accuracy or a budget it ends at the
/// first level that is good enough, or the last that there was time for.
template <EquilibriumLevel Level>
class NestedIteration {
public:
  using Vector = typename Level::Vector;
  /// What levels are made of.
  struct Levels {
    std::vector<std::size_t> num_cells;  ///< of each level of the lattice
    std::vector<Averages> averages;      ///< likewise
    double unseen = 1;                   ///< see unseen_by_cycle()
    /// A level under a scene. @throws Error{geometry} for selections and missing supports
    std::function<std::unique_ptr<Level>(int, const Scene&)> make;
    int finest_there_is = 0;                                           ///< of the levels that make() can make
    bool looks_beyond_graded = false;                                  ///< at cells halved, see cells_beyond()
    std::function<bool(bool)> agree = [](bool mine) { return mine; };  ///< of what all processes decide alike
    const Vector* start = nullptr;                                     ///< of the finest: no coarser one is solved
    std::size_t least_cells = least_compared;                          ///< of a level that keeps an accuracy
    /// Of graded cells: a level with all of them halved; null if there is nothing to halve, or it is not worth while.
    std::function<std::unique_ptr<Level>(const Level&)> halve;
    std::function<std::unique_ptr<Level>(const Level&)> again;  ///< graded cells anew
    std::function<void()> give_way = [] {};  ///< graded cells lead no further to an accuracy: cells alike go on
    /// Where they are graded by the error: one with those halved that most of it comes from.
    /// @param halved, u, change  a level with all cells halved, its solution, and what it differs by
    /// @param part               of the error that may be left
    std::function<std::unique_ptr<Level>(const Level&, Level& halved, const Vector& u, const Vector& change,
                                         double part)>
        refine;
  };

  /// @param report  with the effects of the scene
  NestedIteration(Levels levels, const Scene& scene, int finest, SolveReport& report, const SolveProgress& progress)
      : levels_(std::move(levels)),
        scene_(scene),
        coarse_scene_(for_coarser_levels(scene)),
        first_(levels_.start || has_friction(scene) ? finest : first_nested_level(levels_.num_cells, finest)),
        finest_(finest),
        report_(report),
        progress_(progress),
        estimator_(!scene.is_graded()) {}

  /// @returns the last level that counts
  Solved<Level> run();

private:
  bool estimates_errors() const { return scene_.asks_accuracy() || scene_.error_estimation != ErrorEstimation::off; }
  bool chooses_cells() const {
    return scene_.finds_strain && !turns_ && report_.elasticity == Elasticity::corotational &&
           scene_.rotation == Rotation::polar;
  }
  std::unique_ptr<Level> make(int level) const {
    return levels_.make(level, level == finest_ ? scene_ : coarse_scene_);
  }
  std::size_t num_cells(int level) const { return levels_.num_cells[static_cast<std::size_t>(level)]; }
  bool has_time_for(int next) const;
  bool replaces(const Solved<Level>& next, const Solved<Level>& best);
  bool carries_less(Solved<Level>& last);
  /// @param aim  look: for the error of the level before
  void solve_level(Solved<Level>& next, const Solved<Level>& coarser, Aim aim = Aim::result);
  void sharpen(Solved<Level>& next, NewtonOptions options);
  void carry_on(const Solved<Level>& coarser, Solved<Level>& next);
  void compare(Solved<Level>& next);
  void look_beyond(const Solved<Level>& best);
  template <class Make>
  std::optional<Solved<Level>> look_at(const Make& make, const Solved<Level>& from);
  bool refine_by_error(Solved<Level>& best);
  void add_look(double seconds);
  void find_strain();
  bool is_to_turn(const Solved<Level>& now, bool is_last = false);
  StrainLimits limits_of_strains(int level) const { return {scene_.accuracy, strain_margin(level - finest_)}; }
  void take(const StrainChoice& choice, int level);
  Solved<Level> run_with_rotations();
  LoadProgress progress_of(int level) const;
  LoadedState<Vector> solve(Level& level, const NewtonOptions& options, std::optional<Vector> start, Aim aim) const;
  std::optional<double> algebraic_error(const Solved<Level>& solved) const;
  void add_report(Solved<Level>& now, double seconds);
  void explain_rotation(const std::string& why, std::optional<bool> active);
  double margin() const;
  double part_allowed() const;
  bool is_accurate() const;
  void conclude(const Solved<Level>& best, const std::optional<std::string>& refused);

  Levels levels_;
  const Scene& scene_;
  Scene coarse_scene_;
  int first_, finest_;
  SolveReport& report_;
  const SolveProgress& progress_;
  Stopwatch clock_;
  std::vector<std::string> level_warnings_;  ///< of the last level that counts
  ErrorEstimator estimator_;
  std::size_t told_from_ = 0;        ///< cells of the last that it was told of, also if it forgot them
  bool tells_enough_ = false;        ///< whether these are enough, or the finest that the lattice has
  bool is_sure_ = true;              ///< what it says; of graded cells see refine_by_error()
  std::optional<double> carried_;    ///< part of the load that the last level reached, if it failed
  double angle_without_effect_ = 0;  ///< of cells that need not rotate, with strain = "auto" [rad]
  /// The level that "auto" compared last, which made it leave rotations out.
  struct Compared {
    int level;
    double deformation;  ///< mean [mm]
  };
  std::optional<Compared> compared_;
  bool turns_ = false;  ///< rotations count, as finer levels show, which began without
};

}  // namespace hexsolver
