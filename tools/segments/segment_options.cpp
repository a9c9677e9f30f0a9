// SPDX-License-Identifier: Apache-2.0
#include "segments/segment_options.h"

namespace hextools {
namespace {

constexpr const char* drawn = "A segment without a segmentation";
constexpr const char* cleaning = "Cleaning, in this order";

void add_drawing(CLI::App& app, SegmentOptions& o) {
  CLI::Option* name =
      app.add_option(
             "--as", o.name_of_drawn,
             "Name of a segment that is made of a scan, which the input then is: the voxels that --box or --roi, "
             "--sphere, --threshold and --implicit have in common")
          ->check([](const std::string& text) { return text.empty() ? "expected a name" : std::string(); })
          ->group(drawn);
  const auto add = [&](const char* option, std::string& value, const char* text) {
    app.add_option(option, value, text)->group(drawn)->needs(name);
  };
  add("--threshold", o.threshold, "LOW:HIGH: grey values from LOW to HIGH; either may be left out");
  add("--connected-to", o.connected_to, "x,y,z in LPS [mm]: of these, what hangs together with this place");
  add("--sphere", o.sphere, "x,y,z,r: within r of this place, LPS [mm]");
  add("--implicit", o.implicit,
      "Where this expression of x, y, z (LPS, mm) is at most 0, e.g. \"x*x/900 + y*y/400 + z*z/400 - 1\"; without an "
      "input on voxels of --spacing in --box");
}

void add_cleaning(CLI::App& app, SegmentOptions& o) {
  const auto add = [&](const char* name, double& value, const char* text) {
    app.add_option(name, value, text)->check(CLI::Range(0.001, 100.0))->group(cleaning);
  };
  add("--open", o.open, "Erode, then dilate by this radius [mm]: cuts spikes and thin bridges");
  add("--close", o.close, "Dilate, then erode by this radius [mm]: fills thin gaps");
  app.add_flag("--fill-cavities", o.fill_cavities, "Give to each segment the background it encloses")->group(cleaning);
  add("--remove-specks", o.specks_ml, "Remove parts smaller than this [mL]");
  app.add_flag("--largest-component", o.largest_component,
               "Keep of each segment only the largest part that hangs together through voxel faces")
      ->group(cleaning);
  app.add_option("--isotropic", o.isotropic,
                 "Cubic voxels of this edge [mm], 0 = the smallest edge there is: between thick slices segments go on "
                 "by their shape, their volumes kept")
      ->check(CLI::Range(0.0, 100.0))
      ->group(cleaning);
}

}  // namespace

void add_label_names(CLI::App& app, SegmentOptions& o) {
  app.add_option(
      "--labels", o.label_names,
      "Names and colours of label values that have none: a table of 3D Slicer (.ctbl), FreeSurfer or ITK-SNAP");
}

void add_segment_options(CLI::App& app, SegmentOptions& o) {
  app.add_option("inputs", o.inputs,
                 "Segmentations: NRRD, .seg.nrrd, NIfTI, MetaImage, VTI; DICOM SEG and RTSTRUCT as files or "
                 "folders; surfaces and lines as OBJ, STL, PLY, OFF, VTP; - is standard input. Later ones win "
                 "where they overlap");
  add_repeated(app, "--input", o.named_inputs,
               "NAME=FILE: all that the file holds as one segment of that name; these come after the other inputs");
  add_label_names(app, o);
  add_repeated(app, "--segment", o.segments,
               "Keep only this segment: NAME, LABEL or terminology code (SCT:10200004), with =NAME to name it; "
               "may be given often");
  add_repeated(app, "--priority", o.priority, "Segments that win where segments overlap, the first most")
      ->delimiter(',');
  app.add_option("--fraction", o.fraction, "Of a fractional DICOM SEG: least share of a voxel, 0 to 1")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  app.add_option("--series", o.series, "SeriesInstanceUID, or its end, where DICOM files hold several");
  app.add_option("--spacing", o.spacing, "Edge of the cubic voxels of surfaces and lines [mm]")
      ->check(CLI::Range(1e-6, 1000.0));
  app.add_option("--scale", o.scale, "Multiply the coordinates of surfaces and lines: 1000 where they are in metres")
      ->check(CLI::Range(1e-6, 1e6))
      ->capture_default_str();
  app.add_option("--thickness", o.thickness,
                 "Of open surfaces and lines [mm]: the voxels within half of it; without it those that they cross")
      ->check(CLI::Range(1e-6, 1000.0));
  CLI::Option* roi = app.add_option("--roi-mm,--box", o.roi, "Zone of interest x0,x1,y0,y1,z0,z1 in LPS [mm]");
  app.add_option("--roi-markup,--roi", o.roi_markup, "Zone of interest: a 3D Slicer ROI (.mrk.json)")->excludes(roi);
  app.add_option("--margin", o.margin,
                 "Room around the zone of interest, or else around the segments [mm], >= 0; the rest is cut off")
      ->check(number_from_0);
  add_drawing(app, o);
  add_cleaning(app, o);
}

}  // namespace hextools
