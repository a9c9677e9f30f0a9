// SPDX-License-Identifier: Apache-2.0
#include "script.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <fstream>
#include <map>

#include "cli/parse.h"
#include "hexmesh/core/error.h"

namespace hextools {
namespace {

using hexmesh::Error;
using hexmesh::ErrorKind;

struct Form {
  std::size_t least, most;  ///< words behind the command
  std::size_t texts;        ///< of these that are no numbers, the first ones
};

const std::map<std::string, Form> forms = {{"grab", {4, 5, 0}},   {"release", {0, 1, 0}}, {"pause", {0, 0, 0}},
                                           {"resume", {0, 0, 0}}, {"pace", {1, 1, 0}},    {"end", {0, 0, 0}},
                                           {"press", {1, 1, 0}},  {"drag", {2, 2, 0}},    {"lift", {0, 0, 0}},
                                           {"key", {1, 1, 1}},    {"picture", {1, 1, 1}}, {"close", {0, 0, 0}}};

}  // namespace

bool is_of_solver(const ScriptLine& line) {
  const std::string& verb = line.words.front();
  return verb == "grab" || verb == "release" || verb == "pause" || verb == "resume" || verb == "pace" || verb == "end";
}

std::deque<ScriptLine> read_script(const std::filesystem::path& path, const std::string& name) {
  std::deque<ScriptLine> out;
  std::ifstream file(path);
  std::string text;
  std::optional<double> last;
  for (std::size_t number = 1; std::getline(file, text); ++number) {
    ScriptLine line{number, last, {}};
    for (const std::string& word : split(text, ' '))
      if (!word.empty()) line.words.push_back(word);
    if (line.words.empty() || line.words[0].starts_with('#')) continue;
    const auto refuse = [&](const std::string& expected) {
      throw Error(ErrorKind::input, fmt::format("{}:{}: '{}', expected {}", name, number, text, expected));
    };
    if (line.words[0] == "at") {
      const auto time = line.words.size() > 2 ? parse_number<double>(line.words[1]) : std::nullopt;
      if (!time || !(*time >= 0)) refuse("at SECONDS COMMAND");
      if (last && *time < *last) refuse("times that do not fall");
      line.time = last = time;
      line.words.erase(line.words.begin(), line.words.begin() + 2);
    }
    const auto form = forms.find(line.words[0]);
    std::vector<std::string> names;
    for (const auto& [verb, unused] : forms) names.push_back(verb);
    if (form == forms.end()) refuse(fmt::format("one of {}", fmt::join(names, ", ")));
    const auto& [least, most, texts] = form->second;
    const std::size_t count = line.words.size() - 1;
    if (count < least || count > most)
      refuse(least == most ? fmt::format("{} words behind '{}'", least, form->first)
                           : fmt::format("{} to {} words behind '{}'", least, most, form->first));
    for (std::size_t n = 1 + texts; n < line.words.size(); ++n)
      if (!parse_number<double>(line.words[n])) refuse(fmt::format("a number in place of '{}'", line.words[n]));
    out.push_back(std::move(line));
  }
  return out;
}

}  // namespace hextools
