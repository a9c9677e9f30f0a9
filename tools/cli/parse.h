// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <charconv>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace hextools {

/// Parts of a text between separators: one more than there are separators, so one empty part of an empty text.
std::vector<std::string> split(std::string_view text, char separator);

/// Likewise, but a separator at the end adds no part, and an empty text has none.
std::vector<std::string> split_list(std::string_view text, char separator);

/// Words between blanks.
std::vector<std::string> words_of(std::string_view text);

/// The whole text as a number; blanks around it and a leading + are allowed. Nothing where it is no number, or one out
/// of range.
/// @tparam Number  double: also inf and nan; or an integer
template <class Number>
std::optional<Number> parse_number(std::string_view text) {
  constexpr std::string_view blanks = " \t";
  const std::size_t first = text.find_first_not_of(blanks);
  if (first == std::string_view::npos) return std::nullopt;
  text = text.substr(first, text.find_last_not_of(blanks) + 1 - first);
  if (text.size() > 1 && text[0] == '+' && text[1] != '-') text.remove_prefix(1);
  Number value{};
  const char* end = text.data() + text.size();
  const auto [stop, failed] = std::from_chars(text.data(), end, value);
  if (failed != std::errc() || stop != end) return std::nullopt;
  return value;
}

/// As many finite numbers, separated by commas: a point, a box. Nothing where there are fewer, more or others.
template <std::size_t count>
std::optional<std::array<double, count>> parse_numbers(std::string_view text) {
  const std::vector<std::string> parts = split(text, ',');
  if (parts.size() != count) return std::nullopt;
  std::array<double, count> numbers{};
  for (std::size_t n = 0; n < count; ++n) {
    const std::optional<double> number = parse_number<double>(parts[n]);
    if (!number || !std::isfinite(*number)) return std::nullopt;
    numbers[n] = *number;
  }
  return numbers;
}

/// Takes "at SECONDS" from the front of the words of a command. @returns the time; nothing where no time and command
/// stand there
std::optional<double> take_time(std::vector<std::string>& words);

/// What stands before and after the first = of a text; all of it and nothing where there is none.
std::pair<std::string, std::string> key_and_value(std::string_view text);

/// NAME=VALUE as an option takes it, neither of them empty.
/// @param expected  what the option takes, e.g. "NAME=FILE"
/// @throws Error{usage} naming the option, the text and what was expected
std::pair<std::string, std::string> parse_pair(const std::string& option, std::string_view text,
                                               const std::string& expected);

}  // namespace hextools
