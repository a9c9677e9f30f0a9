// SPDX-License-Identifier: Apache-2.0
#include "hexsolver/scene.h"

#include <limits>
#include <numbers>

#include "hexmesh/file/toml_reader.h"

namespace hexsolver {
namespace {

using hexmesh::Error;
using hexmesh::ErrorKind;
using hexmesh::Markup;
using hexmesh::read_markup;
using hexmesh::TomlReader;

constexpr double infinity = std::numeric_limits<double>::infinity();
constexpr double default_radius = 10;

/// "solve.strain=corotational" or "displace.0.by_mm=[1,2,3]".
void apply_setting(toml::table& root, const std::string& setting) {
  const auto bad = [&](const char* expected) {
    return Error(ErrorKind::usage, fmt::format("--set '{}', expected {}", setting, expected));
  };
  const std::size_t equals = setting.find('=');
  if (equals == std::string::npos || equals == 0) throw bad("key=value, e.g. solve.level=2");
  const std::string text = setting.substr(equals + 1);
  toml::table parsed;
  try {
    parsed = toml::parse("value = " + text);
  } catch (const toml::parse_error&) {
    parsed.insert("value", text);  // a word without quotes
  }

  toml::table* table = &root;
  std::string rest = setting.substr(0, equals);
  for (std::size_t dot = rest.find('.'); dot != std::string::npos; dot = rest.find('.')) {
    const std::string part = rest.substr(0, dot);
    rest = rest.substr(dot + 1);
    if (!table->contains(part)) table->insert(part, toml::table{});
    if (toml::array* array = table->get(part)->as_array()) {
      const std::size_t next = rest.find('.');
      const std::string number = rest.substr(0, next);
      if (next == std::string::npos || number.empty() || number.find_first_not_of("0123456789") != std::string::npos)
        throw bad("the number of the table, e.g. displace.0.by_mm=[0,0,1]");
      rest = rest.substr(next + 1);
      const std::size_t index = std::stoul(number.substr(0, 9));
      table = index < array->size() ? array->get(index)->as_table() : nullptr;
    } else {
      table = table->get(part)->as_table();
    }
    if (!table) throw bad("a key of a table that the scene has");
  }
  table->insert_or_assign(rest, *parsed.get("value"));
}

/// @returns whether the scene is a motion
bool read_solve(TomlReader table, Scene& scene) {
  const bool moves = table.choice<bool>("kind", {{"equilibrium", false}, {"dynamics", true}}).value_or(false);
  const auto strain = table.choice<std::optional<Elasticity>>("strain", {{"cauchy", Elasticity::cauchy},
                                                                         {"corotational", Elasticity::corotational},
                                                                         {"green-lagrange", Elasticity::green_lagrange},
                                                                         {"auto", std::nullopt}});
  const auto law =
      table.choice<std::optional<Elasticity>>("law", {{"hooke", std::nullopt},
                                                      {"neo-hookean", Elasticity::neo_hookean},
                                                      {"stable-neo-hookean", Elasticity::stable_neo_hookean}});
  if (law && *law) {
    if (strain && *strain)
      table.fail_at("strain", "strain goes with law = \"hooke\", expected none or \"auto\": this law has its own");
    scene.elasticity = **law;
  } else if (strain) {
    scene.elasticity = strain->value_or(Elasticity::corotational);
    scene.finds_strain = !strain->has_value();
  }
  if (auto v = table.choice<Rotation>("rotation", {{"polar", Rotation::polar}, {"edges", Rotation::edges}}))
    scene.rotation = *v;
  if (scene.rotation == Rotation::edges && scene.elasticity != Elasticity::corotational)
    table.fail_at("rotation",
                  "rotation = \"edges\" goes with strain = \"corotational\" alone, expected that or no edges");
  const auto volumetric =
      table.choice<Volumetric>("volumetric", {{"mean", Volumetric::mean}, {"full", Volumetric::full}});
  const bool green_lagrange = scene.elasticity == Elasticity::green_lagrange;
  scene.volumetric = volumetric.value_or(green_lagrange ? Volumetric::full : Volumetric::mean);
  if (green_lagrange && scene.volumetric == Volumetric::mean)
    table.fail_at("volumetric",
                  "volumetric = \"mean\" goes with other strains than \"green-lagrange\", expected \"full\"");
  if (auto v = table.choice<Stiffness>("stiffness", {{"exact", Stiffness::exact}, {"uniform", Stiffness::uniform}}))
    scene.stiffness = *v;
  if (moves && scene.finds_strain && scene.rotation == Rotation::edges)
    table.fail_at("rotation",
                  "rotation = \"edges\" does not go with strain = \"auto\" in a motion, expected one of them");
  scene.level = table.integer("level", 0, 30, "a level of the lattice, 0 or more");
  scene.accuracy = table.number("accuracy_mm", 1e-9, infinity, "an accuracy > 0 mm");
  scene.budget = table.number("budget_s", 1e-3, infinity, "a time of 0.001 s or more");
  if (moves && (scene.accuracy || scene.budget))
    table.fail_at(scene.accuracy ? "accuracy_mm" : "budget_s",
                  "accuracy_mm and budget_s go with kind = \"equilibrium\", expected level");
  if (scene.level.has_value() + scene.accuracy.has_value() + scene.budget.has_value() > 1)
    table.fail_here("[solve] has more than one of level, accuracy_mm, budget_s, expected one");
  if (auto v = table.number("tolerance", 1e-13, 0.1, "1e-13 to 0.1")) scene.tolerance = *v;
  if (auto v = table.choice<Islands>("islands",
                                     {{"error", Islands::error}, {"drop", Islands::drop}, {"hold", Islands::hold}}))
    scene.islands = *v;
  if (auto v = table.choice<bool>("conflicts", {{"error", false}, {"compromise", true}})) scene.compromise = *v;
  table.finish();
  return moves;
}

Dynamics read_dynamics(TomlReader table, const std::filesystem::path& folder) {
  constexpr double most_seconds = 1e9, most_steps = 1e8;
  Dynamics d;
  const auto step = table.number("step_s", 1e-9, most_seconds, "a time of 1e-9 to 1e9 s");
  const auto duration = table.number("duration_s", 1e-9, most_seconds, "a time of 1e-9 to 1e9 s");
  if (auto v = table.integer("output_every", 1, 1000000000, "a number of steps, 1 to 1e9")) d.output_every = *v;
  if (auto v = table.choice<StepSolver>(
          "solver", {{"cg", StepSolver::cg}, {"jacobi", StepSolver::jacobi}, {"multigrid", StepSolver::multigrid}}))
    d.solver = *v;
  if (auto v = table.integer("solver_iterations", 0, 100000, "0 (as many as the tolerance takes) to 100000"))
    d.solver_iterations = *v;
  const auto newton = table.integer("newton_iterations", 0, 25, "0 (as many as the tolerance takes) to 25");
  d.newton_iterations = newton.value_or(d.solver_iterations > 0 ? 1 : 0);
  if (auto v = table.vector("velocity_mm_s", "three numbers [x, y, z], LPS, mm/s")) d.velocity = *v;
  const auto start = table.text("start", "the path of a .hexresult");
  table.finish();
  if (!step || !duration)
    table.fail_here(
        fmt::format("[dynamics] has no {}, expected step_s and duration_s", step ? "duration_s" : "step_s"));
  d.step = *step;
  d.duration = *duration;
  if (d.duration / d.step > most_steps)
    table.fail_at("step_s", fmt::format("duration_s / step_s is {:.3g} steps, expected at most {:g}",
                                        d.duration / d.step, most_steps));
  if (d.solver_iterations > 0 && d.newton_iterations == 0)
    table.fail_at("newton_iterations",
                  "newton_iterations = 0 solves to the tolerance, expected solver_iterations = 0 with it");
  if (start) {
    d.start = folder / *start;
    if (!std::filesystem::is_regular_file(d.start))
      table.fail_at("start", fmt::format("dynamics.start is '{}', expected a file (relative to the scene)", *start));
  }
  return d;
}

Damping read_damping(TomlReader table) {
  Damping d;
  d.mass_per_s = table.number("mass_per_s", 0, 1e12, "a rate in 1/s, 0 or more").value_or(0);
  d.stiffness_s = table.number("stiffness_s", 0, 1e6, "a time in s, 0 or more").value_or(0);
  table.finish();
  return d;
}

/// Rows [t, a, ...] of a key `table`, of `count` values each, as vectors; nothing if there is none.
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
    for (std::size_t n = 0; n < count; ++n) value[static_cast<Eigen::Index>(n)] = row[n + 1];
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

HalfSpace read_halfspace(TomlReader& table, const char* key) {
  const auto point = table.vector("point_mm", "three numbers [x, y, z], LPS, mm");
  const auto normal = table.vector("normal", "three numbers [x, y, z]");
  table.finish();
  if (!point || !normal || normal->norm() == 0)
    table.fail_here(
        fmt::format("{}, expected {{ point_mm = [x, y, z], normal = [x, y, z] }} with a normal that is not 0", key));
  return {*point, normal->normalized()};
}

Selection read_selection(TomlReader& table, const std::filesystem::path& folder, const Markup*& line,
                         std::vector<Markup>& markups, const std::string& condition) {
  Selection s;
  const double radius =
      table.number("radius_mm", 0, infinity, "a radius of 0 mm (the nearest point) or more").value_or(default_radius);
  if (auto v = table.number("max_distance_mm", 0, infinity, "a distance in mm, 0 or more")) s.max_distance = *v;
  if (auto point = table.vector("point_mm", "three numbers [x, y, z], LPS, mm")) s.balls.push_back({*point, radius});
  if (auto path = table.text("markup", "the path of a .mrk.json")) {
    s.markup = folder / *path;
    markups.push_back(read_markup(s.markup));
    const Markup& m = markups.back();
    if (m.box) {
      s.box = m.box;
    } else if (m.type == "Line" && condition == "displace") {
      if (m.points.size() != 2)
        table.fail_here(fmt::format("markup '{}' is a line of {} points, expected 2", *path, m.points.size()));
      s.balls.push_back({m.points[0], radius});
      line = &m;
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

Condition read_condition(TomlReader table, const std::string& kind, const std::filesystem::path& folder,
                         const std::optional<Dynamics>& dynamics, std::size_t number) {
  Condition c;
  c.where = table.where();
  c.name = table.text("name", "a name").value_or(fmt::format("{} {}", kind, number));
  const Markup* line = nullptr;
  std::vector<Markup> markups;
  c.selection = read_selection(table, folder, line, markups, kind);
  if (auto axes = table.text("axes", "some of the letters x, y, z")) {
    for (std::size_t d = 0; d < 3; ++d) c.axes[d] = axes->find("xyz"[d]) != std::string::npos;
    if (axes->find_first_not_of("xyz") != std::string::npos)
      table.fail_here(fmt::format("axes is '{}', expected some of the letters x, y, z", *axes));
  }
  if (kind == "displace") {
    const auto by = table.vector("by_mm", "three numbers [x, y, z], LPS, mm");
    auto turn = table.table("rotate", "{ axis = [x, y, z], degrees = a, about_mm = [x, y, z] }");
    c.history = turn ? read_history(table, 1, "degrees", dynamics) : read_history(table, 3, "x, y, z", dynamics);
    const bool has_table = c.history.has_value();
    if (const auto velocity = read_velocity(table, dynamics)) {
      if (has_table || turn)
        table.fail_at("velocity_mm_s", "velocity_mm_s goes alone, expected no table and no rotate");
      c.history = velocity;
    }
    if (by.has_value() + (line != nullptr) + turn.has_value() + (c.history.has_value() && !turn) != 1)
      table.fail_here(
          "[[displace]] expects one of by_mm = [x, y, z], a markup that is a line, rotate, and in a motion "
          "velocity_mm_s or table");
    if (turn) c.turn = read_turn(*turn, has_table);
    if (turn && has_table)
      for (History::Row& row : c.history->rows) row.value *= std::numbers::pi / 180;
    if (by || line) c.by = by ? *by : line->points[1] - line->points[0];
  }
  table.finish();
  return c;
}

Force read_force(TomlReader table, const std::filesystem::path& folder, const std::optional<Dynamics>& dynamics,
                 std::size_t number) {
  Force f;
  f.where = table.where();
  f.name = table.text("name", "a name").value_or(fmt::format("force {}", number));
  const Markup* line = nullptr;
  std::vector<Markup> markups;
  f.selection = read_selection(table, folder, line, markups, "force");
  const auto newton = table.vector("newton", "three numbers [x, y, z], LPS, N");
  const auto pressure = table.number("pressure_kpa", -infinity, infinity, "a pressure in kPa");
  f.history = read_history(table, pressure ? 1 : 3, pressure ? "factor of pressure_kpa" : "x, y, z in N", dynamics);
  if (pressure && f.history) {
    if (*pressure == 0) table.fail_at("pressure_kpa", "pressure_kpa is 0, expected the pressure that table multiplies");
    for (History::Row& row : f.history->rows) row.value = Vec3::Constant(row.value[0]);
  }
  table.finish();
  if (newton.has_value() + pressure.has_value() + (f.history && !pressure) != 1)
    table.fail_here("[[force]] expects one of newton = [x, y, z] in total, pressure_kpa, and in a motion table");
  if (pressure && f.selection.on != SurfacePoints::faces)
    table.fail_here("pressure_kpa goes with on = \"faces\", expected that");
  if (newton) f.total = *newton;
  f.pressure = pressure.value_or(0) * 1e-3;
  return f;
}

Contact read_contact(TomlReader table, const std::optional<Dynamics>& dynamics, std::size_t number) {
  Contact c;
  c.where = table.where();
  c.name = table.text("name", "a name").value_or(fmt::format("contact {}", number));
  auto plane = table.table("plane", "{ point_mm = [x, y, z], normal = [x, y, z] }");
  auto sphere = table.table("sphere", "{ center_mm = [x, y, z], radius_mm = r }");
  if (plane) c.obstacle = read_halfspace(*plane, "plane");
  if (sphere) {
    const auto center = sphere->vector("center_mm", "three numbers [x, y, z], LPS, mm");
    const auto radius = sphere->number("radius_mm", 1e-9, infinity, "a radius > 0 mm");
    sphere->finish();
    if (!center || !radius) sphere->fail_here("sphere, expected { center_mm = [x, y, z], radius_mm = r }");
    c.obstacle = Ball{*center, *radius};
  }
  const auto by = table.vector("by_mm", "three numbers [x, y, z], LPS, mm");
  if (by) c.by = *by;
  c.history = read_history(table, 3, "x, y, z", dynamics);
  const auto velocity = read_velocity(table, dynamics);
  if (by.has_value() + c.history.has_value() + velocity.has_value() > 1)
    table.fail_here("[[contact]] has more than one of by_mm, velocity_mm_s and table, expected one");
  if (velocity) c.history = velocity;
  const auto stiffness = table.number("stiffness_n_mm", 1e-12, infinity, "a stiffness > 0 N/mm of each surface point");
  table.finish();
  if (plane.has_value() == sphere.has_value())
    table.fail_here(fmt::format("[[contact]] has {} plane {} sphere, expected one of them", plane ? "both" : "neither",
                                plane ? "and" : "nor"));
  if (!stiffness) table.fail_here("[[contact]] has no stiffness_n_mm, expected the stiffness of each surface point");
  c.stiffness = *stiffness;
  return c;
}

/// Names tell conditions, forces and contacts apart in messages and reports.
void check_names(const Scene& scene) {
  std::map<std::string, std::string> where;
  const auto check = [&](const auto& tables) {
    for (const auto& t : tables)
      if (const auto [entry, is_new] = where.try_emplace(t.name, t.where); !is_new)
        throw Error(ErrorKind::input,
                    fmt::format("{}: name is '{}' as at {}, expected another", t.where, t.name, entry->second));
  };
  check(scene.conditions);
  check(scene.forces);
  check(scene.contacts);
}

}  // namespace

Scene read_scene(const std::filesystem::path& path, const std::string& display_name,
                 const std::vector<std::string>& settings) {
  toml::table root = hexmesh::parse_toml(path, display_name);
  for (const std::string& setting : settings) apply_setting(root, setting);

  const std::filesystem::path folder = path.parent_path();
  TomlReader reader(root, display_name, "");
  Scene scene;
  auto solve = reader.table("solve", "a table written [solve]");
  const bool moves = solve && read_solve(*solve, scene);
  if (auto table = reader.table("dynamics", "a table written [dynamics]")) {
    const Dynamics dynamics = read_dynamics(*table, folder);
    if (moves)
      scene.dynamics = dynamics;
    else
      scene.warnings.emplace_back(
          "[dynamics] has no effect: solve.kind is \"equilibrium\", expected \"dynamics\" for a motion");
  }
  if (moves && !scene.dynamics)
    solve->fail_at("kind", "kind is \"dynamics\", expected a table [dynamics] with step_s and duration_s");
  if (auto table = reader.table("damping", "a table written [damping]")) scene.damping = read_damping(*table);
  if (auto materials = reader.table("material", "tables written [material.SEGMENT]"))
    for (auto& [name, table] : materials->named_tables()) {
      MaterialOverride m;
      m.where = table.where();
      m.young_kpa = table.number("young_kpa", 1e-9, 1e12, "a modulus > 0 in kPa");
      m.poisson = table.number("poisson", -0.999999, 0.499999, "within (-1, 0.5)");
      m.density_kg_m3 = table.number("density_kg_m3", 0, 1e6, "0 or more");
      table.finish();
      scene.materials[name] = m;
    }
  for (const std::string kind : {"fix", "displace"}) {
    std::size_t number = 0;
    for (const TomlReader& table : reader.tables(kind))
      scene.conditions.push_back(read_condition(table, kind, folder, scene.dynamics, ++number));
  }
  std::size_t number = 0;
  for (const TomlReader& table : reader.tables("force"))
    scene.forces.push_back(read_force(table, folder, scene.dynamics, ++number));
  number = 0;
  for (const TomlReader& table : reader.tables("contact"))
    scene.contacts.push_back(read_contact(table, scene.dynamics, ++number));
  check_names(scene);
  if (auto gravity = reader.table("gravity", "a table written [gravity]")) {
    const auto g = gravity->vector("m_s2", "three numbers [x, y, z], LPS, m/s^2");
    gravity->finish();
    if (!g) gravity->fail_here("[gravity] has no m_s2, expected m_s2 = [x, y, z]");
    scene.gravity = *g * 1e3;
  }
  reader.finish();
  return scene;
}

}  // namespace hexsolver
