// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/file/markup_file.h"
#include "scene/read_tables.h"

namespace hexsolver {

HalfSpace read_halfspace(TomlReader& table, const char* key) {
  const auto point = table.vector("point_mm", "three numbers [x, y, z], LPS, mm");
  const auto normal = table.vector("normal", "three numbers [x, y, z]");
  table.finish();
  if (!point || !normal || normal->stableNorm() == 0)
    table.fail_here(
        fmt::format("{}, expected {{ point_mm = [x, y, z], normal = [x, y, z] }} with a normal that is not 0", key));
  return {*point, normal->stableNormalized()};  // whatever its length
}

Selection read_selection(TomlReader& table, const std::filesystem::path& folder, const std::string& condition,
                         std::optional<std::array<Vec3, 2>>& line) {
  constexpr double default_radius = 10;
  Selection s;
  const double radius =
      table.number("radius_mm", 0, infinity, "a radius of 0 mm (the nearest point) or more").value_or(default_radius);
  if (auto v = table.number("max_distance_mm", 0, infinity, "a distance in mm, 0 or more")) s.max_distance = *v;
  if (auto point = table.vector("point_mm", "three numbers [x, y, z], LPS, mm")) s.balls.push_back({*point, radius});
  if (auto path = table.text("markup", "the path of a .mrk.json")) {
    s.markup = folder / *path;
    const hexmesh::Markup m = hexmesh::read_markup(s.markup);
    if (m.box) {
      s.box = m.box;
    } else if (m.type == "Line" && condition == "displace") {
      if (m.points.size() != 2)
        table.fail_here(fmt::format("markup '{}' is a line of {} points, expected 2", *path, m.points.size()));
      s.balls.push_back({m.points[0], radius});
      line = {m.points[0], m.points[1]};
    } else {
      for (const Vec3& p : m.points) s.balls.push_back({p, radius});
    }
    if (!s.box && s.balls.empty()) table.fail_here(fmt::format("markup '{}' has no points, expected some", *path));
  }
  if (auto b = table.numbers("box_mm", 6, "[x0, x1, y0, y1, z0, z1], LPS, mm")) {
    const Vec3 low(b->at(0), b->at(2), b->at(4)), high(b->at(1), b->at(3), b->at(5));
    if (!((high - low).minCoeff() > 0)) table.fail_here("box_mm is empty, expected x0 < x1, y0 < y1, z0 < z1");
    s.box = hexmesh::box_between(low, high);
  }
  if (auto half = table.table("halfspace", "{ point_mm = [x, y, z], normal = [x, y, z] }")) {
    s.halfspace = read_halfspace(*half, "halfspace");
  }
  if (auto v = table.text("segment", "the name of a segment")) s.segment = *v;
  if (auto v = table.choice<SurfacePoints>(
          "on", {{"faces", SurfacePoints::faces}, {"voxels", SurfacePoints::voxels}, {"nodes", SurfacePoints::nodes}}))
    s.on = *v;
  const int ways = !s.balls.empty() + s.box.has_value() + s.halfspace.has_value() + !s.segment.empty();
  if (ways != 1)
    table.fail_here(
        fmt::format("[[{}]] selects in {} ways, expected exactly one of point_mm, markup, box_mm, "
                    "halfspace, segment",
                    condition, ways));
  if (!s.segment.empty() && s.on == SurfacePoints::nodes)
    table.fail_here("segment goes with on = \"faces\" or \"voxels\", expected one of these");
  return s;
}

}  // namespace hexsolver
