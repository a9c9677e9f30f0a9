// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "hexmesh/result/result.h"
#include "hexsolver/equilibrium/equilibrium.h"
#include "hexsolver/report/report.h"

namespace hexsolver {

/// What a scene selects on the finest level it may ask for, found without solving.
struct SceneCheck {
  int level = 0;
  std::vector<ConditionReport> conditions;        ///< points and kept directions
  std::vector<ForceReport> forces;                ///< totals
  std::vector<ContactReport> contacts;            ///< at rest
  std::size_t dropped_cells = 0, held_cells = 0;  ///< parts that nothing holds, as solve.islands allows them
  std::vector<std::string> warnings;
  bool needs_supports = true;  ///< a motion does not
  bool is_carried = false;     ///< nothing but obstacles holds all of the body or parts of it
  /// The body at rest, for pictures: points of conditions with where these move them at the end, and loads.
  /// Nothing if it was not asked for.
  std::optional<hexmesh::Result> preview;
};

/// @throws Error as solve_equilibrium
SceneCheck check_scene(const hexmesh::Lattice& lattice, const Scene& scene, int level, bool with_preview = false);

/// What a solution is expected to cost.
struct SolvePlan {
  struct Level {
    int level = 0;
    std::size_t cells = 0, dofs = 0;
    double seconds = 0;  ///< expected
    std::size_t bytes = 0;
  };
  /// Where an accuracy or a budget is expected to end.
  struct End {
    int level = 0;
    std::string why;          ///< of an accuracy; of a budget that does not last to the finest level
    double most_seconds = 0;  ///< of all, if it goes on to the finest level, or as long as a budget lasts
  };
  std::vector<Effect> effects;  ///< with the expected seconds
  std::vector<Level> levels;    ///< coarse to fine
  std::optional<Level> look;    ///< the finest that the error is told from, with the time of all looked at
  std::optional<End> end;
  double strain_seconds = 0;   ///< to find whether cells have to rotate
  double reading_seconds = 0;  ///< of the lattice, for who has read it
  double setup_seconds = 0;    ///< of what the last level is made of before it is solved; else in its seconds
  double seconds() const;      ///< of all
  std::size_t bytes = 0;       ///< of memory, at the peak
  bool finds_cells = false;    ///< that an accuracy takes, on the way: what is told is of cells alike in their place
};

/// The levels that would be solved, and how long that would take: coarse levels, up to one of about a second, are
/// solved, and finer ones are expected to take as much for each cell, scaled as operator products are (THEORY.md,
/// "Accuracy"); the last level is made, as its supports may take longer than its solution. An accuracy or a budget is
/// solved for about a second, and expected to end where its errors, falling as they did, are as small as asked. Of a
/// motion the first steps are taken.
/// @throws Error as solve_equilibrium
SolvePlan plan_solution(const hexmesh::Lattice& lattice, const Scene& scene, int level);

/// The memory that a solution is expected to take on its finest level [bytes].
std::size_t expected_bytes(const hexmesh::Lattice& lattice, const Scene& scene, int level);

/// Save memory if the finest level would not fit otherwise; an accuracy or a budget may end on a coarser one.
/// @param note  becomes a line on what that costs; empty: nothing
/// @returns the finest level that fits
/// @throws Error{input} if the level asked does not
int fit_into_memory(const hexmesh::Lattice& lattice, int finest, Scene& scene, std::string& note);

/// What the parts of a linear solution take on one level, at rest.
struct SolverTimes {
  std::size_t cells = 0, dofs = 0;
  double product = 0;         ///< H x, medians [s]
  double single_product = 0;  ///< likewise, in single precision
  double linearize = 0;       ///< prepare H
  double project = 0;         ///< prepare the projected H
  double set_up = 0;          ///< of the multigrid levels
  double cycle = 0;           ///< one V-cycle
};

SolverTimes measure_solver(const hexmesh::Lattice& lattice, const Scene& scene, int level, int repeats);

}  // namespace hexsolver
