// SPDX-License-Identifier: Apache-2.0
#include "scene/read_tables.h"

namespace hexsolver {

Vec3 read_gravity(TomlReader table, const std::string& name, std::vector<std::string>& warnings) {
  constexpr double earth = 9.81, most = 50;
  const auto g = table.vector("m_s2", "three numbers [x, y, z], LPS, m/s^2");
  table.finish();
  if (!g) table.fail_here(name + " has no m_s2, expected m_s2 = [x, y, z]");
  if (g->norm() > most * earth)
    warnings.push_back(fmt::format("{} m_s2 is {:.4g} m/s^2, {:.0f} times the Earth's: is it meant in mm/s^2?", name,
                                   g->norm(), g->norm() / earth));
  return *g * 1e3;
}

Loaded read_loaded(TomlReader table, const std::filesystem::path& folder, RestMethod method,
                   std::vector<std::string>& warnings) {
  Loaded out;
  out.method = method;
  std::size_t number = 0;
  for (const TomlReader& fix : table.tables("fix"))
    out.conditions.push_back(read_condition(fix, "fix", folder, {}, ++number));
  number = 0;
  for (const TomlReader& force : table.tables("force")) out.forces.push_back(read_force(force, folder, {}, ++number));
  number = 0;
  for (const TomlReader& contact : table.tables("contact"))
    out.contacts.push_back(read_contact(contact, folder, {}, ++number));
  if (auto gravity = table.table("gravity", "a table written [loaded.gravity]"))
    out.gravity = read_gravity(*gravity, "[loaded.gravity]", warnings);
  table.finish();
  return out;
}

}  // namespace hexsolver
