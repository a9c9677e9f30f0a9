// SPDX-License-Identifier: Apache-2.0
#include <fstream>

#include "bounded_text.h"
#include "hexmesh/file/toml_reader.h"

namespace hexmesh {
namespace {

constexpr std::size_t most_bytes = std::size_t{1} << 24;
constexpr int most_dots = 64;

std::string text_of(const std::filesystem::path& path, const std::string& display_name) {
  std::ifstream file(path, std::ios::binary);
  std::string text = bounded_text(file, most_bytes);
  if (!file && !file.eof())
    throw Error(ErrorKind::input, fmt::format("cannot read '{}', expected a file", display_name));
  if (text.size() > most_bytes)
    throw Error(ErrorKind::input,
                fmt::format("'{}' has more than {} MB, expected a file in TOML", display_name, most_bytes >> 20));
  return text;
}

/// The parser makes a table of each part of a key, one inside the other, and takes them apart by recursion.
void check_keys(const std::string& text, const std::string& display_name) {
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
  const std::string text = text_of(path, display_name);
  check_keys(text, display_name);
  try {
    return toml::parse(text);
  } catch (const toml::parse_error& e) {
    throw Error(ErrorKind::input, fmt::format("{}:{}:{}: {}", display_name, e.source().begin.line,
                                              e.source().begin.column, e.description()));
  }
}

}  // namespace hexmesh
