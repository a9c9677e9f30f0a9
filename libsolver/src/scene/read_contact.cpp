// SPDX-License-Identifier: Apache-2.0
#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "hexmesh/file/surface_target.h"
#include "scene/read_tables.h"

namespace hexsolver {
namespace {

hexmesh::Ball read_ball(TomlReader table) {
  const auto center = table.vector("center_mm", "three numbers [x, y, z], LPS, mm");
  const auto radius = table.number("radius_mm", 1e-9, infinity, "a radius > 0 mm");
  table.finish();
  if (!center || !radius) table.fail_here("sphere, expected { center_mm = [x, y, z], radius_mm = r }");
  return {*center, *radius};
}

/// A capsule or a cylinder.
template <class Bar>
Bar read_bar(TomlReader table, const char* kind) {
  const auto from = table.vector("from_mm", "three numbers [x, y, z], LPS, mm");
  const auto to = table.vector("to_mm", "three numbers [x, y, z], LPS, mm");
  const auto radius = table.number("radius_mm", 1e-9, infinity, "a radius > 0 mm");
  table.finish();
  if (!from || !to || !radius || *from == *to)
    table.fail_here(fmt::format(
        "{}, expected {{ from_mm = [x, y, z], to_mm = [x, y, z], radius_mm = r }} with two different ends", kind));
  return {*from, *to, *radius};
}

hexmesh::Block read_block(TomlReader table) {
  const auto center = table.vector("center_mm", "three numbers [x, y, z], LPS, mm");
  const auto size = table.vector("size_mm", "three lengths > 0 [x, y, z], mm");
  const auto axis = table.vector("turned_about", "three numbers [x, y, z]");
  const auto degrees = table.number("degrees", -infinity, infinity, "an angle in degrees");
  table.finish();
  if (!center || !size || !(size->minCoeff() > 0) || axis.has_value() != degrees.has_value() ||
      (axis && axis->norm() == 0))
    table.fail_here(
        "box, expected { center_mm = [x, y, z], size_mm = [x, y, z] } with sizes > 0, and where it is turned "
        "turned_about = [x, y, z] and degrees");
  Mat3 axes = Mat3::Identity();
  if (axis) axes = Eigen::AngleAxisd(*degrees * std::numbers::pi / 180, axis->normalized()).toRotationMatrix();
  return {*center, axes, *size / 2};
}

hexmesh::Solid read_enclosed(TomlReader& table, const std::filesystem::path& file) {
  hexmesh::TriangleSurface surface = hexmesh::merged(hexmesh::read_surface_target(file));
  if (const std::string fault = hexmesh::fault_of_solid(surface); !fault.empty())
    table.fail_at("surface", fmt::format("contact.surface '{}' {}", file.string(), fault));
  return std::make_shared<const hexmesh::Enclosed>(std::move(surface));
}

void read_obstacle(TomlReader& table, const std::filesystem::path& folder, Contact& c) {
  int shapes = 0;
  const auto take = [&](const char* key, const char* expected, const auto& read) {
    if (auto shape = table.table(key, expected)) {
      c.obstacle = read(*shape);
      ++shapes;
    }
  };
  if (table.is_table("plane")) ++shapes;
  if (auto plane = table.table("plane", "{ point_mm = [x, y, z], normal = [x, y, z] }"))
    c.obstacle = read_halfspace(*plane, "plane");
  take("sphere", "{ center_mm = [x, y, z], radius_mm = r }", read_ball);
  take("capsule", "{ from_mm = [x, y, z], to_mm = [x, y, z], radius_mm = r }",
       [](const TomlReader& t) { return read_bar<hexmesh::Capsule>(t, "capsule"); });
  take("cylinder", "{ from_mm = [x, y, z], to_mm = [x, y, z], radius_mm = r }",
       [](const TomlReader& t) { return read_bar<hexmesh::Cylinder>(t, "cylinder"); });
  take("box", "{ center_mm = [x, y, z], size_mm = [x, y, z] }", read_block);
  if (const auto file = table.text("surface", "a .hexsurface")) {
    c.file = folder / *file;
    c.obstacle = read_enclosed(table, c.file);
    ++shapes;
  }
  if (shapes != 1)
    table.fail_here(
        fmt::format("[[contact]] has {} obstacles, expected one of plane, sphere, capsule, cylinder, box and surface, "
                    "or between, or self",
                    shapes));
}

/// true: of the whole body.
std::optional<std::string> read_self(TomlReader& table) {
  const char* expected = "true or the name of a segment, or no such [[contact]]";
  if (table.is_text("self")) return table.text("self", expected);
  const auto self = table.flag("self");
  if (!self) return std::nullopt;
  if (!*self) table.fail_at("self", fmt::format("contact.self = false, expected {}", expected));
  return "";
}

void read_law(TomlReader& table, Contact& c) {
  constexpr double most_friction = 10;
  c.stiffness =
      table.number("stiffness_n_mm", 1e-12, infinity, "a stiffness > 0 N/mm of each surface point").value_or(0);
  c.friction = table.number("friction", 0, most_friction, "a coefficient, 0 to 10").value_or(0);
}

}  // namespace

Contact read_contact(TomlReader table, const std::filesystem::path& folder, const std::optional<Dynamics>& dynamics,
                     std::size_t number) {
  Contact c;
  c.where = table.where();
  c.name = table.text("name", "a name").value_or(fmt::format("contact {}", number));
  if (const auto names = table.texts("between", 2, "two names of segments")) {
    if (names->at(0) == names->at(1))
      table.fail_at("between", fmt::format("contact.between names '{}' twice, expected two segments", names->at(0)));
    c.between.emplace(names->at(0), names->at(1));
    c.adhesion = table.flag("adhesion").value_or(false);
    read_law(table, c);
    table.finish();
    return c;
  }
  c.self = read_self(table);
  if (c.self) {
    read_law(table, c);
    table.finish();
    return c;
  }
  read_obstacle(table, folder, c);
  const auto by = table.vector("by_mm", "three numbers [x, y, z], LPS, mm");
  if (by) c.by = *by;
  auto turn = table.table("rotate", "{ axis = [x, y, z], degrees = a, about_mm = [x, y, z] }");
  c.history = turn ? read_history(table, 1, "degrees", dynamics) : read_history(table, 3, "x, y, z", dynamics);
  const auto velocity = read_velocity(table, dynamics);
  if (by.has_value() + (c.history && !turn) + velocity.has_value() + turn.has_value() > 1)
    table.fail_here("[[contact]] has more than one of by_mm, rotate, velocity_mm_s and table, expected one");
  if (turn) {
    c.turn = read_turn(*turn, c.history.has_value());
    if (c.history)
      for (History::Row& row : c.history->rows) row.value *= std::numbers::pi / 180;
  }
  if (velocity) c.history = velocity;
  read_law(table, c);
  table.finish();
  constexpr double most_thicknesses = 1000;
  const double way = c.turn ? std::abs(c.turn->radians) * hexmesh::reach_of(c.obstacle, c.turn->about) : c.by.norm();
  if (const double most = most_thicknesses * hexmesh::thickness_of(c.obstacle); way > most && std::isfinite(most))
    table.fail_here(fmt::format("[[contact]] moves by {:.3g} mm, expected at most {:.3g} mm, {:g} times its thickness",
                                way, most, most_thicknesses));
  return c;
}

}  // namespace hexsolver
