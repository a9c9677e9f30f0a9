// SPDX-License-Identifier: Apache-2.0
#include "hexsolver/scene/scene.h"

#include "hexmesh/lattice/material_bounds.h"
#include "hexsolver/scene/scene_files.h"
#include "scene/read_tables.h"

namespace hexsolver {

using hexmesh::Error;
using hexmesh::ErrorKind;

namespace {

std::map<std::string, MaterialOverride> read_materials(TomlReader& tables) {
  std::map<std::string, MaterialOverride> materials;
  for (auto& [name, table] : tables.named_tables()) {
    MaterialOverride m;
    m.where = table.where();
    m.young_kpa = table.number("young_kpa", hexmesh::least_young_kpa, hexmesh::most_young_kpa, "1e-6 to 1e10 kPa");
    m.poisson = table.number("poisson", hexmesh::least_poisson, hexmesh::most_poisson, "-0.99 to 0.49999");
    m.density_kg_m3 = table.number("density_kg_m3", 0, hexmesh::most_density_kg_m3, "0 to 1e5");
    table.finish();
    materials[name] = m;
  }
  return materials;
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
  check(scene.matches);
}

/// strain = "auto" becomes one that turns with the body.
void let_it_turn(Scene& scene) {
  if (std::exchange(scene.finds_strain, false)) scene.elasticity = Elasticity::corotational;
}

void expect_turning(Scene& scene, const std::string& what) {
  let_it_turn(scene);
  if (scene.elasticity == Elasticity::cauchy)
    throw Error(ErrorKind::input, what + " turns the body, expected solve.strain other than \"cauchy\"");
}

void check_forces(Scene& scene) {
  for (const Force& f : scene.forces) {
    if (!f.follows) continue;
    const std::string what = with_place("force", f) + ": follows = true";
    if (scene.dynamics)
      throw Error(ErrorKind::input, what + " goes with an equilibrium, expected solve.kind = \"equilibrium\"");
    expect_turning(scene, what);
  }
}

/// Of an equilibrium with friction no error is estimated: coarser levels got there by other ways.
void check_frictions(Scene& scene) {
  for (const Contact& c : scene.contacts)
    if (is_hard(c, scene)) let_it_turn(scene);
  for (const Contact& c : scene.contacts) {
    if (!c.is_within_body()) continue;
    const std::string what =
        with_place("contact", c) + (c.self ? " is of the body with itself" : " is between segments");
    if (scene.loaded)
      throw Error(ErrorKind::input,
                  what + ", which a shape without load does not know yet, expected solve.reference = \"rest\"");
  }
  if (scene.loaded)
    for (const Contact& c : scene.loaded->contacts)
      if (c.is_within_body())
        throw Error(ErrorKind::input, with_place("contact", c) +
                                          (c.self ? " is of the body with itself" : " is between segments") +
                                          ", expected an obstacle that presses in the scan");
  if (scene.loaded)
    for (const Contact& c : scene.loaded->contacts)
      if (c.stiffness == 0)
        throw Error(ErrorKind::input, with_place("contact", c) +
                                          " has no stiffness_n_mm, by which the scan's depth tells "
                                          "what presses, expected that");
  if (scene.loaded)
    for (const Contact& c : scene.loaded->contacts)
      if (c.friction > 0)
        throw Error(ErrorKind::input, with_place("contact", c) +
                                          " has friction in [loaded], which does not tell how the body got there, "
                                          "expected none");
  if (!has_friction(scene) || scene.dynamics) return;
  const auto expect = [&](bool holds, const char* expected) {
    if (!holds) throw Error(ErrorKind::input, "friction of a [[contact]] in an equilibrium " + std::string(expected));
  };
  expect(!scene.is_open_ended(), "does not go with an accuracy or a budget_s, expected solve.level");
  expect(scene.matches.empty(), "does not go with a [[match]], expected one of them");
  expect(!scene.loaded, "does not go with solve.reference = \"loaded\", expected \"rest\"");
  let_it_turn(scene);
  scene.error_estimation = ErrorEstimation::off;
}

}  // namespace

void check_prestresses(Scene& scene) {
  std::map<std::string, std::string> where;
  for (const Prestress& p : scene.prestresses) {
    if (const auto [entry, is_new] = where.try_emplace(p.segment, p.where); !is_new)
      throw Error(ErrorKind::input,
                  fmt::format("{}: segment is '{}' as at {}, expected another", p.where, p.segment, entry->second));
    const auto expect = [&](bool holds, const char* expected) {
      if (!holds) throw Error(ErrorKind::input, fmt::format("{} ({}) {}", prestress_name(p), p.where, expected));
    };
    expect(!scene.dynamics, "goes with an equilibrium, expected solve.kind = \"equilibrium\"");
    expect(scene.matches.empty(), "does not go with a [[match]], expected one of them");
    expect(scene.rotation == Rotation::polar, "goes with solve.rotation = \"polar\", expected that");
    expect(!is_of_matrices(scene.stiffness_of_cells()),
           "goes with cells at points, expected solve.stiffness = \"exact\"");
  }
  if (!scene.prestresses.empty()) let_it_turn(scene);
}

void check_loaded(Scene& scene) {
  if (!scene.loaded) return;
  scene.finds_tolerance = false;  // where a body is at rest follows from forces that balance
  const std::string what = "solve.reference = \"loaded\"";
  const auto expect = [&](bool holds, const char* expected) {
    if (!holds) throw Error(ErrorKind::input, what + " " + expected);
  };
  expect(!scene.dynamics, "goes with an equilibrium, expected solve.kind = \"equilibrium\"");
  expect(scene.matches.empty(), "does not go with a [[match]], expected one of them");
  expect(scene.rotation == Rotation::polar, "goes with solve.rotation = \"polar\", expected that");
  expect(!is_of_matrices(scene.stiffness_of_cells()),
         "goes with cells at points, expected solve.stiffness = \"exact\"");
  expect(!scene.is_graded(), "goes with cells alike, expected solve.grading = \"off\"");
  expect(scene.islands != Islands::hold,
         "leaves the springs of held islands without force, expected solve.islands = \"error\" or \"drop\"");
  let_it_turn(scene);
  check_names(loaded_scene(scene));
}

Scene read_scene(const std::filesystem::path& path, const std::string& display_name,
                 const std::vector<std::string>& settings) {
  return read_scene(path, display_name, settings, path.parent_path());
}

Scene read_scene(const std::filesystem::path& path, const std::string& display_name,
                 const std::vector<std::string>& settings, const std::filesystem::path& folder) {
  return read_scene(hexmesh::parse_toml(path, display_name), display_name, settings, folder);
}

Scene parse_scene(std::string_view toml, const std::string& display_name, const std::filesystem::path& folder,
                  bool has_places) {
  toml::table root = hexmesh::parse_toml_text(toml, display_name);
  return read_scene(has_places ? std::move(root) : hexmesh::without_places(root), display_name, {}, folder);
}

Scene make_scene(const std::vector<std::string>& settings) { return read_scene(toml::table(), "--set", settings, ""); }

Scene read_scene(toml::table root, const std::string& display_name, const std::vector<std::string>& settings,
                 const std::filesystem::path& folder) {
  for (const std::string& setting : settings) apply_setting(root, setting);

  TomlReader reader(root, display_name, "", settings.empty() ? "" : "--set");
  Scene scene;
  auto solve = reader.table("solve", "a table written [solve]");
  SolveTable says;
  if (solve) says = read_solve(*solve, scene);
  const bool moves = says.moves;
  if (!solve) scene.finds_strain = true;  // as an empty table has it
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
    scene.materials = read_materials(*materials);
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
    scene.contacts.push_back(read_contact(table, folder, scene.dynamics, ++number));
  number = 0;
  for (const TomlReader& table : reader.tables("match")) scene.matches.push_back(read_match(table, folder, ++number));
  for (const TomlReader& table : reader.tables("prestress")) scene.prestresses.push_back(read_prestress(table));
  check_names(scene);
  if (scene.dynamics) scene.finds_tolerance = false;
  check_matches(scene);
  check_prestresses(scene);
  check_forces(scene);
  if (auto table = reader.table("gravity", "a table written [gravity]"))
    scene.gravity = read_gravity(*table, "[gravity]", scene.warnings);
  auto loaded = reader.table("loaded", "a table written [loaded]");
  if (loaded && !says.is_loaded) {
    scene.warnings.emplace_back(
        "[loaded] has no effect: solve.reference is \"rest\", expected \"loaded\" for a lattice under load");
    read_loaded(*loaded, folder, RestMethod::newton, scene.warnings);
  } else if (says.is_loaded) {
    const RestMethod method = says.rest_method.value_or(RestMethod::newton);
    scene.loaded = loaded ? read_loaded(*loaded, folder, method, scene.warnings) : Loaded{.method = method};
    check_loaded(scene);
    if (!acts(loaded_scene(scene)))
      scene.warnings.emplace_back(
          "[loaded] has no gravity, no force and no contact: the body is at rest as the lattice shows it");
  }
  check_frictions(scene);
  reader.finish();
  return scene;
}

std::vector<std::filesystem::path> files_of(const Scene& scene) {
  std::set<std::filesystem::path> markups;
  for (const Condition& c : scene.conditions) markups.insert(c.selection.markup);
  for (const Force& f : scene.forces) markups.insert(f.selection.markup);
  if (scene.loaded) {
    for (const Condition& c : scene.loaded->conditions) markups.insert(c.selection.markup);
    for (const Force& f : scene.loaded->forces) markups.insert(f.selection.markup);
  }
  for (const Contact& c : scene.contacts) markups.insert(c.file);
  if (scene.loaded)
    for (const Contact& c : scene.loaded->contacts) markups.insert(c.file);
  for (const Match& m : scene.matches) {
    markups.insert(m.file);
    markups.insert(m.markups.begin(), m.markups.end());
  }
  std::vector<std::filesystem::path> files;
  if (scene.dynamics && !scene.dynamics->start.empty()) files.push_back(scene.dynamics->start);
  for (const std::filesystem::path& markup : markups)
    if (!markup.empty()) files.push_back(markup);
  return files;
}

Scene scene_at_end(const Scene& scene) {
  return scene.loaded && !acts_after_loaded(scene) ? loaded_scene(scene) : scene;
}

Scene loaded_scene(const Scene& scene) {
  Scene out = scene;
  out.warnings.clear();
  out.is_of_lattice = true;
  if (!scene.loaded->conditions.empty()) out.conditions = scene.loaded->conditions;
  for (Condition& c : out.conditions) {
    c.by = Vec3::Zero();
    c.turn.reset();
  }
  out.forces = scene.loaded->forces;
  out.gravity = scene.loaded->gravity;
  out.contacts = scene.loaded->contacts;
  for (Contact& c : out.contacts) c.grows = true;
  return out;
}

bool acts(const Scene& scene) {
  const auto moves = [](const Condition& c) { return c.by != Vec3::Zero() || (c.turn && c.turn->radians != 0); };
  const auto pushes = [](const Force& f) { return f.total != Vec3::Zero() || f.pressure != 0; };
  return scene.gravity != Vec3::Zero() || !scene.contacts.empty() || !scene.prestresses.empty() ||
         std::any_of(scene.forces.begin(), scene.forces.end(), pushes) ||
         std::any_of(scene.conditions.begin(), scene.conditions.end(), moves);
}

/// What the lattice's loads do not hold may be elsewhere at rest.
bool acts_after_loaded(const Scene& scene) {
  return acts(scene) || (!scene.loaded->conditions.empty() && !scene.conditions.empty());
}

bool is_hard(const Contact& contact, const Scene& scene) {
  return contact.stiffness == 0 && !contact.grows && !scene.dynamics;
}

bool has_friction(const Scene& scene) {
  return std::any_of(scene.contacts.begin(), scene.contacts.end(), [](const Contact& c) { return c.friction > 0; });
}

bool follows(const Scene& scene) {
  return std::any_of(scene.forces.begin(), scene.forces.end(), [](const Force& f) { return f.follows; });
}

void check_matches(Scene& scene) {
  if (scene.matches.empty()) return;
  scene.finds_tolerance = false;  // each round starts from the one before
  const std::string what = with_place("match", scene.matches.front());
  if (scene.dynamics)
    throw Error(ErrorKind::input, what + " goes with an equilibrium, expected solve.kind = \"equilibrium\"");
  if (scene.is_graded())
    throw Error(ErrorKind::input, what + " lies on all of the surface, expected cells alike, solve.grading = \"off\"");
  check_names(scene);
  expect_turning(scene, what);
}

Stiffness Scene::stiffness_of_cells() const {
  const bool may_be_condensed =
      !is_hyperelastic(elasticity) && rotation == Rotation::polar && !is_reshaped() && !dynamics;
  const bool is_of_the_body = asks_accuracy() || is_graded();  // nobody asks for the paper's cells
  return stiffness.value_or(is_of_the_body && may_be_condensed ? Stiffness::condensed : Stiffness::exact);
}

Supports Scene::rule_of_supports() const {
  return supports.value_or(stiffness_of_cells() == Stiffness::condensed ? Supports::soft : Supports::area);
}

void Scene::keep_cells() {
  stiffness = stiffness_of_cells();
  supports = rule_of_supports();
}

void Scene::name_level(std::optional<int> of) {
  level = of;
  accuracy.reset();
  reaction_accuracy.reset();
  budget.reset();
}

void apply(const Request& request, Scene& scene) {
  const auto expect = [](bool holds, const char* what, double value, const char* expected) {
    if (!holds) throw Error(ErrorKind::usage, fmt::format("{} is {:g}, expected {}", what, value, expected));
  };
  const auto& [level, coarser_by, accuracy, reactions, budget] = request;
  if (level) expect(*level >= 0 && *level <= most_levels, "the level", *level, "0 to 30");
  if (coarser_by) expect(*coarser_by >= 0 && *coarser_by <= most_levels, "levels coarser", *coarser_by, "0 to 30");
  if (accuracy) expect(*accuracy > 0 && std::isfinite(*accuracy), "the accuracy", *accuracy, "a number > 0 in mm");
  if (reactions) expect(*reactions >= 1e-6 && *reactions <= 1, "the accuracy of reactions", *reactions, "1e-6 to 1");
  if (budget) expect(*budget > 0 && std::isfinite(*budget), "the budget", *budget, "a number > 0 in s");
  const bool asks_accuracy = accuracy || reactions;
  if (int(level.has_value()) + int(asks_accuracy) + int(budget.has_value()) > 1)
    throw Error(ErrorKind::usage, "more than one of level, accuracy and budget is asked for, expected one");
  if (scene.dynamics && (asks_accuracy || budget))
    throw Error(ErrorKind::usage,
                fmt::format("{} goes with an equilibrium, but the scene is a motion, expected a level",
                            budget ? "a budget" : "an accuracy"));
  if (has_friction(scene) && (asks_accuracy || budget))
    throw Error(ErrorKind::usage, fmt::format("{} does not go with friction of a [[contact]], expected a level",
                                              budget ? "a budget" : "an accuracy"));
  if (level || asks_accuracy || budget) {
    scene.name_level(level);
    scene.accuracy = accuracy;
    scene.reaction_accuracy = reactions;
    scene.budget = budget;
  }
  if (coarser_by) {
    scene.grading = Grading::scene;
    scene.coarser_by = *coarser_by;
    check_matches(scene);
    check_loaded(scene);
  }
}

}  // namespace hexsolver
