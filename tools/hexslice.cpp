// SPDX-License-Identifier: Apache-2.0
#include "hexslice/commands.h"

using namespace hextools;

int main(int argc, char** argv) {
  return run_tool(
      argc, argv,
      {"hexslice", "Draw the deformed scan.", "hexslice planes liver.hexresult --scan ct.nrrd -o pictures",
       declare_subcommands(
           {{"planes", "Slices along the patient's axes or across any direction, before and after side by side (PNG)",
             "hexslice planes liver.hexresult --scan ct.nrrd --axis coronal --color displacement -o pictures",
             declare_planes},
            {"steps", "One slice of a motion at each state that its result keeps (PNG), or a film",
             "hexslice steps motion.hexresult --scan ct.nrrd --axis coronal -o frames", declare_steps},
            {"volume", "The deformed scan as a translucent volume: planes across the view, back to front (PNG)",
             "hexslice volume liver.hexresult --scan ct.nrrd --view oblique -o volume.png", declare_volume}})});
}
