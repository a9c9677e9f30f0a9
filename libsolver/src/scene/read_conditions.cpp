// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <numbers>

#include "scene/read_tables.h"

namespace hexsolver {
std::optional<History> read_history(TomlReader& table, std::size_t count, const char* values,
                                    const std::optional<Dynamics>& dynamics) {
  const std::string expected = fmt::format("rows [[t, {}], ...] with ascending times in s", values);
  const std::vector<std::vector<double>> rows = table.rows("table", count + 1, expected);
  if (rows.empty()) return {};
  if (!dynamics) table.fail_at("table", "table goes with solve.kind = \"dynamics\", expected that or none");
  History history;
  for (const std::vector<double>& row : rows) {
    if (row[0] < 0) table.fail_at("table", fmt::format("table begins at {:g} s, expected 0 or later", row[0]));
    if (!history.rows.empty() && !(row[0] > history.rows.back().time))
      table.fail_at("table", fmt::format("table has {:g} s after {:g} s, expected {}", row[0], history.rows.back().time,
                                         expected));
    Vec3 value = Vec3::Zero();
    for (std::size_t n = 0; n < count; ++n) value[n] = row[n + 1];
    history.rows.push_back({row[0], value});
  }
  return history;
}

std::optional<History> read_velocity(TomlReader& table, const std::optional<Dynamics>& dynamics) {
  const auto velocity = table.vector("velocity_mm_s", "three numbers [x, y, z], LPS, mm/s");
  if (!velocity) return {};
  if (!dynamics)
    table.fail_at("velocity_mm_s", "velocity_mm_s goes with solve.kind = \"dynamics\", expected that or none");
  const double end = dynamics->step * dynamics->num_steps();
  return History{{{0, Vec3::Zero()}, {end, end * *velocity}}};
}

Turn read_turn(TomlReader table, bool has_history) {
  constexpr const char* expected = "{ axis = [x, y, z], degrees = a, about_mm = [x, y, z] }";
  const auto axis = table.vector("axis", "three numbers [x, y, z]");
  const auto about = table.vector("about_mm", "three numbers [x, y, z], LPS, mm");
  const auto degrees = table.number("degrees", -infinity, infinity, "an angle in degrees");
  table.finish();
  if (!axis || axis->norm() == 0 || !about || degrees.has_value() == has_history)
    table.fail_here(fmt::format("rotate, expected {} with an axis that is not 0{}", expected,
                                has_history ? ", without degrees beside a table" : ""));
  return {axis->normalized(), degrees.value_or(0) * std::numbers::pi / 180, *about};
}

namespace {

/// Where a [[displace]] moves to.
/// @param line  of its markup
void read_displacement(TomlReader& table, const std::optional<Dynamics>& dynamics,
                       const std::optional<std::array<Vec3, 2>>& line, Condition& c) {
  const auto by = table.vector("by_mm", "three numbers [x, y, z], LPS, mm");
  auto turn = table.table("rotate", "{ axis = [x, y, z], degrees = a, about_mm = [x, y, z] }");
  c.history = turn ? read_history(table, 1, "degrees", dynamics) : read_history(table, 3, "x, y, z", dynamics);
  const bool has_table = c.history.has_value();
  if (const auto velocity = read_velocity(table, dynamics)) {
    if (has_table || turn) table.fail_at("velocity_mm_s", "velocity_mm_s goes alone, expected no table and no rotate");
    c.history = velocity;
  }
  if (by.has_value() + line.has_value() + turn.has_value() + (c.history.has_value() && !turn) != 1)
    table.fail_here(
        "[[displace]] expects one of by_mm = [x, y, z], a markup that is a line, rotate, and in a motion "
        "velocity_mm_s or table");
  if (turn) c.turn = read_turn(*turn, has_table);
  if (turn && has_table)
    for (History::Row& row : c.history->rows) row.value *= std::numbers::pi / 180;
  if (by || line) c.by = by ? *by : (*line)[1] - (*line)[0];
}

}  // namespace

Condition read_condition(TomlReader table, const std::string& kind, const std::filesystem::path& folder,
                         const std::optional<Dynamics>& dynamics, std::size_t number) {
  Condition c;
  c.where = table.where();
  c.name = table.text("name", "a name").value_or(fmt::format("{} {}", kind, number));
  std::optional<std::array<Vec3, 2>> line;
  c.selection = read_selection(table, folder, kind, line);
  if (auto axes = table.text("axes", "some of the letters x, y, z")) {
    for (std::size_t d = 0; d < 3; ++d) c.axes[d] = axes->find("xyz"[d]) != std::string::npos;
    const bool is_named_twice = std::count(c.axes.begin(), c.axes.end(), true) != std::ssize(*axes);
    if (axes->find_first_not_of("xyz") != std::string::npos || is_named_twice)
      table.fail_here(fmt::format("axes is '{}', expected some of the letters x, y, z", *axes));
  }
  if (kind == "displace") read_displacement(table, dynamics, line, c);
  table.finish();
  return c;
}

Force read_force(TomlReader table, const std::filesystem::path& folder, const std::optional<Dynamics>& dynamics,
                 std::size_t number) {
  Force f;
  f.where = table.where();
  f.name = table.text("name", "a name").value_or(fmt::format("force {}", number));
  std::optional<std::array<Vec3, 2>> no_line;
  f.selection = read_selection(table, folder, "force", no_line);
  const auto newton = table.vector("newton", "three numbers [x, y, z], LPS, N");
  const auto pressure = table.number("pressure_kpa", -infinity, infinity, "a pressure in kPa");
  f.history = read_history(table, pressure ? 1 : 3, pressure ? "factor of pressure_kpa" : "x, y, z in N", dynamics);
  if (pressure && f.history) {
    if (*pressure == 0) table.fail_at("pressure_kpa", "pressure_kpa is 0, expected the pressure that table multiplies");
    for (History::Row& row : f.history->rows) row.value = Vec3::Constant(row.value[0]);
  }
  f.follows = table.flag("follows").value_or(false);
  table.finish();
  if (f.follows && !pressure) table.fail_here("follows goes with pressure_kpa, expected that");
  if (newton.has_value() + pressure.has_value() + (f.history && !pressure) != 1)
    table.fail_here("[[force]] expects one of newton = [x, y, z] in total, pressure_kpa, and in a motion table");
  if (pressure && f.selection.on != SurfacePoints::faces)
    table.fail_here("pressure_kpa goes with on = \"faces\", expected that");
  if (newton) f.total = *newton;
  f.pressure = pressure.value_or(0) * 1e-3;
  return f;
}

}  // namespace hexsolver
