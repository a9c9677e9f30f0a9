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
  bool is_text = false;     ///< the word behind it is no number
  bool is_of_solver = false;
};

const std::map<std::string, Form> forms = {{"grab", {4, 5, false, true}},
                                           {"release", {0, 1, false, true}},
                                           {"pause", {0, 0, false, true}},
                                           {"resume", {0, 0, false, true}},
                                           {"pace", {1, 1, false, true}},
                                           {"end", {0, 0, false, true}},
                                           {"press", {1, 1}},
                                           {"drag", {2, 2}},
                                           {"lift", {0, 0}},
                                           {"key", {1, 1, true}},
                                           {"picture", {1, 1, true}},
                                           {"close", {0, 0}}};

}  // namespace

bool is_of_solver(const ScriptLine& line) { return forms.at(line.words.front()).is_of_solver; }

std::deque<ScriptLine> read_script(const std::filesystem::path& path, const std::string& name) {
  std::deque<ScriptLine> out;
  std::ifstream file(path);
  std::string text;
  std::optional<double> last;
  for (std::size_t number = 1; std::getline(file, text); ++number) {
    ScriptLine line{number, last, words_of(text)};
    if (line.words.empty() || line.words[0].starts_with('#')) continue;
    const auto refuse = [&](const std::string& expected) {
      throw Error(ErrorKind::input, fmt::format("{}:{}: '{}', expected {}", name, number, text, expected));
    };
    if (line.words[0] == "at") {
      const std::optional<double> time = take_time(line.words);
      if (!time || !(*time >= 0)) refuse("at SECONDS COMMAND");
      if (last && *time < *last) refuse("times that do not fall");
      line.time = last = time;
    }
    const auto form = forms.find(line.words[0]);
    std::vector<std::string> names;
    for (const auto& [verb, unused] : forms) names.push_back(verb);
    if (form == forms.end()) refuse(fmt::format("one of {}", fmt::join(names, ", ")));
    const auto& [least, most, is_text, of_solver] = form->second;
    const std::size_t count = line.words.size() - 1;
    if (count < least || count > most)
      refuse(least == most ? fmt::format("{} words behind '{}'", least, form->first)
                           : fmt::format("{} to {} words behind '{}'", least, most, form->first));
    for (std::size_t n = is_text ? 2 : 1; n < line.words.size(); ++n)
      if (!parse_number<double>(line.words[n])) refuse(fmt::format("a number in place of '{}'", line.words[n]));
    out.push_back(std::move(line));
  }
  return out;
}

}  // namespace hextools
