// SPDX-License-Identifier: Apache-2.0
#include "hexbench/commands.h"

using namespace hextools;

int main(int argc, char** argv) {
  return run_tool(
      argc, argv,
      {"hexbench", "Measure what accuracy costs, and how fast this machine does what the tools do; medians.",
       "hexbench lattice liver.hexmesh",
       declare_subcommands(
           {{"machine", "What this machine can do at most: memory bandwidth and fused multiply-adds",
             "hexbench machine", declare_machine},
            {"lattice", "Element recursion of all levels, against memcpy", "hexbench lattice liver.hexmesh",
             declare_lattice},
            {"solver", "Multigrid of one level, against its operator product",
             "hexbench solver liver.hexmesh liver.toml --level 2", declare_solver},
            {"effects", "What each effect of a scene costs and changes, one added after the other",
             "hexbench effects liver.hexmesh liver.toml --level 2 --repeats 1", declare_effects},
            {"motion", "Steps per second of a motion on every level, and what its solvers cost and miss",
             "hexbench motion liver.hexmesh liver.toml --level 2", declare_motion},
            {"accuracy", "Cells of all levels and tetrahedra of many sizes: error, time and memory",
             "hexbench accuracy liver.hexmesh liver.toml --csv accuracy.csv", declare_accuracy},
            {"estimates", "The errors that solutions estimate, against the lattice's finest level",
             "hexbench estimates liver.hexmesh liver.toml", declare_estimates},
            {"paper", "The paper's tables and figures, measured; Markdown", "hexbench paper table1 -o table1.md",
             declare_paper},
            {"compare", "A result against points of another solution, or two results dataset by dataset",
             "hexbench compare liver.hexresult liver.hexresult --exact", declare_compare}})});
}
