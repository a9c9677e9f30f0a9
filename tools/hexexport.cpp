// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <fstream>
#include <nlohmann/json.hpp>

#include "cli/checksum.h"
#include "cli/export_tables.h"
#include "cli/html_report.h"
#include "cli/result_state.h"
#include "cli/result_steps.h"
#include "cli/tool.h"
#include "hexmesh/core/error.h"
#include "hexmesh/file/calculix_deck.h"
#include "hexmesh/file/lattice_file.h"
#include "hexmesh/file/vtkhdf.h"
#include "hexmesh/scan/image_io.h"
#include "hexmesh/scan/transform_file.h"
#include "hexmesh/surface/surface_file.h"
#include "hexmesh/view/vtk_export.h"

namespace {

using namespace hextools;
using hexmesh::Configuration;
using hexmesh::Error;
using hexmesh::ErrorKind;
using hexmesh::Result;
using nlohmann::json;

struct Options {
  std::string input;
  std::string lattice, surface, conditions, csv, deck, report, html;
  std::vector<std::string> probes;
  std::string scan, warped, segmentation, grid, transform, transform_points;
  int level = -1;
  bool deformed = false;

  /// All names that are written to.
  std::vector<std::string> outputs() const {
    std::vector<std::string> out;
    for (const std::string& name :
         {lattice, surface, conditions, csv, deck, report, html, warped, segmentation, transform, transform_points})
      if (!name.empty()) out.push_back(name);
    return out;
  }
  /// Those that only a result has.
  bool needs_a_result() const {
    return deformed || !conditions.empty() || !csv.empty() || !deck.empty() || !report.empty() || !html.empty() ||
           !probes.empty() || !warped.empty() || !segmentation.empty() || !transform.empty() ||
           !transform_points.empty();
  }
};

/// A result, or a level of a lattice file at rest.
Result read_input(const Options& o, const hexmesh::InputFile& input, const Console& console) {
  if (hexmesh::format_of(input.path()) == hexmesh::result_format) {
    if (o.level >= 0) throw Error(ErrorKind::usage, "--level goes with a lattice file, but the input is a result");
    return hexmesh::read_result(input.path());
  }
  if (o.needs_a_result())
    throw Error(ErrorKind::usage,
                "the input is a lattice file, expected a result for all but --lattice and --surface at rest");
  const int count = hexmesh::count_levels(input.path());
  const int level = std::max(o.level, 0);
  if (level >= count) throw Error(ErrorKind::input, fmt::format("level is {}, expected 0 to {}", level, count - 1));
  console.note(fmt::format("level {} of 0 to {}", level, count - 1));
  return hexmesh::rest_state(hexmesh::read_lattice(input.path(), {level}), level);
}

void write_deck(const Result& result, const std::filesystem::path& path) {
  const json report = json::parse(result.report);
  const auto expect = [&](bool holds, const char* what, const char* expected) {
    if (!holds) throw Error(ErrorKind::input, fmt::format("--inp: {}, expected {}", what, expected));
  };
  expect(report.value("kind", "equilibrium") == "equilibrium", "the result is a motion", "an equilibrium");
  expect(report["converged"], "the result is not converged", "one that is");
  expect(report["forces"].empty(), "the scene has forces, which a deck does not hold yet", "displacements only");
  expect((!report.contains("contacts") || report["contacts"].empty()),
         "the scene has contacts, which a deck does not hold", "displacements only");
  expect(report["volumetric"] == "full", "C3D8 integrates the volumetric term fully", "solve.volumetric = \"full\"");
  expect(report["strain"] == "cauchy", "decks are written for small strain", "solve.strain = \"cauchy\"");
  expect(report["stiffness"] == "exact" && report["held_cells"] == 0, "springs or averaged cells have no counterpart",
         "a scene without");
  hexmesh::write_calculix_deck(result, path);
}

/// Those of an earlier, longer series of the name, which --force replaces as a whole.
void remove_surplus_pieces(const std::filesystem::path& folder, const std::string& stem, const std::string& extension,
                           std::size_t first) {
  for (std::size_t n = first;; ++n)
    if (!std::filesystem::remove(folder / fmt::format("{}_{:04}{}", stem, n, extension))) return;
}

/// NAME.pvd and the files it lists, NAME/NAME_0000.vtu, ...
template <class WriteStep>
void write_series(const std::string& name, const char* extension, const Result& result, const Options& o,
                  const hexmesh::InputFile& input, const CommonOptions& common, WriteStep&& write_step) {
  if (result.times.empty())
    throw Error(
        ErrorKind::usage,
        fmt::format("output '{}', but the result is no motion, expected a name that ends in {}", name, extension));
  const std::filesystem::path list(name), folder = list.parent_path() / list.stem();
  const auto file = open_output(name, ".pvd", common, {o.input});
  std::error_code failed;
  std::filesystem::create_directories(folder, failed);
  if (failed) throw Error(ErrorKind::output, fmt::format("cannot make the folder '{}'", folder.string()));
  const std::filesystem::path path = input.path();
  ResultSteps steps(path, result);
  std::vector<std::pair<double, std::string>> files;
  for (std::size_t n = 0; n < result.times.size(); ++n) {
    const std::string piece = fmt::format("{}_{:04}{}", list.stem().string(), n, extension);
    const auto out = open_output((folder / piece).string(), extension, common, {o.input});
    write_step(steps.at(n), out->path());
    out->commit();
    files.emplace_back(result.times[n], (list.stem() / piece).string());
  }
  hexmesh::write_pvd(files, file->path());
  file->commit();
  if (common.force) remove_surplus_pieces(folder, list.stem().string(), extension, files.size());
}

/// The ending of a name, which the format is chosen by.
/// @throws Error{usage} if it is none of those
std::string ending_of(const std::string& name, const std::vector<std::string>& endings) {
  for (const std::string& e : endings)
    if (name.ends_with(e)) return e;
  throw Error(ErrorKind::usage,
              fmt::format("output '{}', expected a name that ends in {}", name, fmt::join(endings, ", ")));
}

/// Writes the outputs that were asked for, each whole or not at all.
class Exporter {
public:
  Exporter(const Options& o, const hexmesh::InputFile& input, const Result& result, const CommonOptions& common,
           const Console& console)
      : o_(o), input_(input), result_(result), common_(common), console_(console) {}

  void run() {
    check_names();
    write_series_or(o_.lattice, lattices, [](const Result& r, Configuration c, const auto& path) {
      if (path.extension() == ".hdf")
        hexmesh::write_vtkhdf(r, c == Configuration::deformed, path);
      else
        hexmesh::write_vtu(r, c, path);
    });
    write_series_or(o_.surface, surfaces, write_surface);
    write(o_.conditions, {".vtp"}, [&](const auto& path) {
      hexmesh::write_conditions_vtp(result_, condition_forces(result_), configuration(), path);
    });
    write(o_.csv, {".csv"}, [&](const auto& path) { write_whole(path, nodes_csv(result_)); });
    write(o_.deck, {".inp"}, [&](const auto& path) { write_deck(result_, path); });
    write(o_.report, reports, [&](const auto& path) {
      write_whole(path, path.extension() == ".csv" ? report_csv(result_) : report_json(result_));
    });
    if (!o_.probes.empty()) {
      const std::filesystem::path path = input_.path();
      fmt::print("{}", probe_table(path, result_, read_probes(o_.probes)));
    }
    write_volumes();
    write(o_.html, {".html"}, [&](const auto& path) { write_whole(path, html_report(result_, scan(), made_by())); });
  }

private:
  Configuration configuration() const { return o_.deformed ? Configuration::deformed : Configuration::rest; }

  using Endings = std::vector<std::string>;
  const Endings lattices = {".vtu", ".hdf"}, surfaces = {".vtp", ".stl", ".obj", ".ply"}, reports = {".json", ".csv"};
  const Endings volumes = {".nrrd", ".nii.gz", ".nii"}, transforms = {".h5", ".nrrd", ".nii.gz", ".nii", ".mha"};

  /// All names are good and free before the first file is written.
  void check_names() const {
    const auto check = [&](const std::string& name, const Endings& endings) {
      if (name.empty()) return;
      if (name != "-") ending_of(name, endings);
      open_output(name, "", common_, {o_.input, o_.scan, o_.grid});
    };
    const auto with_series = [](Endings endings) {
      endings.push_back(".pvd");
      return endings;
    };
    check(o_.lattice, with_series(lattices));
    check(o_.surface, with_series(surfaces));
    check(o_.conditions, {".vtp"});
    check(o_.csv, {".csv"});
    check(o_.deck, {".inp"});
    check(o_.report, reports);
    check(o_.html, {".html"});
    for (const std::string& name : {o_.warped, o_.segmentation}) check(name, volumes);
    for (const std::string& name : {o_.transform, o_.transform_points}) check(name, transforms);
    if (!o_.grid.empty() && o_.grid != "fitted") hexmesh::InputFile(std::string(o_.grid));
  }

  /// The command that makes the report, with what it reads.
  std::string made_by() const {
    std::vector<std::string> read = {checksum_line(o_.input, input_.path())};
    if (!o_.scan.empty() && o_.scan != "-") read.push_back(checksum_line(o_.scan, o_.scan));
    return history_entry(read);
  }

  template <class Writer>
  void write(const std::string& name, const std::vector<std::string>& endings, Writer&& writer) {
    if (name.empty()) return;
    const std::string ending = name == "-" ? endings.front() : ending_of(name, endings);
    const auto file = open_output(name, ending, common_, {o_.input, o_.scan, o_.grid});
    writer(file->path());
    file->commit();
    console_.note(fmt::format("wrote {}", name == "-" ? "standard output" : name));
  }

  template <class Writer>
  void write_series_or(const std::string& name, const std::vector<std::string>& endings, Writer&& writer) {
    if (!name.ends_with(".pvd"))
      return write(name, endings, [&](const auto& path) { writer(result_, configuration(), path); });
    write_series(name, endings.front().c_str(), result_, o_, input_, common_,
                 [&](const Result& step, const auto& path) { writer(step, configuration(), path); });
    console_.note(fmt::format("wrote {} and {} files beside it", name, result_.times.size()));
  }

  /// Formats that hold no displacement hold the deformed shape.
  static void write_surface(const Result& result, Configuration configuration, const std::filesystem::path& path) {
    if (path.extension() == ".vtp") return hexmesh::write_vtp(result, configuration, path);
    hexmesh::TriangleSurface surface = result.surface;
    for (std::size_t n = 0; n < result.surface_displacement.size(); ++n)
      surface.points[n] += result.surface_displacement[n];
    hexmesh::write_surface(surface, path);
  }

  const hexmesh::IntensityVolume* scan() {
    if (!o_.scan.empty() && !scan_) scan_ = read_scan_of(result_, o_.scan, console_);
    return scan_ ? &*scan_ : nullptr;
  }

  /// The voxels of --to and --segmentation.
  hexmesh::Grid grid() {
    if (o_.grid == "fitted" || (o_.grid.empty() && !scan())) return hexmesh::fitted_grid(result_);
    if (o_.grid.empty()) return scan()->grid;
    const hexmesh::InputFile file(o_.grid);
    return hexmesh::read_intensity(file.path(), {.warn = warning_on(console_)}).grid;
  }

  void write_volumes() {
    if (o_.warped.empty() && o_.segmentation.empty() && o_.transform.empty() && o_.transform_points.empty()) return;
    if (!o_.warped.empty()) scan();

    const hexmesh::Warp warp = hexmesh::make_warp(result_);
    if (!o_.transform.empty() || !o_.transform_points.empty()) tell_consistency(warp);
    if (!o_.warped.empty() || !o_.segmentation.empty()) {
      const hexmesh::Grid voxels = grid();
      warn_of_what_is_outside(voxels);
      write(o_.warped, volumes, [&](const auto& path) {
        hexmesh::write_intensity(hexmesh::deform(result_, *scan(), warp.to_rest, voxels), path);
      });
      write(o_.segmentation, volumes, [&](const auto& path) {
        hexmesh::write_labels(hexmesh::deformed_labels(result_, warp.to_rest, voxels), path);
      });
    }
    write(o_.transform, transforms, [&](const auto& path) { hexmesh::write_transform(warp.to_rest, path); });
    write(o_.transform_points, transforms, [&](const auto& path) { hexmesh::write_transform(warp.from_rest, path); });
  }

  void tell_consistency(const hexmesh::Warp& warp) const {
    const hexmesh::WarpCheck check = hexmesh::check_warp(result_, warp);
    const std::string text = fmt::format(
        "the transforms undo each other in the body to {:.2g} voxels on average, {:.2g} at worst; {} of {} voxels are "
        "off by more than 0.1",
        check.mean, check.largest, check.over_a_tenth, check.voxels);
    const double share =
        static_cast<double>(check.over_a_tenth) / static_cast<double>(std::max<std::size_t>(check.voxels, 1));
    const hexmesh::Vec3& samples = warp.to_rest.grid.spacing();
    if (share > 0.1)
      throw Error(ErrorKind::geometry,
                  fmt::format("{}: a field of samples every {:.3g} x {:.3g} x {:.3g} mm cannot hold this deformation, "
                              "expected less motion or a smaller body",
                              text, samples[0], samples[1], samples[2]));
    if (share > 1e-3)
      console_.warning(text + ": the body is folded or nearly flat there");
    else
      console_.note(text);
    if (check.ghost_ml > 0.01 * body_ml())
      console_.warning(
          fmt::format("{:.3g} mL around the body are led into it by the transform, because it moves farther "
                      "than it is thick: filters show the body there a second time (--to and "
                      "--segmentation do not)",
                      check.ghost_ml));
  }

  double body_ml() const {
    double voxels = 0;
    for (const hexmesh::LatticeSegment& s : result_.segments)
      if (s.material) voxels += static_cast<double>(s.num_voxels);
    return voxels * result_.voxels.voxel_volume() / 1000;
  }

  void warn_of_what_is_outside(const hexmesh::Grid& voxels) const {
    const hexmesh::Bounds b = hexmesh::bounds_of(result_);
    const hexmesh::Vec3 last = voxels.corner(7), middle = voxels.continuous_index((b.low + b.high) / 2);
    const double reach = (b.high - b.low).norm() / 2;
    for (int d = 0; d < 3; ++d)
      if ((middle[d] - last[d]) * voxels.spacing()[d] > reach || -middle[d] * voxels.spacing()[d] > reach)
        throw Error(ErrorKind::input, "the grid to write on holds no part of the body, expected one around it");
    const auto holds = [&](const hexmesh::Vec3& p) { return voxels.covers(voxels.continuous_index(p)); };
    std::size_t outside = 0;
    for (std::size_t n = 0; n < result_.surface_displacement.size(); ++n) {
      const hexmesh::Vec3& p = result_.surface.points[n];
      outside += holds(p) && !holds(p + result_.surface_displacement[n]);
    }
    if (outside > 0)
      console_.warning(
          fmt::format("{} of {} surface points of the body move out of the volume that is written: "
                      "--grid fitted holds all of it",
                      outside, result_.surface.points.size()));
  }

  const Options& o_;
  const hexmesh::InputFile& input_;
  const Result& result_;
  const CommonOptions& common_;
  const Console& console_;
  std::optional<hexmesh::IntensityVolume> scan_;
};

int run(const Options& o, const CommonOptions& common, const Console& console) {
  std::vector<std::string> outputs = o.outputs();
  if (outputs.empty() && o.probes.empty())
    throw Error(ErrorKind::usage, "nothing to write, expected --lattice, --surface, --html or another output");
  for (std::string& name : outputs)
    if (name != "-") name = std::filesystem::weakly_canonical(std::filesystem::absolute(name)).string();
  if (!o.probes.empty()) outputs.push_back("-");
  std::sort(outputs.begin(), outputs.end());
  if (const auto twice = std::adjacent_find(outputs.begin(), outputs.end()); twice != outputs.end())
    throw Error(ErrorKind::usage, *twice == "-" ? "two outputs go to standard output, expected one at most"
                                                : fmt::format("two outputs are both '{}', expected two names", *twice));
  for (const std::string& name : {o.warped, o.segmentation, o.transform, o.transform_points, o.html})
    if (name == "-") throw Error(ErrorKind::usage, "volumes, transforms and --html are written to files, not to -");
  if (o.scan == "-" && o.input == "-")
    throw Error(ErrorKind::usage, "the input and --scan are both -, expected one of them at most");
  if (o.scan.empty() && !o.warped.empty())
    throw Error(ErrorKind::usage, "--to is given without the scan to deform, expected --warp SCAN");
  if (!o.scan.empty() && o.warped.empty() && o.html.empty() && o.segmentation.empty())
    throw Error(ErrorKind::usage, "--warp is given without --to, expected the name of the deformed scan");
  const hexmesh::InputFile input(o.input);
  const Result result = read_input(o, input, console);
  warn_of_state(result, console);
  Exporter(o, input, result, common, console).run();
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  auto o = std::make_shared<Options>();
  return run_tool(
      argc, argv,
      {"hexexport", "Export a result, or a lattice before anything is solved, to the files that other programs open.",
       "hexexport liver.hexresult --lattice liver.vtu --surface liver.vtp --html liver.html --scan ct.nrrd",
       [o](CLI::App& app, const CommonOptions& common, const Console& console) -> std::function<int()> {
         app.add_option("input", o->input, "Result file of hexsolve or lattice file of hexmesh; - is standard input")
             ->required();
         app.add_option("--level", o->level, "Level of a lattice file to export; 0 = voxels [default: 0]")
             ->check(CLI::Range(0, 30));
         app.add_option("--lattice", o->lattice,
                        "Hexahedra (.vtu; .hdf: VTKHDF; .pvd: the steps of a motion): displacement, segment, fill, "
                        "stress, stretch, ...");
         app.add_option("--surface", o->surface,
                        "Embedded surface (.vtp; .pvd: the steps of a motion): displacement, segment; or the deformed "
                        "shape alone (.stl, .obj, .ply)");
         app.add_option("--conditions", o->conditions,
                        "The points that conditions hold (.vtp): name, displacement [mm], reaction [N]");
         app.add_option("--csv", o->csv, "node,x,y,z,ux,uy,uz [mm, LPS] of the lattice nodes (.csv)");
         add_repeated(app, "--probe", o->probes,
                      "x,y,z [mm, LPS] at rest, or a markup file: where these points go, as CSV on standard output");
         app.add_option("--report", o->report, "The report of the solution (.json, or .csv: key,value)");
         app.add_option("--html", o->html,
                        "The report with pictures, of --scan where it is given, in one file (.html)");
         app.add_option("--warp,--scan", o->scan,
                        "A scan (NRRD, NIfTI, MetaImage, DICOM folder): to deform with --to, to show with --html");
         app.add_option("--to", o->warped, "The deformed scan (.nrrd, .nii.gz); what is around the body fades to rest");
         app.add_option("--segmentation", o->segmentation,
                        "The deformed segmentation (.seg.nrrd with names and colours, .nii.gz)");
         app.add_option("--grid", o->grid,
                        "Voxels of --to and --segmentation: those of a file, or `fitted`: the lattice's, continued to "
                        "hold the body [default: those of --warp, else fitted]");
         app.add_option("--transform", o->transform,
                        "Displacement field deformed -> rest, what resampling filters expect (ITK .h5, or vectors in "
                        ".nrrd, .nii.gz, .mha)");
         app.add_option("--transform-points", o->transform_points,
                        "Displacement field rest -> deformed, what moves points (likewise)");
         app.add_option("--inp", o->deck,
                        "The same model as a CalculiX deck (.inp), for comparison: level 0, strain = \"cauchy\", "
                        "volumetric = \"full\", conditions on = \"nodes\"");
         app.add_flag("--deformed", o->deformed,
                      "Move the points; by default files hold the rest shape with the displacement as data");
         return [=, &common, &console] { return run(*o, common, console); };
       }});
}
