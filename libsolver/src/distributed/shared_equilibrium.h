// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "hexmesh/core/error.h"
#include "hexsolver/equilibrium/equilibrium.h"

namespace hexsolver::mpi {

/// What every process throws when one of them failed: the first one's words.
class SharedError : public hexmesh::Error {
public:
  using Error::Error;
};

/// What one process of a run held at the mechanical level: its share of the whole, and what it had to know of others.
struct ProcessReport {
  std::uint64_t cells = 0, nodes = 0;
  std::uint64_t nodes_of_others = 0;  ///< beside its own cells
  std::uint64_t cells_read = 0, voxels_read = 0;
  std::uint64_t condition_nodes = 0;  ///< of the cells that conditions hold, which every process has
  double peak_memory_mb = 0;
};

/// A run of several processes; MPI and PETSc live as long as this. There is one at a time.
class Run {
public:
  /// @param petsc_options  as on a command line, e.g. "-ksp_monitor"
  explicit Run(const std::vector<std::string>& petsc_options);
  ~Run();
  Run(const Run&) = delete;
  Run& operator=(const Run&) = delete;

  std::vector<std::string> unused_options() const;  ///< that PETSc did not ask for

  bool is_first() const;
  [[noreturn]] void abort(int code) const;  ///< all processes, where only this one knows that it cannot go on

  /// f() on the first process; where it throws hexmesh::Error, all do.
  void on_first(const std::function<void()>& f) const;
  std::string of_first(const std::string& text) const;  ///< what the first process has

private:
  std::vector<std::string> petsc_options_;
};

/// What cannot be solved by several processes.
/// @throws Error{input}
void check_is_shareable(const Scene& scene);

/// solve_equilibrium() by all processes of a run: the lattice is read by layers, its cells are divided along a
/// space-filling curve, and the result is written by one process after the other. Nothing of the whole body's size is
/// on one of them.
/// @param result  receives the result; its report is written by `finish`
/// @param finish  called by the first process once the report is filled, with what has no rows in the result, to add
///                report and history
/// @throws SharedError
SolveReport solve_equilibrium(const Run& run, const std::filesystem::path& lattice, const Scene& scene,
                              const std::filesystem::path& result, std::vector<ProcessReport>& processes,
                              const std::function<void(hexmesh::Result&, const SolveReport&)>& finish,
                              const SolveProgress& progress = {});

}  // namespace hexsolver::mpi
