// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <fmt/format.h>
#include <fmt/ranges.h>

#define TOML_EXCEPTIONS 1
#include <toml++/toml.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>
#include <set>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "hexmesh/core/error.h"
#include "hexmesh/core/grid.h"
#include "hexmesh/file/text_file.h"

namespace hexmesh {

/// A file of at most 16 MB, and of keys that are no deeper than anybody writes.
/// @param display_name  of the file in messages
/// @throws Error{input} "file:line:column: what the parser says"
toml::table parse_toml(const std::filesystem::path& path, const std::string& display_name);

/// Likewise of a text in memory.
toml::table parse_toml_text(std::string_view text, const std::string& display_name);

/// The same tables without places in a text: messages name them by what they are in.
toml::table without_places(const toml::table& table);

/// Reads one TOML table and answers for every key: its type, its range, and that none is left over.
/// Each error is "file:line:column: key, value, what was expected"; "file: ..." for what has no place in a text.
class TomlReader {
public:
  /// @param name      of the table in messages, e.g. "solve"
  /// @param unplaced  what is without a place in `file` came by this, e.g. "--set"
  TomlReader(const toml::table& table, std::string file, std::string name, std::string unplaced = "")
      : table_(table), file_(std::move(file)), name_(std::move(name)), unplaced_(std::move(unplaced)) {}

  bool is_table(const std::string& key) const { return table_.get(key) && table_.get(key)->is_table(); }
  bool is_text(const std::string& key) const { return table_.get(key) && table_.get(key)->is_string(); }

  std::optional<double> number(const std::string& key, double low, double high, const std::string& expected) {
    const toml::node* node = take(key);
    if (!node) return std::nullopt;
    const std::optional<double> value = node->value<double>();
    if (!node->is_number() || !value || !std::isfinite(*value) || *value < low || *value > high)
      fail(*node, key, expected);
    return value;
  }

  /// Likewise, or a word in place of a number.
  std::optional<double> number_unless(const std::string& word, const std::string& key, double low, double high,
                                      const std::string& expected) {
    const toml::node* node = table_.get(key);
    if (!node || !node->is_string() || node->as_string()->get() != word) return number(key, low, high, expected);
    take(key);
    return std::nullopt;
  }

  std::optional<int> integer(const std::string& key, int low, int high, const std::string& expected) {
    const toml::node* node = take(key);
    if (!node) return std::nullopt;
    const auto* value = node->as_integer();
    if (!value || value->get() < low || value->get() > high) fail(*node, key, expected);
    return static_cast<int>(value->get());
  }

  std::optional<bool> flag(const std::string& key) {
    const toml::node* node = take(key);
    if (!node) return std::nullopt;
    if (!node->is_boolean()) fail(*node, key, "true or false");
    return node->as_boolean()->get();
  }

  std::optional<std::string> text(const std::string& key, const std::string& expected) {
    const toml::node* node = take(key);
    if (!node) return std::nullopt;
    if (!node->is_string() || node->as_string()->get().empty()) fail(*node, key, expected);
    return node->as_string()->get();
  }

  /// One of a few words; each stands for a value.
  template <class Value>
  std::optional<Value> choice(const std::string& key, const std::vector<std::pair<std::string, Value>>& choices) {
    const toml::node* node = take(key);
    if (!node) return std::nullopt;
    std::vector<std::string> words;
    for (const auto& [word, value] : choices) {
      if (node->is_string() && node->as_string()->get() == word) return value;
      words.push_back('"' + word + '"');
    }
    fail(*node, key, fmt::format("{}", fmt::join(words, " or ")));
  }

  std::optional<std::vector<double>> numbers(const std::string& key, std::size_t count, const std::string& expected) {
    const toml::node* node = take(key);
    if (!node) return std::nullopt;
    return numbers_of(*node, key, count, expected);
  }

  std::optional<std::vector<std::string>> texts(const std::string& key, std::size_t count,
                                                const std::string& expected) {
    const toml::node* node = take(key);
    if (!node) return std::nullopt;
    std::vector<std::string> out;
    if (const toml::array* array = node->as_array())
      for (const toml::node& entry : *array)
        if (const auto text = entry.value<std::string>(); entry.is_string()) out.push_back(*text);
    if (out.size() != count || node->as_array()->size() != count) fail(*node, key, expected);
    return out;
  }

  /// A number, or an array of as many as one of `counts`; empty if the key is absent.
  std::vector<double> number_or_numbers(const std::string& key, const std::vector<std::size_t>& counts,
                                        const std::string& expected) {
    const toml::node* node = take(key);
    if (!node) return {};
    if (node->is_number() && std::isfinite(*node->value<double>())) return {*node->value<double>()};
    const std::size_t size = node->is_array() ? node->as_array()->size() : 0;
    if (std::find(counts.begin(), counts.end(), size) == counts.end()) fail(*node, key, expected);
    return numbers_of(*node, key, size, expected);
  }

  /// [[a, b], [c, d], ...], each of `count` numbers; empty if the key is absent.
  std::vector<std::vector<double>> rows(const std::string& key, std::size_t count, const std::string& expected) {
    std::vector<std::vector<double>> out;
    const toml::node* node = take(key);
    if (!node) return out;
    const toml::array* array = node->as_array();
    if (!array || array->empty()) fail(*node, key, expected);
    for (const toml::node& row : *array) out.push_back(numbers_of(row, key, count, expected));
    return out;
  }

  std::optional<Vec3> vector(const std::string& key, const std::string& expected) {
    const auto values = numbers(key, 3, expected);
    if (!values) return std::nullopt;
    return Vec3(values->at(0), values->at(1), values->at(2));
  }

  std::optional<TomlReader> table(const std::string& key, const std::string& expected) {
    const toml::node* node = take(key);
    if (!node) return std::nullopt;
    if (!node->is_table()) fail(*node, key, expected);
    return TomlReader(*node->as_table(), file_, path(key), unplaced_);
  }

  /// The tables of [[key]].
  std::vector<TomlReader> tables(const std::string& key) {
    std::vector<TomlReader> out;
    const toml::node* node = take(key);
    if (!node) return out;
    const toml::array* array = node->as_array();
    if (!array || !array->is_homogeneous(toml::node_type::table))
      fail(*node, key, fmt::format("tables written [[{}]]", path(key)));
    for (const toml::node& item : *array) out.emplace_back(*item.as_table(), file_, path(key), unplaced_);
    return out;
  }

  /// The keys of this table, each a table itself, with their names.
  std::vector<std::pair<std::string, TomlReader>> named_tables() {
    std::vector<std::pair<std::string, TomlReader>> out;
    for (const auto& [key, node] : table_) {
      const std::string name(key.str());
      if (auto inner = table(name, fmt::format("a table written [{}]", path(name)))) out.emplace_back(name, *inner);
    }
    return out;
  }

  /// @throws unless every key of the table was asked for
  void finish() const {
    for (const auto& [key, node] : table_) {
      if (taken_.contains(std::string(key.str()))) continue;
      throw Error(ErrorKind::input, fmt::format("{}: unknown key '{}', expected one of: {}", at(key.source().begin),
                                                path(std::string(key.str())), fmt::join(asked_, ", ")));
    }
  }

  /// "file:line:column" of the table.
  std::string where() const { return at(table_.source().begin); }

  [[noreturn]] void fail_here(const std::string& message) const {
    throw Error(ErrorKind::input, fmt::format("{}: {}", where(), message));
  }

  /// Likewise at a key, or at the table if it is absent.
  [[noreturn]] void fail_at(const std::string& key, const std::string& message) const {
    const toml::node* node = table_.get(key);
    throw Error(ErrorKind::input, fmt::format("{}: {}", node ? at(node->source().begin) : where(), message));
  }

private:
  const toml::node* take(const std::string& key) {
    taken_.insert(key);
    if (std::find(asked_.begin(), asked_.end(), key) == asked_.end()) asked_.push_back(key);
    return table_.get(key);
  }

  std::vector<double> numbers_of(const toml::node& node, const std::string& key, std::size_t count,
                                 const std::string& expected) const {
    const toml::array* array = node.as_array();
    if (!array || array->size() != count) fail(node, key, expected);
    std::vector<double> values;
    for (const toml::node& item : *array) {
      if (!item.is_number() || !std::isfinite(*item.value<double>())) fail(item, key, expected);
      values.push_back(*item.value<double>());
    }
    return values;
  }

  std::string path(const std::string& key) const { return name_.empty() ? key : name_ + "." + key; }

  std::string at(const toml::source_position& position) const {
    if (position.line == 0) return unplaced_.empty() ? file_ : file_ + " (" + unplaced_ + ")";
    return fmt::format("{}:{}:{}", file_, position.line, position.column);
  }

  [[noreturn]] void fail(const toml::node& node, const std::string& key, const std::string& expected) const {
    std::ostringstream value;
    if (const auto* number = node.as_floating_point())
      value << fmt::format("{}", number->get());
    else
      node.visit([&](const auto& n) { value << n; });
    throw Error(ErrorKind::input,
                fmt::format("{}: {} is {}, expected {}", at(node.source().begin), path(key), value.str(), expected));
  }

  const toml::table& table_;
  std::string file_;
  std::string name_;
  std::string unplaced_;
  std::set<std::string> taken_;
  std::vector<std::string> asked_;
};

}  // namespace hexmesh
