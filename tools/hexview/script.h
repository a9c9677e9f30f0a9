// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace hextools {

/// One line of a script: what a user does at a time of the motion.
struct ScriptLine {
  std::size_t number = 0;      ///< in the file
  std::optional<double> time;  ///< [s]; nothing: at once
  std::vector<std::string> words;
};

/// Whether a line is one that hexsolve carries out itself.
bool is_of_solver(const ScriptLine& line);

/// Reads "Scripts" of FORMATS.md.
/// @throws Error{input} naming the line that is none
std::deque<ScriptLine> read_script(const std::filesystem::path& path, const std::string& name);

}  // namespace hextools
