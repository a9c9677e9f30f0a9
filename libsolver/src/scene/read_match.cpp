// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/file/markup_file.h"
#include "hexmesh/file/surface_target.h"
#include "scene/read_tables.h"

namespace hexsolver {
namespace {

/// Places of a key: the points of a markup.
std::vector<Vec3> read_places(TomlReader& table, const char* key, const std::filesystem::path& folder, Match& match) {
  constexpr const char* expected = "a file of points (.mrk.json, .fcsv, .txt)";
  const auto name = table.text(key, expected);
  if (!name) return {};
  const std::filesystem::path path = folder / *name;
  const hexmesh::Markup markup = hexmesh::read_markup(path);
  if (markup.points.empty())
    table.fail_at(key, fmt::format("{} = '{}' has no points, expected {}", key, *name, expected));
  match.markups.push_back(path);
  return markup.points;
}

}  // namespace

Match read_match(TomlReader table, const std::filesystem::path& folder, std::size_t number) {
  Match m;
  m.where = table.where();
  m.name = table.text("name", "a name").value_or(fmt::format("match {}", number));
  const auto surface = table.text("surface", "a surface file that hexfit made (.hexsurface)");
  if (surface) {
    m.file = folder / *surface;
    m.target = hexmesh::read_surface_target(m.file);
  }
  m.from = read_places(table, "from", folder, m);
  m.to = read_places(table, "to", folder, m);
  m.segment = table.text("segment", "the name of a segment").value_or("");
  m.is_partial = table.flag("part");
  m.outliers = table.number("outliers_mm", 0, infinity, "a distance >= 0 mm");
  m.trust = table.number("trust_mm", 1e-6, infinity, "a distance > 0 mm").value_or(0);
  table.finish();
  if (surface.has_value() == !m.from.empty() || m.from.empty() != m.to.empty())
    table.fail_here("[[match]] expects surface, or from and to, two markups of the same points");
  if (m.from.size() != m.to.size())
    table.fail_here(
        fmt::format("[[match]] has {} points in from and {} in to, expected as many", m.from.size(), m.to.size()));
  if (!surface && (m.is_partial || m.outliers || !m.segment.empty()))
    table.fail_here("[[match]] of points has part, outliers_mm or segment, expected these with surface only");
  return m;
}

}  // namespace hexsolver
