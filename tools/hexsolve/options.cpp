// SPDX-License-Identifier: Apache-2.0
#include "options.h"

#include <fmt/format.h>

#include <cmath>

#include "cli/parse.h"

namespace hextools {
namespace {

/// MM, or reaction=5% or reaction=0.05. @returns what is wrong
std::string read_accuracy(const std::string& text, SolveOptions& o) {
  const auto [key, value] = key_and_value(text);
  if (key != "reaction") {
    o.request.accuracy = parse_number<double>(text);
    return o.request.accuracy && *o.request.accuracy > 0 && std::isfinite(*o.request.accuracy)
               ? ""
               : fmt::format("'{}', expected a number > 0 in mm, or reaction=5%", text);
  }
  const bool is_percent = value.ends_with('%');
  const auto part = parse_number<double>(is_percent ? value.substr(0, value.size() - 1) : value);
  constexpr double least = 1e-6;
  if (part) o.request.reaction_accuracy = is_percent ? *part / 100 : *part;
  return part && *o.request.reaction_accuracy >= least && *o.request.reaction_accuracy <= 1
             ? ""
             : fmt::format("'{}', expected reaction=0.0001% to reaction=100%", text);
}

/// FINE, or FINE:COARSE. @returns what is wrong
std::string read_levels(const std::string& text, SolveOptions& o) {
  constexpr int most = hexsolver::most_levels;
  const std::size_t colon = text.find(':');
  o.request.level = parse_number<int>(text.substr(0, colon));
  const std::optional<int> coarsest =
      colon == std::string::npos ? o.request.level : parse_number<int>(text.substr(colon + 1));
  if (!o.request.level || !coarsest || *o.request.level < 0 || *coarsest < *o.request.level || *coarsest > most)
    return fmt::format("'{}', expected a level, 0 to {}, or two, FINE:COARSE", text, most);
  if (colon != std::string::npos) o.request.coarser_by = *coarsest - *o.request.level;
  return "";
}

}  // namespace

void add_options(CLI::App& app, SolveOptions& o) {
  app.add_option("lattice", o.lattice, "Lattice file of hexmesh build; - is standard input")->required();
  app.add_option("scene", o.scene, "Scene file (TOML); - is standard input");
  CLI::Option* level =
      app.add_option("--level", o.levels,
                     "Mechanical level, 0 = voxels; without it and what the scene says the finest of "
                     "at most 20000 cells. FINE:COARSE: "
                     "cells of level FINE where supports, forces and gaps end and obstacles press, larger "
                     "ones up to level COARSE elsewhere");
  CLI::Option* accuracy = app.add_option(
      "--accuracy", o.accuracy,
      "Solve to the first level whose estimated mean error is at most this, in mm; or reaction=5%: whose "
      "reactions are off by at most that part of the largest of them");
  CLI::Option* budget =
      app.add_option("--budget", o.request.budget, "Solve as many levels, coarse to fine, as this many seconds allow");
  level->check([&o](const std::string& text) { return read_levels(text, o); })->excludes(accuracy)->excludes(budget);
  accuracy->check([&o](const std::string& text) { return read_accuracy(text, o); })->excludes(budget);
  budget->check(positive_number);
  add_repeated(app, "--set", o.settings, "KEY=VALUE: override a key of the scene, e.g. solve.strain=cauchy");
  CLI::Option* example = app.add_flag(
      "--example", o.example,
      "Print a scene for this lattice: three places held, a fourth pulled by 40 mm, less where the body is "
      "thin or small");
  CLI::Option* check =
      app.add_flag("--check", o.check,
                   "Only say what each condition selects and whether every part is held; with -o a result at rest that "
                   "shows it in pictures (hexslice planes --scene)");
  CLI::Option* plan =
      app.add_flag("--plan", o.plan, "Only say which effects are on, why, and what the solution is expected to cost")
          ->excludes(check);
  app.add_flag("--stream{surface}", o.stream,
               "Write the moving surface of a motion to standard output, step by step (FORMATS.md, \"Stream\"); "
               "--stream=nodes: the displacements of its nodes")
      ->excludes(check)
      ->excludes(plan);
  CLI::Option* steer =
      app.add_option(
             "--steer", o.steer,
             "Commands to a motion while it is solved, from a file, a pipe or - (standard input): points of the "
             "surface that are grabbed and pulled, pause, end (FORMATS.md, \"Steering\")")
          ->check([](const std::string& name) { return name.empty() ? "is empty, expected a name" : ""; })
          ->excludes(check)
          ->excludes(plan);
  app.add_option("--record", o.record, "Write the commands that were carried out, with their times, for --steer")
      ->needs(steer);
  app.add_option("--report", o.report, "Write a JSON report; - is standard output");
  for (const char* other :
       {"scene", "--level", "--accuracy", "--budget", "--set", "--check", "--plan", "--stream", "--steer", "--report"})
    example->excludes(other);
  app.add_option("-o,--output", o.output, "Result file (.hexresult, HDF5); - is standard output");
}

}  // namespace hextools
