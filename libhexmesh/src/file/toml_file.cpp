// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/file/text_file.h"
#include "hexmesh/file/toml_reader.h"

namespace hexmesh {
namespace {

constexpr int most_dots = 64;

/// Copies of nodes have no places; those of keys have.
toml::array without_places(const toml::array& array) {
  toml::array out;
  for (const toml::node& item : array) {
    if (const toml::table* table = item.as_table())
      out.push_back(hexmesh::without_places(*table));
    else if (const toml::array* inner = item.as_array())
      out.push_back(without_places(*inner));
    else
      out.push_back(item);
  }
  return out;
}

/// The parser makes a table of each part of a key, one inside the other, and takes them apart by recursion.
void check_keys(std::string_view text, const std::string& display_name) {
  int dots = 0, line = 1;
  char quote = 0;
  for (std::size_t n = 0; n < text.size(); ++n) {
    const char c = text[n];
    line += c == '\n';
    if (quote != 0) {
      if (c == '\\' && quote == '"') ++n;
      if (c == quote || c == '\n') quote = 0;
    } else if (c == '"' || c == '\'') {
      quote = c;
    } else if (c == '.') {
      if (++dots > most_dots)
        throw Error(ErrorKind::input,
                    fmt::format("{}:{}: a key of more than {} parts, expected fewer", display_name, line, most_dots));
    } else if (c == '#') {
      n = std::min(text.find('\n', n), text.size()) - 1;
    } else if (c == '=' || c == ',' || c == '[' || c == ']' || c == '{' || c == '}' || c == '\n') {
      dots = 0;
    }
  }
}

}  // namespace

toml::table parse_toml(const std::filesystem::path& path, const std::string& display_name) {
  return parse_toml_text(read_text_file(path, display_name), display_name);
}

toml::table parse_toml_text(std::string_view text, const std::string& display_name) {
  check_keys(text, display_name);
  try {
    return toml::parse(text);
  } catch (const toml::parse_error& e) {
    throw Error(ErrorKind::input, fmt::format("{}:{}:{}: {}", display_name, e.source().begin.line,
                                              e.source().begin.column, e.description()));
  }
}

toml::table without_places(const toml::table& table) {
  toml::table out;
  for (const auto& [key, node] : table) {
    if (const toml::table* inner = node.as_table())
      out.insert(key.str(), without_places(*inner));
    else if (const toml::array* array = node.as_array())
      out.insert(key.str(), without_places(*array));
    else
      out.insert(key.str(), node);
  }
  return out;
}

}  // namespace hexmesh
