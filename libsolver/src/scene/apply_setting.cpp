// SPDX-License-Identifier: Apache-2.0
#include "scene/read_tables.h"

namespace hexsolver {

using hexmesh::Error;
using hexmesh::ErrorKind;

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

}  // namespace hexsolver
