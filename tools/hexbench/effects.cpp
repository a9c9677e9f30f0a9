// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <optional>

#include "commands.h"
#include "hexsolver/equilibrium/equilibrium.h"
#include "scene_options.h"
#include "statistics.h"

namespace hextools {
namespace {

using nlohmann::json;

/// Mean and largest difference of two displacements, averaged over the filled part of each cell first [mm].
std::pair<double, double> change(const hexmesh::Result& from, const hexmesh::Result& to) {
  const std::vector<double>& fill = to.cell_fields.at("fill");
  double sum = 0, weight = 0, largest = 0;
  for (std::size_t c = 0; c < to.cells.size(); ++c) {
    hexmesh::Vec3 mean = hexmesh::Vec3::Zero();
    for (const auto n : to.cell_nodes[c]) {
      const auto node = static_cast<std::size_t>(n);
      mean += (to.displacement[node] - from.displacement[node]) / 8;
    }
    sum += fill[c] * mean.norm();
    weight += fill[c];
    largest = std::max(largest, mean.norm());
  }
  return {sum / weight, largest};
}

/// The scene as it is, taken apart: first linear elasticity alone, then one effect after the other.
std::vector<std::pair<std::string, hexsolver::Scene>> one_effect_after_the_other(const hexsolver::Scene& whole) {
  using hexsolver::Elasticity;
  hexsolver::Scene scene = whole;
  scene.finds_strain = false;
  scene.name_level({});
  scene.elasticity = Elasticity::cauchy;
  scene.volumetric = hexsolver::Volumetric::full;
  scene.gravity.setZero();
  scene.forces.clear();
  scene.contacts.clear();
  std::vector<std::pair<std::string, hexsolver::Scene>> steps = {{"linear elasticity", scene}};
  if (whole.volumetric == hexsolver::Volumetric::mean) {
    scene.volumetric = whole.volumetric;
    steps.emplace_back("near-incompressibility", scene);
  }
  if (whole.gravity != hexmesh::Vec3::Zero()) {
    scene.gravity = whole.gravity;
    steps.emplace_back("gravity", scene);
  }
  if (!whole.forces.empty()) {
    scene.forces = whole.forces;
    steps.emplace_back("forces", scene);
  }
  if (whole.elasticity != Elasticity::cauchy) {
    scene.elasticity = Elasticity::corotational;
    steps.emplace_back("rotation", scene);
  }
  if (!whole.contacts.empty()) {
    scene.contacts = whole.contacts;
    steps.emplace_back("contact", scene);
  }
  if (hexsolver::is_hyperelastic(whole.elasticity)) {
    scene.elasticity = whole.elasticity;
    steps.emplace_back("large strain", scene);
  }
  return steps;
}

/// What each effect of a scene costs and changes.
json bench_effects(const SceneOnLevel& whole, int repeats, const Console& console) {
  json rows = json::array();
  std::optional<hexmesh::Result> before;  // the last one that converged
  double first_seconds = 0;
  for (const auto& [name, scene] : one_effect_after_the_other(whole.scene)) {
    hexsolver::SolveReport report;
    std::optional<hexmesh::Result> result;
    const double seconds = median_seconds_of(repeats, [&, &of = scene] {
      hexsolver::Outcome outcome = hexsolver::solve_equilibrium(whole.lattice, of, whole.level);
      result = std::move(outcome.result);
      report = std::move(outcome.report);
    });
    if (first_seconds == 0) first_seconds = seconds;
    std::size_t bytes = 0;
    for (const auto& entry : report.bytes) bytes += entry.second;
    json row = {{"effect", name},
                {"converged", report.converged},
                {"seconds", seconds},
                {"time_over_linear", seconds / first_seconds},
                {"memory_mb", static_cast<double>(bytes) / (1 << 20)},
                {"newton_iterations", report.levels.back().newton.iterations}};
    std::string words;
    if (before && report.converged) {
      const auto [mean, largest] = change(*before, *result);
      row["change_mm"] = {{"mean", mean}, {"max", largest}};
      words = fmt::format(", changes the displacement by {:.3g} mm on average, {:.3g} at most", mean, largest);
    }
    console.note(fmt::format("{}{}: {:.2g} s, {:.1f} times linear, {:.3g} MB{}", name,
                             report.converged ? "" : " (not converged)", seconds, seconds / first_seconds,
                             static_cast<double>(bytes) / (1 << 20), words));
    rows.push_back(std::move(row));
    if (report.converged) before = std::move(result);
  }
  const std::size_t cells = whole.lattice.levels[static_cast<std::size_t>(whole.level)].cells.size();
  return {{"level", whole.level}, {"cells", cells}, {"effects", rows}};
}

}  // namespace

std::function<int()> declare_effects(CLI::App& app, const CommonOptions& common, const Console& console) {
  const auto o = add_scene_options(app);
  const auto measure = [](const SceneOnLevel& on, const SceneOptions& options, const Console& talk) {
    return bench_effects(on, options.repeats, talk);
  };
  return run_on_scene(o, false, measure, common, console);
}

}  // namespace hextools
