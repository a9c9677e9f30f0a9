// SPDX-License-Identifier: Apache-2.0
#include "speed.h"

#include <fmt/format.h>
#include <omp.h>

#include <algorithm>
#include <cstring>
#include <optional>

#include "hexmesh/lattice/element_tree.h"
#include "hexsolver/plan.h"
#include "statistics.h"

namespace hextools {
namespace {

using hexmesh::Lattice;
using nlohmann::json;

template <class F>
double median_seconds_of(int repeats, F&& f) {
  std::vector<double> seconds;
  for (int n = 0; n < repeats; ++n) seconds.push_back(seconds_of(f));
  return median(seconds);
}

/// Bytes read and written per second by memcpy of 256 MB.
double copy_bandwidth(int repeats) {
  constexpr std::size_t size = std::size_t{1} << 28;
  std::vector<char> from(size, 1), to(size);
  return 2.0 * size / median_seconds_of(repeats, [&] {
           std::memcpy(to.data(), from.data(), size);
           from[0] = to[size - 1];
         });
}

/// Mean and largest difference of two displacements, averaged over the filled part of each cell first [mm].
std::pair<double, double> change(const hexmesh::Result& from, const hexmesh::Result& to) {
  const std::vector<double>& fill = to.cell_fields.at("fill");
  double sum = 0, weight = 0, largest = 0;
  for (std::size_t c = 0; c < to.cells.size(); ++c) {
    hexmesh::Vec3 mean = hexmesh::Vec3::Zero();
    for (const std::int32_t n : to.cell_nodes[c])
      mean += (to.displacement[static_cast<std::size_t>(n)] - from.displacement[static_cast<std::size_t>(n)]) / 8;
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
  scene.accuracy.reset();
  scene.budget.reset();
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

}  // namespace

json bench_lattice(const Lattice& lattice, int repeats) {
  double checksum = 0;
  std::size_t elements = 0;
  const double seconds = median_seconds_of(repeats, [&] {
    hexmesh::ElementTree tree(lattice);
    elements = 0;
    for (int l = 0; l < static_cast<int>(lattice.levels.size()); ++l) {
      const auto count = static_cast<std::int32_t>(lattice.levels[static_cast<std::size_t>(l)].filled.size());
      for (std::int32_t e = 0; e < count; ++e) checksum += tree.form(l, e).shear[0];
      elements += static_cast<std::size_t>(count);
    }
  });
  const auto voxels = static_cast<double>(lattice.levels.front().cells.size());
  json report = {{"voxels", voxels},
                 {"levels", lattice.levels.size()},
                 {"elements", elements},
                 {"seconds", seconds},
                 {"voxels_per_second", voxels / seconds},
                 {"copy_bytes_per_second", copy_bandwidth(repeats)},
                 {"checksum", checksum}};
  report["copied_bytes_per_voxel_time"] = report["copy_bytes_per_second"].get<double>() / (voxels / seconds);
  return report;
}

json bench_solver(const Lattice& lattice, const hexsolver::Scene& scene, int level, int repeats) {
  const hexsolver::SolverTimes t = hexsolver::measure_solver(lattice, scene, level, repeats);
  return {{"level", level},
          {"cells", t.cells},
          {"dofs", t.dofs},
          {"threads", omp_get_max_threads()},
          {"product_seconds", t.product},
          {"single_product_seconds", t.single_product},
          {"cells_per_second", static_cast<double>(t.cells) / t.product},
          {"linearize_products", t.linearize / t.product},
          {"linearize_clamped_products", t.clamp / t.product},
          {"multigrid_set_up_products", t.set_up / t.product},
          {"cycle_products", t.cycle / t.product}};
}

json bench_effects(const Lattice& lattice, const hexsolver::Scene& whole, int level, int repeats,
                   const Console& console) {
  json rows = json::array();
  std::optional<hexmesh::Result> before;  // the last one that converged
  double first_seconds = 0;
  for (const auto& [name, scene] : one_effect_after_the_other(whole)) {
    hexsolver::SolveReport report;
    std::optional<hexmesh::Result> result;
    const double seconds = median_seconds_of(repeats, [&, &of = scene] {
      report = {};
      result = hexsolver::solve_equilibrium(lattice, of, level, report);
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
  return {{"level", level}, {"cells", lattice.levels[static_cast<std::size_t>(level)].cells.size()}, {"effects", rows}};
}

}  // namespace hextools
