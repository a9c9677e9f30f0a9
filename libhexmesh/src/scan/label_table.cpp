// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/scan/label_table.h"

#include <fmt/format.h>

#include <charconv>
#include <optional>
#include <sstream>
#include <vector>

#include "hexmesh/core/error.h"
#include "hexmesh/core/printable.h"
#include "hexmesh/file/text_file.h"

namespace hexmesh {
namespace {

std::optional<int> whole_number(const std::string& word) {
  int value = 0;
  const auto [end, failed] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (failed != std::errc() || end != word.data() + word.size()) return {};
  return value;
}

/// Numbers from 0 to 255 among words as parts of 1.
std::optional<std::array<double, 3>> color_in(const std::vector<std::string>& words, std::size_t first) {
  std::array<double, 3> color{};
  for (std::size_t c = 0; c < 3; ++c) {
    const std::optional<int> value = whole_number(words.at(first + c));
    if (!value || *value < 0 || *value > 255) return {};
    color[c] = *value / 255.0;
  }
  return color;
}

/// VALUE R G B A VISIBLE MESH "NAME"
std::optional<LabelMeaning> quoted_meaning(const std::string& line) {
  const std::size_t open = line.find('"'), close = line.rfind('"');
  std::istringstream before(line.substr(0, open));
  std::vector<std::string> words;
  for (std::string word; before >> word;) words.push_back(word);
  if (words.size() < 4 || close == open) return {};
  const auto color = color_in(words, 1);
  if (!color) return {};
  return LabelMeaning{line.substr(open + 1, close - open - 1), *color};
}

/// VALUE NAME R G B A, where the name may be several words.
std::optional<LabelMeaning> plain_meaning(const std::vector<std::string>& words) {
  if (words.size() < 6) return {};
  const auto color = color_in(words, words.size() - 4);
  if (!color) return {};
  std::string name = words[1];
  for (std::size_t w = 2; w + 4 < words.size(); ++w) name += " " + words[w];
  return LabelMeaning{std::move(name), *color};
}

}  // namespace

LabelTable read_label_table(const std::filesystem::path& path) {
  LabelTable out;
  std::istringstream lines(read_text_file(path, path.string()));
  int number = 0;
  for (std::string line; std::getline(lines, line);) {
    constexpr std::string_view byte_order_mark = "\xef\xbb\xbf";
    if (++number == 1 && line.starts_with(byte_order_mark)) line.erase(0, byte_order_mark.size());
    const bool is_quoted = line.find('"') != std::string::npos;
    std::istringstream parts(line);
    std::vector<std::string> words;
    for (std::string word; parts >> word && (is_quoted || !word.starts_with('#'));) words.push_back(word);
    if (words.empty() || words.front().starts_with('#')) continue;
    const std::optional<int> value = whole_number(words.front());
    const std::optional<LabelMeaning> meaning = is_quoted ? quoted_meaning(line) : plain_meaning(words);
    if (!value || !meaning || meaning->name.empty())
      throw Error(ErrorKind::input,
                  fmt::format("label table '{}' line {} is '{}', expected VALUE NAME R G B A, or VALUE R G B A VISIBLE "
                              "MESH \"NAME\"",
                              path.string(), number, printable_line(line)));
    if (*value <= 0 || *value > 65535) continue;
    if (!out.emplace(static_cast<std::uint16_t>(*value), *meaning).second)
      throw Error(ErrorKind::input, fmt::format("label table '{}' line {} has the value {} again, expected each once",
                                                path.string(), number, *value));
  }
  if (out.empty())
    throw Error(ErrorKind::input, fmt::format("label table '{}' has no labels, expected at least one", path.string()));
  return out;
}

}  // namespace hexmesh
