// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/commands.h"

using namespace hextools;

int main(int argc, char** argv) {
  return run_tool(
      argc, argv,
      {"hexmesh", "Build the multi-resolution lattice of a labelled volume, or look at one.",
       "hexmesh build liver.nrrd --material liver:young_kpa=100,poisson=0.3 -o liver.hexmesh",
       declare_subcommands(
           {{"build", "Labelled volume -> lattice (HDF5)",
             "hexmesh build liver.nrrd --material liver:tissue=liver -o liver.hexmesh", declare_build},
            {"info", "Levels, segments and materials of a lattice file", "hexmesh info liver.hexmesh", declare_info},
            {"check", "Verify that a lattice file is what its voxels give; exit 3 if not",
             "hexmesh check liver.hexmesh", declare_check},
            {"surface", "Write the embedded surfaces (.obj .stl .ply .off; .vtp: hexexport)",
             "hexmesh surface liver.hexmesh -o liver.stl", declare_surface}})});
}
