// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "cli/run_files.h"
#include "cli/solve_report.h"
#include "hexsolver/scene/scene.h"

namespace hextools {

/// What a scene needs of a lattice, with its materials.
/// @param asked     the level that the command line names
/// @param pictures  whether labels and picture surface are needed
/// @param level     becomes the finest that the scene asks for
hexmesh::Lattice read_lattice(const std::filesystem::path& path, const hexsolver::Scene& scene,
                              std::optional<int> asked, bool pictures, int& level);

/// hexsolver::fit_into_memory(), with what it costs told.
int fit_into_memory(const hexmesh::Lattice& lattice, int finest, hexsolver::Scene& scene, const Console& console);

/// An equilibrium, with its progress told.
hexsolver::Outcome solve_equilibrium(const hexmesh::Lattice& lattice, const hexsolver::Scene& scene, int level,
                                     const Console& console);

/// Says on standard error what is wrong with a solution. @returns the exit code
int judge(const hexsolver::SolveReport& report, const std::string& output, const Console& console);

/// When a run began, and when it had read its lattice [s].
struct RunTimes {
  double start = 0, read_done = 0;
};

/// Adds to a report for people what differs from run to run.
void add_times(nlohmann::json& summary, const hexsolver::SolveReport& report, const RunTimes& times, double solve_done);

}  // namespace hextools
