// SPDX-License-Identifier: Apache-2.0
#include "cli/parse.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "hexmesh/core/error.h"

namespace hextools {

std::vector<std::string> split(std::string_view text, char separator) {
  std::vector<std::string> parts;
  for (std::size_t end = text.find(separator); end != std::string_view::npos; end = text.find(separator)) {
    parts.emplace_back(text.substr(0, end));
    text.remove_prefix(end + 1);
  }
  parts.emplace_back(text);
  return parts;
}

std::vector<std::string> split_list(std::string_view text, char separator) {
  std::vector<std::string> parts = split(text, separator);
  if (parts.back().empty()) parts.pop_back();
  return parts;
}

std::vector<std::string> words_of(std::string_view text) {
  constexpr const char* blanks = " \t\r\n\f\v";
  std::vector<std::string> words;
  for (std::size_t at = text.find_first_not_of(blanks); at != text.npos;) {
    const std::size_t end = std::min(text.find_first_of(blanks, at), text.size());
    words.emplace_back(text.substr(at, end - at));
    at = text.find_first_not_of(blanks, end);
  }
  return words;
}

std::optional<double> take_time(std::vector<std::string>& words) {
  if (words.size() < 3 || words[0] != "at") return std::nullopt;
  const std::optional<double> time = parse_number<double>(words[1]);
  if (!time || !std::isfinite(*time)) return std::nullopt;
  words.erase(words.begin(), words.begin() + 2);
  return time;
}

std::pair<std::string, std::string> key_and_value(std::string_view text) {
  const std::size_t equals = text.find('=');
  if (equals == std::string_view::npos) return {std::string(text), ""};
  return {std::string(text.substr(0, equals)), std::string(text.substr(equals + 1))};
}

std::pair<std::string, std::string> parse_pair(const std::string& option, std::string_view text,
                                               const std::string& expected) {
  std::pair<std::string, std::string> pair = key_and_value(text);
  if (pair.first.empty() || pair.second.empty())
    throw hexmesh::Error(hexmesh::ErrorKind::usage, fmt::format("{} '{}', expected {}", option, text, expected));
  return pair;
}

}  // namespace hextools
