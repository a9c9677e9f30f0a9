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

/// In mm/s^2.
Vec3 read_gravity(TomlReader table, std::vector<std::string>& warnings) {
  constexpr double earth = 9.81, most = 50;
  const auto g = table.vector("m_s2", "three numbers [x, y, z], LPS, m/s^2");
  table.finish();
  if (!g) table.fail_here("[gravity] has no m_s2, expected m_s2 = [x, y, z]");
  if (g->norm() > most * earth)
    warnings.push_back(fmt::format("[gravity] m_s2 is {:.4g} m/s^2, {:.0f} times the Earth's: is it meant in mm/s^2?",
                                   g->norm(), g->norm() / earth));
  return *g * 1e3;
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
void expect_turning(Scene& scene, const std::string& what) {
  if (scene.finds_strain) {
    scene.finds_strain = false;
    scene.elasticity = Elasticity::corotational;
  }
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

}  // namespace

Scene read_scene(const std::filesystem::path& path, const std::string& display_name,
                 const std::vector<std::string>& settings) {
  return read_scene(path, display_name, settings, path.parent_path());
}

Scene read_scene(const std::filesystem::path& path, const std::string& display_name,
                 const std::vector<std::string>& settings, const std::filesystem::path& folder) {
  return read_scene(hexmesh::parse_toml(path, display_name), display_name, settings, folder);
}

Scene make_scene(const std::vector<std::string>& settings) { return read_scene(toml::table(), "--set", settings, ""); }

Scene read_scene(toml::table root, const std::string& display_name, const std::vector<std::string>& settings,
                 const std::filesystem::path& folder) {
  for (const std::string& setting : settings) apply_setting(root, setting);

  TomlReader reader(root, display_name, "");
  Scene scene;
  auto solve = reader.table("solve", "a table written [solve]");
  const bool moves = solve && read_solve(*solve, scene);
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
    scene.contacts.push_back(read_contact(table, scene.dynamics, ++number));
  number = 0;
  for (const TomlReader& table : reader.tables("match")) scene.matches.push_back(read_match(table, folder, ++number));
  check_names(scene);
  check_matches(scene);
  check_forces(scene);
  if (auto table = reader.table("gravity", "a table written [gravity]"))
    scene.gravity = read_gravity(*table, scene.warnings);
  reader.finish();
  return scene;
}

std::vector<std::filesystem::path> files_of(const Scene& scene) {
  std::set<std::filesystem::path> markups;
  for (const Condition& c : scene.conditions) markups.insert(c.selection.markup);
  for (const Force& f : scene.forces) markups.insert(f.selection.markup);
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

bool follows(const Scene& scene) {
  return std::any_of(scene.forces.begin(), scene.forces.end(), [](const Force& f) { return f.follows; });
}

void check_matches(Scene& scene) {
  if (scene.matches.empty()) return;
  const std::string what = with_place("match", scene.matches.front());
  if (scene.dynamics)
    throw Error(ErrorKind::input, what + " goes with an equilibrium, expected solve.kind = \"equilibrium\"");
  if (scene.is_graded())
    throw Error(ErrorKind::input, what + " lies on all of the surface, expected cells alike, solve.grading = \"off\"");
  check_names(scene);
  expect_turning(scene, what);
}

void Scene::name_level(std::optional<int> of) {
  level = of;
  accuracy.reset();
  reaction_accuracy.reset();
  budget.reset();
}

}  // namespace hexsolver
