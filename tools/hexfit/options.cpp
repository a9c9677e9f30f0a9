// SPDX-License-Identifier: Apache-2.0
#include "options.h"

namespace hextools {

void add_options(CLI::App& app, FitOptions& o) {
  app.add_option("lattice", o.lattice, "Lattice file of hexmesh build: the body before")->required();
  add_segment_options(app, o.segments);
  app.add_option("--landmarks", o.landmarks,
                 "BEFORE NOW: two markups of 3D Slicer (.mrk.json, .fcsv), or points of elastix (.txt), of the same "
                 "points, inside or on the body")
      ->expected(2);
  app.add_option("--body", o.body_segment,
                 "Segment of the lattice whose surface is to lie on the targets; without it each target is of the "
                 "segment of its name, or of the only one");
  app.add_flag("--part", o.is_part,
               "The targets are parts of the surface (a camera's view): what they do not show is left to the "
               "mechanics. Open surfaces are taken so");
  app.add_option(
         "--trust", o.trust,
         "How far the surface may stay off where the body resists with a tenth of its Young's modulus [mm]. "
         "Without it half of the noise of the target's surface, at least 0.0005 of the body's size; for landmarks "
         "0.001 of that")
      ->check(CLI::Range(1e-6, 1e6));
  app.add_option(
         "--outliers", o.outliers,
         "What is far [mm]: it pulls no harder, and where it stays so less and less, beyond twice that not at "
         "all. 0: nothing is; without it 3 times the median distance, at least 30 --trust and 0.01 of the body's size")
      ->check(CLI::Range(0.0, 1e6));
  app.add_option("--scene", o.scene, "Scene (TOML) with what else acts: materials, supports, gravity, a law");
  add_repeated(app, "--set", o.settings, "KEY=VALUE: override a key of the scene, e.g. solve.law=neo-hookean");
  app.add_option("--level", o.level,
                 "Mechanical level, 0 = voxels; without it and what the scene says the finest of at most 20000 cells")
      ->check(CLI::Range(0, 30));
  app.add_flag("--no-spread", o.without_spread,
               "Do not solve again with other stiffnesses to tell how far the answer depends on them");
  app.add_option("--report", o.report, "Write a JSON report; - is standard output");
  app.add_option("--write-scene", o.scene_output,
                 "Write the scene too (TOML), and beside it the surfaces that it names, for hexsolve");
  add_output(app, o.output, "Result file (.hexresult, HDF5)");
}

}  // namespace hextools
