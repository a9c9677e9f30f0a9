// SPDX-License-Identifier: Apache-2.0
#include "options.h"

#include <fmt/format.h>

#include "hexmesh/core/error.h"

namespace hextools {

using hexmesh::Error;
using hexmesh::ErrorKind;

bool ExportOptions::has_outputs() const { return !lattice.empty() || !surface.empty() || needs_a_result(); }

bool ExportOptions::shows_surface() const {
  return !surface.empty() || !html.empty() || !warped.empty() || !segmentation.empty();
}

bool ExportOptions::needs_a_result() const {
  return needs_a_solution() || !conditions.empty() || !obstacles.empty() || !report.empty();
}

bool ExportOptions::needs_a_solution() const {
  return deformed || !csv.empty() || !deck.empty() || !html.empty() || !probes.empty() || !warped.empty() ||
         !segmentation.empty() || !transform.empty() || !transform_points.empty();
}

void add_options(CLI::App& app, ExportOptions& o) {
  app.add_option("input", o.input, "Result file of hexsolve or lattice file of hexmesh; - is standard input")
      ->required();
  app.add_option("--level", o.level, "Level of a lattice file to export; 0 = voxels [default: 0]")
      ->check(CLI::Range(0, 30));
  app.add_option("--lattice", o.lattice,
                 "Hexahedra (.vtu; .hdf: VTKHDF; .pvd: the steps of a motion): displacement, segment, fill, "
                 "stress, stretch, ...");
  app.add_option("--surface", o.surface,
                 "Embedded surface (.vtp; .pvd: the steps of a motion): displacement, segment; or the deformed "
                 "shape alone (.stl, .obj, .ply)");
  app.add_option("--conditions", o.conditions,
                 "The points that conditions hold (.vtp): name, displacement [mm], reaction [N]");
  app.add_option("--obstacles", o.obstacles, "The obstacles of the scene, where they are at the end (.vtp): name");
  app.add_option("--csv", o.csv, "node,x,y,z,ux,uy,uz [mm, LPS] of the lattice nodes (.csv)");
  add_repeated(app, "--probe", o.probes,
               "x,y,z [mm, LPS] at rest, or a markup file: where these points go, as CSV on standard output");
  app.add_option("--report", o.report, "The report of the solution (.json, or .csv: key,value)");
  app.add_option("--html", o.html, "The report with pictures, of --scan where it is given, in one file (.html)");
  app.add_option("--warp,--scan", o.scan,
                 "A scan (NRRD, NIfTI, MetaImage, DICOM folder): to deform with --to, to show with --html");
  app.add_option("--to", o.warped, "The deformed scan (.nrrd, .nii.gz); what is around the body fades to rest");
  app.add_option("--segmentation", o.segmentation,
                 "The deformed segmentation (.seg.nrrd with names and colours, .nii.gz)");
  app.add_option("--grid", o.grid,
                 "Voxels of --to and --segmentation: those of a file, or `fitted`: the lattice's, continued to "
                 "hold the body [default: those of --warp, else fitted]");
  app.add_option("--transform", o.transform,
                 "Displacement field deformed -> rest, what resampling filters expect (ITK .h5, or vectors in "
                 ".nrrd, .nii.gz, .mha)");
  app.add_option("--transform-points", o.transform_points,
                 "Displacement field rest -> deformed, what moves points (likewise)");
  app.add_option("--inp", o.deck,
                 "The same model as a CalculiX deck (.inp), for comparison: level 0, strain = \"cauchy\", "
                 "volumetric = \"full\", conditions on = \"nodes\"");
  app.add_flag("--deformed", o.deformed,
               "Move the points; by default files hold the rest shape with the displacement as data");
}

void check_options(const ExportOptions& o) {
  if (!o.has_outputs())
    throw Error(ErrorKind::usage, "nothing to write, expected --lattice, --surface, --html or another output");
  for (const std::string& name : {o.warped, o.segmentation, o.transform, o.transform_points, o.html})
    if (name == "-") throw Error(ErrorKind::usage, "volumes, transforms and --html are written to files, not to -");
  if (o.scan.empty() && !o.warped.empty())
    throw Error(ErrorKind::usage, "--to is given without the scan to deform, expected --warp SCAN");
  if (!o.scan.empty() && o.warped.empty() && o.html.empty() && o.segmentation.empty())
    throw Error(ErrorKind::usage, "--warp is given without --to, expected the name of the deformed scan");
}

}  // namespace hextools
