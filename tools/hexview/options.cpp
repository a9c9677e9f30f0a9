// SPDX-License-Identifier: Apache-2.0
#include "options.h"

namespace hextools {

void add_options(CLI::App& app, ViewOptions& o) {
  app.add_option("input", o.input, "Result file to look at; with SCENE a lattice file of hexmesh build")->required();
  CLI::Option* scene = app.add_option(
      "scene", o.scene,
      "Scene file (TOML): hexsolve solves its motion, and what is grabbed with the "
      "mouse pulls it. An equilibrium's is taken as 600 s in steps of 0.02 s, solved to a residual of 1e-3");
  app.add_option(
      "--scan", o.scan,
      "Grey values of slices (NRRD, NIfTI, MetaImage, DICOM folder); without it segments have their colours");
  app.add_option("--color", o.color, "segment, displacement or a field of the cells")->capture_default_str();
  app.add_flag("--slices", o.slices, "Show slices beside the body from the start");
  app.add_option("--size", o.size, "Pixels, WIDTH,HEIGHT")
      ->delimiter(',')
      ->expected(2)
      ->check(CLI::Range(200, 8192))
      ->capture_default_str();
  app.add_option("--script", o.script, "What to do, line by line, as a user would (FORMATS.md, \"Scripts\")");
  app.add_option("--pace", o.pace, "Seconds of the motion in a second; 0: as fast as it is solved")
      ->needs(scene)
      ->check(number_from_0)
      ->check(finite_number)
      ->capture_default_str();
  app.add_option("--reach", o.reach,
                 "How far around a grabbed point the surface is held [mm]; default: a fortieth of the body's size")
      ->needs(scene)
      ->check(number_from_0)
      ->check(finite_number);
  app.add_option("--level", o.levels, "Mechanical level, as of hexsolve")->needs(scene);
  add_repeated(app, "--set", o.settings, "KEY=VALUE: override a key of the scene")->needs(scene);
  app.add_option("--record", o.record, "Write what was pulled, with its times, for hexsolve --steer")->needs(scene);
  app.add_option("-o,--output", o.output, "Keep the motion, until the window is closed, as a result file")
      ->needs(scene);
}

}  // namespace hextools
