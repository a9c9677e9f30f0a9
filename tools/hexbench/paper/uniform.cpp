// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <cmath>
#include <limits>

#include "hexbench/experiments.h"
#include "hexmesh/scan/phantom.h"
#include "measurements.h"

namespace hextools::paper {
namespace {

using hexmesh::Lattice;
using hexmesh::Vec3;

struct Case {
  std::string name;
  Experiment experiment;
};

std::vector<Case> make_cases() {
  std::vector<Case> cases;
  cases.push_back({"liver, four patches moved", liver_experiment(0.3)});
  Experiment hanging = liver_experiment(0.3);
  hanging.scene.gravity = {0, 0, -9810};
  hanging.scene.conditions = {beyond("right end", {-65, 0, 0}, {-1, 0, 0}, Vec3::Zero())};
  cases.push_back({"liver under its weight", std::move(hanging)});
  for (const auto& [name, options] : {std::pair<const char*, hexmesh::LatticeOptions>{"beam under its weight", {}},
                                      {"beam, shifted", {0, {3, 1, 2}}}}) {
    Experiment e{lattice_of(hexmesh::solid_phantom({}), 300, 0.3, options), {}};
    e.scene.gravity = {0, 0, -9810};
    e.scene.conditions = {beyond("end", {-80, 0, 0}, {-1, 0, 0}, Vec3::Zero())};
    cases.push_back({name, std::move(e)});
  }
  for (const auto& [name, options] : {std::pair<const char*, hexmesh::LatticeOptions>{"cylinder, pressed by 10 %", {}},
                                      {"cylinder, shifted", {0, {3, 5, 2}}}}) {
    Experiment e{lattice_of(cylinder_phantom(), 100, 0.49, options), {}};
    e.scene.conditions = pressed(0.1);
    cases.push_back({name, std::move(e)});
  }
  return cases;
}

/// A level of a case, solved with the paper's cells and with averaged ones.
struct Level {
  int number;
  Outcome ours, averaged;
  double of_ours, of_averaged;  ///< mean distance to the voxels [mm]
};

Level solve_level(const Experiment& experiment, int number, const std::vector<Vec3>& voxels,
                  const std::vector<Vec3>& limit) {
  const auto solved = [&](Method::Kind kind) {
    Method m{kind};
    m.level = number;
    return run(m, experiment);
  };
  Outcome ours = solved(Method::Kind::cells), averaged = solved(Method::Kind::uniform_cells);
  const double of_ours = distances(ours.at(voxels), limit).mean,
               of_averaged = distances(averaged.at(voxels), limit).mean;
  return {number, std::move(ours), std::move(averaged), of_ours, of_averaged};
}

/// @param fine        the voxels
/// @param of_coarser  distance of the level before [mm]
Row row_of(const Case& c, const Level& level, const Outcome& fine, double of_coarser) {
  const Lattice& lattice = c.experiment.lattice;
  const auto& [number, ours, averaged, of_ours, of_averaged] = level;
  const hexmesh::Level& cells = lattice.levels[static_cast<std::size_t>(number)];
  std::size_t boundary = 0;
  for (std::size_t n = 0; n < cells.cells.size(); ++n) boundary += cells.is_boundary(n);
  Row row = {{"case", fmt::format("{}, {:.0f} mm cells [mm]", c.name, lattice.cell_size(number).mean())},
             {"paper", nullptr},
             {"ours", of_ours},
             {"reference", nullptr},
             {"uniform", of_averaged}};
  row["boundary_cells"] = static_cast<double>(boundary) / static_cast<double>(cells.cells.size());
  const double energy = ours.strain_energy / fine.strain_energy,
               averaged_energy = averaged.strain_energy / fine.strain_energy;
  row["energy"] = energy;
  row["uniform_energy"] = averaged_energy;
  std::string reading =
      boundary == 0
          ? "no cell is partly filled: both are the same"
          : fmt::format(
                "averaged cells {:.3f} mm, {:.2f} times as far from the voxels; energy over theirs {:.3f}, of "
                "averaged cells {:.3f}; {:.0f} % of the cells are partly filled",
                of_averaged, of_averaged / of_ours, energy, averaged_energy,
                100.0 * static_cast<double>(boundary) / static_cast<double>(cells.cells.size()));
  if (boundary > 0 && of_averaged < of_ours && std::abs(averaged_energy - 1) > std::abs(energy - 1))
    reading +=
        ". All that moves the body is prescribed: one that is too stiff everywhere takes the same shape, and "
        "its excess is in the energy, the force on the patches";
  if (of_ours > of_coarser) reading += ". More than on the level before: other nodes hold the support";
  row["reading"] = fine.converged && ours.converged && averaged.converged ? reading : "NOT CONVERGED; " + reading;
  return row;
}

}  // namespace

/// Cells that know where they are empty against averaged ones, on every level: mean distance to the voxels, and the
/// strain energy over theirs.
std::vector<Row> uniform(const Console& console) {
  constexpr std::size_t least_cells = 30;
  std::vector<Row> rows;
  for (const Case& c : make_cases()) {
    const Lattice& lattice = c.experiment.lattice;
    const std::vector<Vec3> voxels = material_points(lattice);
    const Outcome fine = run({Method::Kind::cells}, c.experiment);
    const std::vector<Vec3> limit = fine.at(voxels);
    double of_coarser = std::numeric_limits<double>::infinity();
    for (int number = static_cast<int>(lattice.levels.size()) - 1; number > 0; --number) {
      if (lattice.levels[static_cast<std::size_t>(number)].cells.size() < least_cells) continue;
      const Level level = solve_level(c.experiment, number, voxels, limit);
      rows.push_back(row_of(c, level, fine, of_coarser));
      of_coarser = level.of_ours;
    }
    console.note(fmt::format("uniform: {} done", c.name));
  }
  return rows;
}

}  // namespace hextools::paper
