// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <map>

#include "hexbench/experiments.h"
#include "measurements.h"

namespace hextools::paper {
namespace {

using hexmesh::Lattice;
using hexsolver::Elasticity;
using hexsolver::Scene;
using hexsolver::Volumetric;

/// Radii on the circle half way between the plates over the radius times two: the paper's has 0.5.
Distances radii(const Outcome& s) {
  const std::vector<hexmesh::Vec3> rim = circle(cylinder_radius), u = s.at(rim);
  std::vector<double> r;
  for (std::size_t n = 0; n < rim.size(); ++n) r.push_back((rim[n] + u[n]).head<2>().norm() / (2 * cylinder_radius));
  return statistics(r);
}

struct PressedCylinder {
  double compression;              ///< of the height
  double ansys;                    ///< the paper's radius
  double linear, neo_hooke;        ///< of axisymmetric quadratic elements, clamped, height 1, nu = 0.49
  Distances fitted, badly_fitted;  ///< the paper's radii of its cells
};

// clang-format off
const std::array<PressedCylinder, 3> pressed_cylinders = {{
    {0.1, 0.5331052, 0.529657, 0.5321,
     {0.5435298, 0.5424220, 0.5446057, 0.0008812}, {0.5429189, 0.5412755, 0.5445390, 0.0009428}},
    {0.2, 0.5662103, 0.559314, 0.5692,
     {0.5835664, 0.5815420, 0.5855633, 0.0016283}, {0.5828810, 0.5796358, 0.5859284, 0.0018170}},
    {0.3, 0.5993155, 0.588971, 0.6111,
     {0.6194658, 0.6167130, 0.6222278, 0.0022409}, {0.6189712, 0.6141881, 0.6232140, 0.0026136}}}};
// clang-format on

/// The radii of a level of the cylinder under the compression.
struct Pressed {
  Distances radii;
  bool converged;
};

Pressed press(const Lattice& lattice, double compression, Elasticity law, Volumetric volumetric, int level) {
  Scene scene;
  scene.elasticity = law;
  scene.volumetric = volumetric;
  scene.conditions = pressed(compression);
  const Outcome outcome = solve(lattice, scene, level);
  return {radii(outcome), outcome.converged};
}

std::string percent(const PressedCylinder& p) { return fmt::format("{:.0f} %", 100 * p.compression); }

Row linear_row(const PressedCylinder& p, double linear) {
  return {{"case", percent(p) + ", linear, voxels"},
          {"paper", p.ansys},
          {"ours", linear},
          {"reference", p.linear},
          {"reading",
           fmt::format("the paper's Ansys radii are 0.5 + 0.331052 x compression to all digits: "
                       "linear, not Green-Lagrange; ours is {:+.2f} % of the bulge off the "
                       "reference, theirs {:+.0f} % (no clamped height gives it)",
                       100 * (linear - p.linear) / (p.linear - 0.5), 100 * (p.ansys - p.linear) / (p.linear - 0.5))}};
}

/// @param name    of the cells and how the lattice fits
/// @param limit   radius of small co-rotational cells
Row cells_row(const PressedCylinder& p, const std::string& name, const Pressed& cells, const Distances& theirs,
              double limit) {
  const Distances& ours = cells.radii;
  Row row = {{"case", fmt::format("{}, {}", percent(p), name)}, {"paper", theirs.mean}};
  row["ours"] = ours.mean;
  row["reference"] = limit;
  row["neo_hooke"] = p.neo_hooke;
  row["paper_std"] = theirs.deviation;
  row["ours_std"] = ours.deviation;
  row["ours_min"] = ours.min;
  row["ours_max"] = ours.max;
  row["reading"] = fmt::format(
      "{}co-rotational limit (5 mm cells) {:.4f}, neo-Hookean {:.4f}: ours is {:+.0f} % of the bulge off its "
      "limit, the paper's {:+.0f} %",
      cells.converged ? "" : "NOT CONVERGED; ", limit, p.neo_hooke, 100 * (ours.mean - limit) / (limit - 0.5),
      100 * (theirs.mean - limit) / (limit - 0.5));
  return row;
}

}  // namespace

std::vector<Row> table1(const Console& console) {
  const hexmesh::LabelVolume volume = cylinder_phantom();
  const Lattice well_fitted = lattice_of(volume, 100, 0.49),
                badly_fitted = lattice_of(volume, 100, 0.49, {0, {3, 5, 2}});
  std::vector<Row> rows;
  for (const PressedCylinder& p : pressed_cylinders) {
    const Pressed linear = press(well_fitted, p.compression, Elasticity::cauchy, Volumetric::mean, 0);
    rows.push_back(linear_row(p, linear.radii.mean));
    const Pressed fine = press(well_fitted, p.compression, Elasticity::corotational, Volumetric::mean, 1);
    const auto add = [&](const std::string& fit, const Lattice& lattice, const Distances& theirs) {
      for (const auto& [name, volumetric] :
           {std::pair{"mean dilatation", Volumetric::mean}, {"the paper's cells", Volumetric::full}})
        rows.push_back(cells_row(p, fmt::format("{}, 20 mm, {}", fit, name),
                                 press(lattice, p.compression, Elasticity::corotational, volumetric, 3), theirs,
                                 fine.radii.mean));
    };
    add("badly fitted", badly_fitted, p.badly_fitted);
    add("well fitted", well_fitted, p.fitted);
    console.note(fmt::format("table1: {} done", percent(p)));
  }
  return rows;
}

}  // namespace hextools::paper
