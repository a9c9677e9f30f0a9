// SPDX-License-Identifier: Apache-2.0
#include "level/cell_changes.h"

#include <fmt/format.h>

#include <algorithm>

namespace hexsolver {
namespace {

constexpr double least_stretch = 0.7, most_stretch = 1.4;  // where Hooke's law is meant for
constexpr double small_degrees = 10;

}  // namespace

CellChanges count_changes(const hexmesh::Result& result, std::size_t first, std::size_t count) {
  const std::vector<double>&longest = result.cell_fields.at("principal_stretch_1"),
        &shortest = result.cell_fields.at("principal_stretch_3"), &rotation = result.cell_fields.at("rotation_degrees"),
        &jacobian = result.cell_fields.at("min_jacobian");
  CellChanges changes;
  changes.cells = count;
  for (std::size_t c = first; c < first + count; ++c) {
    changes.strained += longest[c] > most_stretch || shortest[c] < least_stretch;
    changes.turned += rotation[c] > small_degrees;
    changes.inverted += jacobian[c] <= 0;
    changes.least_jacobian = std::min(changes.least_jacobian, jacobian[c]);
  }
  return changes;
}

void report_changes(const CellChanges& changes, SolveReport& report) {
  constexpr double allowed_part = 0.05;
  report.min_jacobian = changes.least_jacobian;
  report.inverted_cells = changes.inverted;
  if (report.inverted_cells > 0)
    report.warnings.push_back(
        fmt::format("{} cells are inverted, least Jacobian {:.2g}: there the solution has no meaning",
                    report.inverted_cells, report.min_jacobian));
  else if (report.min_jacobian < 0.1)
    report.warnings.push_back(
        fmt::format("the least Jacobian is {:.2g}: cells are nearly flat there, trust little", report.min_jacobian));
  const auto part = [&](std::size_t count) { return static_cast<double>(count) / static_cast<double>(changes.cells); };
  if (!is_hyperelastic(report.elasticity) && part(changes.strained) > allowed_part)
    report.warnings.push_back(
        fmt::format("{:.0f} % of the cells are stretched beyond {:g} to {:g}: Hooke's law is for small strain, "
                    "law = \"neo-hookean\" for large",
                    100 * part(changes.strained), least_stretch, most_stretch));
  if (report.elasticity == Elasticity::cauchy && part(changes.turned) > allowed_part)
    report.warnings.push_back(fmt::format(
        "{:.0f} % of the cells rotate by more than {:g} degrees, which strain = \"cauchy\" takes for strain; the "
        "error estimate does not know",
        100 * part(changes.turned), small_degrees));
}

}  // namespace hexsolver
