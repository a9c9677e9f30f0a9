// SPDX-License-Identifier: Apache-2.0
#include "spread.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "cli/progress.h"
#include "cli/solve_run.h"
#include "hexmesh/result/result.h"

namespace hextools {
namespace {

using hexmesh::Lattice;
using hexmesh::LatticeSegment;
using hexmesh::Vec3;
using hexsolver::Scene;

constexpr double factor = 2;  ///< of contrasts

struct Variant {
  std::string of;
  Scene scene;
};

/// f(material in kPa, what replaces it) for each segment with one.
template <class F>
void replace_materials(const Lattice& lattice, Scene& scene, const F& f) {
  for (const LatticeSegment& s : lattice.segments)
    if (s.material) f(*s.material, scene.materials[s.segment.name]);
}

std::vector<Variant> variants_of(const Lattice& lattice, const Scene& scene) {
  std::vector<Variant> out;
  double least = 0.5, logs = 0;
  double softest = std::numeric_limits<double>::infinity(), stiffest = 0;
  int count = 0;
  for (const LatticeSegment& s : lattice.segments)
    if (s.material) {
      least = std::min(least, s.material->poisson);
      logs += std::log(s.material->young);
      softest = std::min(softest, s.material->young);
      stiffest = std::max(stiffest, s.material->young);
      ++count;
    }
  const double poisson = least < 0.4 ? 0.45 : 0.3;
  out.push_back({fmt::format("Poisson's ratio {:g} everywhere", poisson), scene});
  replace_materials(lattice, out.back().scene, [&](const auto&, auto& change) { change.poisson = poisson; });
  if (stiffest > (1 + 1e-9) * softest) {
    out.push_back({fmt::format("contrasts of Young's moduli times {:g}", factor), scene});
    const double middle = std::exp(logs / count);
    replace_materials(lattice, out.back().scene, [&](const hexmesh::Material& m, auto& change) {
      change.young_kpa = 1e3 * m.young * (m.young >= middle ? std::sqrt(factor) : 1 / std::sqrt(factor));
    });
  }
  return out;
}

/// The mean over the material, the largest over the picture surface.
Spread difference(const std::string& of, const hexmesh::Result& a, const hexmesh::Result& b) {
  Spread out{of};
  const std::vector<double>& fill = a.cell_fields.at("fill");
  double weight = 0;
  for (std::size_t c = 0; c < a.cells.size(); ++c) {
    Vec3 change = Vec3::Zero();  // in the middle of the cell
    for (const std::int32_t n : a.cell_nodes[c])
      change += (b.displacement[hexmesh::as_size(n)] - a.displacement[hexmesh::as_size(n)]) / 8;
    out.mean_mm += fill[c] * change.norm();
    weight += fill[c];
  }
  out.mean_mm /= weight;
  for (std::size_t n = 0; n < a.surface_displacement.size(); ++n)
    out.largest_mm = std::max(out.largest_mm, (b.surface_displacement[n] - a.surface_displacement[n]).norm());
  return out;
}

}  // namespace

std::vector<Spread> find_spread(const Lattice& lattice, const std::filesystem::path& file, const Scene& fitted,
                                const hexsolver::Outcome& fit, const Console& console) {
  Scene scene = fitted;
  scene.error_estimation = hexsolver::ErrorEstimation::off;
  scene.pose = fit.report.pose;
  const int level = fit.report.levels.back().level;
  scene.keep_cells();
  scene.name_level(level);
  const std::vector<Vec3>* start = fit.report.dropped_cells == 0 ? &fit.result.displacement : nullptr;
  std::vector<Spread> out;
  for (const Variant& variant : variants_of(lattice, scene)) {
    at_work("solving with " + variant.of);
    int same = 0;
    const hexsolver::Outcome other = hexsolver::solve_equilibrium(read_lattice(file, variant.scene, level, true, same),
                                                                  variant.scene, level, {}, start);
    if (!other.report.converged) {
      console.warning(
          fmt::format("how far the fit depends on it is unknown: with {} there is no solution", variant.of));
      continue;
    }
    out.push_back(difference(variant.of, fit.result, other.result));
  }
  return out;
}

}  // namespace hextools
