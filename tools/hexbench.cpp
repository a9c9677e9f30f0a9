// SPDX-License-Identifier: Apache-2.0
#include "hexbench/commands.h"

using namespace hextools;

int main(int argc, char** argv) {
  return run_tool(
      argc, argv,
      {"hexbench", "Measure what accuracy costs, and how fast this machine does what the tools do; medians.",
       "hexbench lattice liver.hexmesh",
       declare_subcommands(
           {{"machine", "What this machine can do at most: memory bandwidth and fused multiply-adds", declare_machine},
            {"lattice", "Element recursion of all levels, against memcpy", declare_lattice},
            {"solver", "Multigrid of one level, against its operator product", declare_solver},
            {"effects", "What each effect of a scene costs and changes, one added after the other", declare_effects},
            {"motion", "Steps per second of a motion on every level, and what its solvers cost and miss",
             declare_motion},
            {"accuracy", "Cells of all levels and tetrahedra of many sizes: error, time and memory", declare_accuracy},
            {"estimates", "The errors that solutions estimate, against the lattice's finest level", declare_estimates},
            {"paper", "The paper's tables and figures, measured; Markdown", declare_paper},
            {"compare", "A result against points of another solution, or two results dataset by dataset",
             declare_compare}})});
}
