// SPDX-License-Identifier: Apache-2.0
#include "level/cell_changes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace hexsolver {
namespace {

constexpr double least_stretch = 0.7, most_stretch = 1.4;  // where Hooke's law is meant for
constexpr double small_degrees = 10;
constexpr double nearly_incompressible = 0.45;  // Poisson's ratios above
constexpr double much_volume = 0.1;             // of a cell, gained against no resistance
constexpr double allowed_part = 0.05;           // of the cells

/// The measures of the cells of a result.
struct Fields {
  explicit Fields(const hexmesh::Result& r)
      : fill(r.cell_fields.at("fill")),
        longest(r.cell_fields.at("principal_stretch_1")),
        middle(r.cell_fields.at("principal_stretch_2")),
        shortest(r.cell_fields.at("principal_stretch_3")),
        rotation(r.cell_fields.at("rotation_degrees")),
        poisson(r.cell_fields.at("poisson_ratio")),
        jacobian(r.cell_fields.at("min_jacobian")),
        volume_ratio(r.cell_fields.at("volume_ratio")),
        inverted(r.cell_fields.at("inverted_part")) {
    for (std::size_t d = 0; d < 3; ++d)
      if (const auto field = r.cell_fields.find(fmt::format("prestretch_{}", d + 1)); field != r.cell_fields.end())
        prestretch[d] = &field->second;
  }
  /// Of the stretch that the cell has at rest: by how much it is larger there than without stress.
  double volume_at_rest(std::size_t c) const {
    double out = 1;
    for (const std::vector<double>* stretches : prestretch)
      if (stretches) out *= (*stretches)[c];
    return out;
  }
  const std::vector<double>&fill, &longest, &middle, &shortest, &rotation, &poisson, &jacobian, &volume_ratio,
      &inverted;
  std::array<const std::vector<double>*, 3> prestretch = {};  ///< null: none
};

/// By how much Hooke's law misses the change of volume of a cell: it resists tr(S - 1) and not J - 1.
void count_volume(const Fields& of, std::size_t c, CellChanges& changes) {
  const double fill = of.fill[c], gained = of.volume_ratio[c] - 1;
  changes.volume += fill;
  changes.gained += fill * gained;
  changes.least_ratio = std::min(changes.least_ratio, 1 + gained);
  changes.largest_ratio = std::max(changes.largest_ratio, 1 + gained);
  if (!(of.poisson[c] > nearly_incompressible + 1e-6)) return;
  const double trace = of.longest[c] + of.middle[c] + of.shortest[c] - 3;
  const double elastic = of.volume_ratio[c] * of.volume_at_rest(c) - 1;
  changes.kept_volume += fill;
  changes.kept_gained += fill * elastic;
  changes.unresisted += fill * (elastic - trace);
  if (std::abs(elastic - trace) > much_volume) changes.much_unresisted += fill;
}

void warn_of_inverted(const SolveReport& report, std::vector<std::string>& warnings) {
  if (report.inverted_cells > 0)
    warnings.push_back(
        fmt::format("{} voxels of {} cells are inverted, least Jacobian {:.2g}: there the solution has "
                    "no meaning",
                    report.inverted_voxels, report.inverted_cells, report.min_jacobian));
  else if (report.min_jacobian < (report.matches.empty() ? 0.1 : 0.2))
    warnings.push_back(fmt::format("the least Jacobian is {:.2g}: cells are nearly flat there, trust little{}",
                                   report.min_jacobian,
                                   report.matches.empty() ? "" : "; is a target or a landmark wrong?"));
}

void warn_of_volume(const CellChanges& changes, std::vector<std::string>& warnings) {
  constexpr double allowed_in_all = 0.01;
  if (changes.kept_volume == 0) return;
  const double in_all = changes.unresisted / changes.kept_volume, part = changes.much_unresisted / changes.kept_volume;
  if (std::abs(in_all) <= allowed_in_all && part <= allowed_part) return;
  warnings.push_back(
      fmt::format("nearly incompressible material changes its volume by {:.2g} % in all, and {:.2g} % of it by more "
                  "than {:g} %: at such strains Hooke's law does not keep it, law = \"neo-hookean\" does",
                  100 * changes.kept_gained / changes.kept_volume, 100 * part, 100 * much_volume));
}

}  // namespace

CellChanges count_changes(const hexmesh::Result& result, std::size_t first, std::size_t count) {
  const Fields of(result);
  const Index3& n = result.voxels_per_cell;
  const double voxels = 1.0 * n[0] * n[1] * n[2];
  CellChanges changes;
  changes.cells = count;
  for (std::size_t c = first; c < first + count; ++c) {
    changes.strained += of.longest[c] > most_stretch || of.shortest[c] < least_stretch;
    changes.turned += of.rotation[c] > small_degrees;
    changes.inverted += of.jacobian[c] <= 0;
    changes.inverted_voxels += static_cast<std::size_t>(std::ceil(of.fill[c] * voxels * of.inverted[c] - 1e-6));
    changes.least_jacobian = std::min(changes.least_jacobian, of.jacobian[c]);
    count_volume(of, c, changes);
  }
  return changes;
}

void report_changes(const CellChanges& changes, SolveReport& report) {
  report.min_jacobian = changes.least_jacobian;
  report.inverted_cells = changes.inverted;
  report.inverted_voxels = changes.inverted_voxels;
  report.volume_change = changes.gained / changes.volume;
  report.least_volume_ratio = changes.least_ratio;
  report.largest_volume_ratio = changes.largest_ratio;
  warn_of_inverted(report, report.warnings);
  const auto part = [&](std::size_t count) { return static_cast<double>(count) / static_cast<double>(changes.cells); };
  if (!is_hyperelastic(report.elasticity)) {
    if (part(changes.strained) > allowed_part)
      report.warnings.push_back(
          fmt::format("{:.0f} % of the cells are stretched beyond {:g} to {:g}: Hooke's law is for small strain, "
                      "law = \"neo-hookean\" for large",
                      100 * part(changes.strained), least_stretch, most_stretch));
    warn_of_volume(changes, report.warnings);
  }
  if (report.elasticity == Elasticity::cauchy && part(changes.turned) > allowed_part)
    report.warnings.push_back(fmt::format(
        "{:.0f} % of the cells rotate by more than {:g} degrees, which strain = \"cauchy\" takes for strain; the "
        "error estimate does not know",
        100 * part(changes.turned), small_degrees));
}

}  // namespace hexsolver
