// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <omp.h>

#include <bit>
#include <cmath>
#include <csignal>
#include <fstream>
#include <set>

#include "cli/checksum.h"
#include "cli/solve_report.h"
#include "cli/tool.h"
#include "hexmesh/core/error.h"
#include "hexmesh/file/lattice_file.h"
#include "hexmesh/lattice/embedded_points.h"
#include "hexsolver/dynamics.h"
#include "hexsolver/plan.h"

namespace {

using namespace hextools;
using hexmesh::Error;
using hexmesh::ErrorKind;
using hexsolver::SolveReport;
using nlohmann::json;

struct Options {
  std::string lattice, scene, output, report;
  std::vector<std::string> settings;
  std::optional<int> level;
  std::optional<double> accuracy, budget;
  double max_memory_mb = 0;
  bool example = false, check = false, plan = false, stream = false;
};

int show_check(const hexsolver::SceneCheck& check, const Options& o, const CommonOptions& common,
               const Console& console) {
  json out = {{"level", check.level},
              {"conditions", json::array()},
              {"forces", to_json(check.forces)},
              {"contacts", to_json(check.contacts)},
              {"dropped_cells", check.dropped_cells},
              {"held_cells", check.held_cells},
              {"warnings", check.warnings}};
  for (const hexsolver::ConditionReport& c : check.conditions) out["conditions"].push_back(to_json(c));
  if (!o.report.empty()) write_text(o.report, out.dump(2) + "\n", common);
  for (const std::string& w : check.warnings) console.warning(w);
  std::string text;
  for (const hexsolver::ConditionReport& c : check.conditions)
    text += fmt::format("condition '{}': {} points, {} directions held\n", c.name, c.points, c.kept);
  for (const hexsolver::ForceReport& f : check.forces)
    text += fmt::format("force '{}': [{:.4g}, {:.4g}, {:.4g}] N\n", f.name, f.total_n[0], f.total_n[1], f.total_n[2]);
  for (const hexsolver::ContactReport& c : check.contacts)
    text += fmt::format("contact '{}': {:.3g} mm from the surface at rest\n", c.name, c.nearest_mm);
  if (check.dropped_cells > 0) text += fmt::format("islands left out: {} cells\n", check.dropped_cells);
  if (check.held_cells > 0) text += fmt::format("islands held by springs: {} cells\n", check.held_cells);
  text += fmt::format("level {}: {}\n", check.level,
                      check.needs_supports ? "every part is held" : "a motion, in which nothing need be held");
  if (o.report != "-") fmt::print("{}", text);
  return 0;
}

int show_plan(const hexsolver::SolvePlan& plan, const Options& o, const CommonOptions& common) {
  json out = {{"effects", to_json(plan.effects)}, {"levels", json::array()}};
  add_effect_seconds(out["effects"], plan.effects);
  std::string text;
  for (const hexsolver::Effect& e : plan.effects)
    text += fmt::format("{:3}  {}: {}\n", e.active ? "on" : "off", e.name, e.why);
  for (const hexsolver::SolvePlan::Level& l : plan.levels) {
    out["levels"].push_back({{"level", l.level},
                             {"cells", l.cells},
                             {"dofs", l.dofs},
                             {"seconds", l.seconds},
                             {"memory_mb", megabytes(l.bytes)}});
    text += fmt::format("level {}: {} cells, {} dofs, about {:.2g} s and {:.3g} MB\n", l.level, l.cells, l.dofs,
                        l.seconds, megabytes(l.bytes));
  }
  if (!o.report.empty()) write_text(o.report, out.dump(2) + "\n", common);
  if (o.report != "-") fmt::print("{}", text);
  return 0;
}

/// Save memory if the finest level would not fit otherwise; an accuracy or a budget may end on a coarser one.
/// @returns the finest level that fits
/// @throws Error{input} if the level asked does not
int fit_into_memory(const Options& o, const hexmesh::Lattice& lattice, int finest, hexsolver::Scene& scene,
                    const Console& console) {
  const double allowed = o.max_memory_mb > 0 ? o.max_memory_mb : 0.8 * machine_memory_mb();
  const auto expected = [&](int level) { return megabytes(hexsolver::expected_bytes(lattice, scene, level)); };
  const double fastest = expected(finest);
  if (fastest <= allowed) return finest;
  scene.saves_memory = true;
  int level = finest;
  const int most = scene.accuracy || scene.budget ? static_cast<int>(lattice.levels.size()) - 1 : finest;
  while (level < most && expected(level) > allowed) ++level;
  const std::string what = fmt::format("level {} ({} cells) would take about {:.3g} MB", finest,
                                       lattice.levels[static_cast<std::size_t>(finest)].cells.size(), fastest);
  if (expected(level) > allowed)
    throw Error(ErrorKind::input, fmt::format("{}, {:.3g} MB at the least, expected at most {:.3g} MB (--max-memory): "
                                              "solve a coarser level",
                                              what, expected(level), allowed));
  console.note(fmt::format("{}: to save memory it takes longer{}", what,
                           level > finest ? fmt::format(", and level {} is the finest", level) : ""));
  return level;
}

/// The moving surface on standard output, step by step: "Stream" in FORMATS.md.
class SurfaceStream {
public:
  explicit SurfaceStream(const hexmesh::Lattice& lattice) : lattice_(lattice) {
    std::signal(SIGPIPE, SIG_IGN);  // a reader that leaves is an error of writing
    static_assert(std::endian::native == std::endian::little);
    const hexmesh::TriangleSurface& surface = lattice.surface;
    fmt::print("hexstream 1\npoints {}\ntriangles {}\nmm LPS\n\n", surface.points.size(), surface.triangles.size());
    for (const auto& t : surface.triangles) write(t.data(), t.size());
    flush();
  }

  void add(const hexsolver::Motion& motion) {
    if (!embedded_) {
      const hexsolver::Mesh& mesh = motion.mesh();
      const hexmesh::CellLocator locator(lattice_.voxels, motion.voxels_per_cell(), mesh.cells());
      embedded_.emplace(locator, mesh.cell_nodes(), lattice_.surface.points);
    }
    const hexsolver::NodeVector& u = motion.displacement();
    embedded_->interpolate({u.data(), static_cast<std::size_t>(u.size())}, moved_);
    positions_.clear();
    for (std::size_t p = 0; p < moved_.size(); ++p)
      for (int d = 0; d < 3; ++d)
        positions_.push_back(static_cast<float>(lattice_.surface.points[p][d] + moved_[p][d]));
    const double time = motion.time();
    write(&time, 1);
    write(positions_.data(), positions_.size());
    flush();
  }

private:
  template <class T>
  void write(const T* values, std::size_t count) {
    if (std::fwrite(values, sizeof(T), count, stdout) != count) fail();
  }
  void flush() {
    if (std::fflush(stdout) != 0) fail();
  }
  [[noreturn]] static void fail() { throw Error(ErrorKind::output, "cannot write the stream to standard output"); }

  const hexmesh::Lattice& lattice_;
  std::optional<hexmesh::EmbeddedPoints> embedded_;
  std::vector<hexmesh::Vec3> moved_;
  std::vector<float> positions_;
};

void check_stream(const Options& o, const hexsolver::Scene& scene) {
  if (!o.stream) return;
  if (!scene.dynamics) throw Error(ErrorKind::usage, "--stream goes with a motion, expected solve.kind = \"dynamics\"");
  if (o.output == "-" || o.report == "-")
    throw Error(ErrorKind::usage, "--stream takes standard output, expected -o and --report with a file or none");
}

/// Solves the motion; its steps go to the result's file and to the stream as they come.
hexmesh::Result move(const hexmesh::Lattice& lattice, const hexsolver::Scene& scene, int level, SolveReport& report,
                     hexmesh::ResultWriter* writer, bool streams, const Console& console) {
  std::optional<SurfaceStream> stream;
  // A reader that leaves ends the stream; where there is a file to write, not the motion.
  const auto to_stream = [&](double time, auto&& write) {
    try {
      write();
    } catch (const Error& e) {
      if (!writer || e.kind() != ErrorKind::output) throw;
      console.warning(fmt::format("{} at {:.4g} s: the motion goes on to its file", e.what(), time));
      stream.reset();
    }
  };
  if (streams) to_stream(0, [&] { stream.emplace(lattice); });
  const auto span = [](const hexsolver::NodeVector& v) {
    return std::span<const double>(v.data(), static_cast<std::size_t>(v.size()));
  };
  const auto on_output = [&](const hexsolver::Motion& motion) {
    if (writer) writer->add_step(motion.time(), span(motion.displacement()), span(motion.velocity()));
    if (stream && motion.counts().steps == 0) to_stream(0, [&] { stream->add(motion); });
  };
  const auto on_step = [&](const hexsolver::Motion& motion) {
    if (stream) to_stream(motion.time(), [&] { stream->add(motion); });
    if (console.shows_progress())
      console.progress(fmt::format("{:.4g} of {:.4g} s, kinetic energy {:.3g} N mm", motion.time(),
                                   scene.dynamics->duration, motion.energies().kinetic));
  };
  return hexsolver::solve_dynamics(lattice, scene, level, report, on_output, on_step);
}

int run(const Options& o, const CommonOptions& common, const Console& console) {
  const double start = omp_get_wtime();
  const hexmesh::InputFile lattice_file(o.lattice);
  if (o.example) {
    write_text(o.output.empty() ? "-" : o.output,
               hexsolver::example_scene(hexmesh::read_lattice(lattice_file.path(), {-1})), common);
    return 0;
  }
  const bool solves = !o.check && !o.plan;
  if (o.scene.empty() || (solves && o.output.empty() && !o.stream))
    throw Error(ErrorKind::usage, fmt::format("{} is missing, expected hexsolve LATTICE SCENE -o RESULT",
                                              o.scene.empty() ? "SCENE" : "-o RESULT"));
  if (o.scene == "-") throw Error(ErrorKind::usage, "SCENE is -, expected a file");
  const hexmesh::InputFile scene_file(o.scene);
  hexsolver::Scene scene = hexsolver::read_scene(scene_file.path(), o.scene, o.settings);
  if (scene.dynamics && (o.accuracy || o.budget))
    throw Error(ErrorKind::usage,
                fmt::format("{} goes with an equilibrium, but the scene is a motion, expected --level",
                            o.accuracy ? "--accuracy" : "--budget"));
  for (const std::string& w : scene.warnings) console.warning(w);
  if (o.level || o.accuracy || o.budget) {
    scene.level = o.level;
    scene.accuracy = o.accuracy;
    scene.budget = o.budget;
  }
  check_stream(o, scene);
  std::vector<std::string> inputs = {o.lattice, o.scene};
  if (scene.dynamics && !scene.dynamics->start.empty()) inputs.push_back(scene.dynamics->start.string());
  std::unique_ptr<hexmesh::OutputFile> output;
  if (solves && !o.output.empty()) output = open_output(o.output, "", common, inputs);
  std::unique_ptr<hexmesh::OutputFile> report_file;
  if (solves && !o.report.empty()) report_file = open_output(o.report, "", common, inputs);

  const hexmesh::Lattice lattice = [&] {
    std::vector<int> wanted;
    if (scene.level && *scene.level > 0 &&
        scene.islands == hexsolver::Islands::error)  // the levels of an accuracy or a budget are not known yet
      for (int n = *scene.level; n < hexmesh::count_levels(lattice_file.path()); ++n) wanted.push_back(n);
    return hexsolver::with_overrides(hexmesh::read_lattice(lattice_file.path(), wanted), scene);
  }();
  if (o.level && *o.level >= static_cast<int>(lattice.levels.size()))
    throw Error(ErrorKind::usage, fmt::format("--level is {}, expected 0 to {}", *o.level, lattice.levels.size() - 1));
  int level = hexsolver::finest_level(scene, lattice);
  if (o.check) return show_check(hexsolver::check_scene(lattice, scene, level), o, common, console);
  if (o.plan) return show_plan(hexsolver::plan_solution(lattice, scene, level), o, common);
  const double read_done = omp_get_wtime();
  level = fit_into_memory(o, lattice, level, scene, console);

  SolveReport report;
  hexsolver::SolveProgress progress;
  if (console.shows_progress())
    progress = [&](int number, double load, int step, double residual, int linear) {
      console.progress(fmt::format("level {}, load {:.3g}, Newton step {}: residual {:.2e}, {} linear iterations",
                                   number, load, step, residual, linear));
    };
  std::optional<hexmesh::ResultWriter> writer;
  if (output && scene.dynamics) writer.emplace(output->path());
  hexmesh::Result result = scene.dynamics
                               ? move(lattice, scene, level, report, writer ? &*writer : nullptr, o.stream, console)
                               : hexsolver::solve_equilibrium(lattice, scene, level, report, progress);

  json summary = to_json(report, scene);
  result.history = lattice.history;
  result.history.push_back(solve_history(o.lattice, lattice_file.path(), o.scene, scene_file.path(), scene));
  result.report = summary.dump();
  result.costs = costs_of(report, read_done - start).dump();
  const double solve_done = omp_get_wtime();
  if (writer)
    writer->finish(result);
  else if (output)
    hexmesh::write_result(result, output->path());
  if (output) output->commit();
  summary["seconds"] = {{"read", read_done - start},
                        {"setup", report.setup_seconds},
                        {"solve", report.solve_seconds},
                        {"write", omp_get_wtime() - solve_done},
                        {"total", omp_get_wtime() - start}};
  add_costs(summary, report);
  for (const std::string& w : report.warnings) console.warning(w);
  summarize(report, console);
  if (report_file) {
    write_whole(report_file->path(), summary.dump(2) + "\n");
    report_file->commit();
  }
  if (report.accuracy_missed) {
    fmt::print(stderr, "hexsolve: error: accuracy not reached: {}; '{}' holds that level, solved\n", report.reason,
               o.output);
    return exit_not_converged;
  }
  if (report.converged) return 0;
  fmt::print(stderr, "hexsolve: error: not converged: {}{}\n", report.reason,
             output ? fmt::format("; '{}' holds {}, marked so", o.output,
                                  report.load_fraction > 0 ? "the last state that did" : "the state at the start")
                    : "");
  return exit_not_converged;
}

}  // namespace

int main(int argc, char** argv) {
  auto o = std::make_shared<Options>();
  return run_tool(
      argc, argv,
      {"hexsolve", "Solve a lattice under a scene (TOML): its static equilibrium, or its motion.",
       "hexsolve liver.hexmesh liver.toml --level 2 -o liver.hexresult",
       [o](CLI::App& app, const CommonOptions& common, const Console& console) -> std::function<int()> {
         app.add_option("lattice", o->lattice, "Lattice file of hexmesh build; - is standard input")->required();
         app.add_option("scene", o->scene, "Scene file (TOML)");
         CLI::Option* level = app.add_option(
             "--level", o->level,
             "Mechanical level, 0 = voxels; without it and what the scene says the finest of at most 20000 cells");
         CLI::Option* accuracy = app.add_option(
             "--accuracy", o->accuracy, "Solve to the first level whose estimated mean error is at most this, in mm");
         CLI::Option* budget =
             app.add_option("--budget", o->budget, "Solve as many levels, coarse to fine, as this many seconds allow");
         app.add_option("--max-memory", o->max_memory_mb,
                        "Take longer rather than more memory than this, or refuse [MB]; default: four fifths of the "
                        "machine's")
             ->check(CLI::PositiveNumber);
         const CLI::Validator positive(
             [](const std::string& text) {
               double value = 0;
               const bool good = CLI::detail::lexical_cast(text, value) && value > 0 && std::isfinite(value);
               return good ? std::string() : fmt::format("is {}, expected a number > 0", text);
             },
             "NUMBER > 0");
         level->check(CLI::Range(0, 30))->excludes(accuracy)->excludes(budget);
         accuracy->check(positive)->excludes(budget);
         budget->check(positive);
         add_repeated(app, "--set", o->settings, "KEY=VALUE: override a key of the scene, e.g. solve.strain=cauchy");
         app.add_flag("--example", o->example,
                      "Print a scene for this lattice: three places held, a fourth pulled by 40 mm");
         CLI::Option* check =
             app.add_flag("--check", o->check, "Only say what each condition selects and whether every part is held");
         CLI::Option* plan =
             app.add_flag("--plan", o->plan,
                          "Only say which effects are on, why, and what the solution is expected to cost")
                 ->excludes(check);
         app.add_flag("--stream", o->stream,
                      "Write the moving surface of a motion to standard output, step by step (FORMATS.md, \"Stream\")")
             ->excludes(check)
             ->excludes(plan);
         app.add_option("--report", o->report, "Write a JSON report; - is standard output");
         app.add_option("-o,--output", o->output, "Result file (.hexresult, HDF5); - is standard output");
         return [=, &common, &console] { return run(*o, common, console); };
       }});
}
