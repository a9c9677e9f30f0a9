// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace hextools {

/// A run that ended without a usable result although nothing was wrong with the input: exit 5.
inline constexpr int exit_not_converged = 5;

/// Options that every tool has.
struct CommonOptions {
  bool quiet = false;
  bool force = false;
  std::string progress = "auto";
  int threads = 0;
  double max_memory_mb = 0;  ///< once a tool runs: as given, or four fifths of what this process can have
};

/// Talks to the user on standard error; standard output is for results only. What it says may hold names from files:
/// control characters are shown, and temporary files are called what they stand for.
class Console {
public:
  Console(std::string tool, const CommonOptions& options) : tool_(std::move(tool)), options_(options) {}

  void note(const std::string& message) const;     ///< unless --quiet
  void warning(const std::string& message) const;  ///< always
  void error(const std::string& message) const;    ///< of a run that goes on to its exit code: one line
  /// What the run is at, as at_work(); with --progress always in a line of its own.
  void progress(const std::string& line, std::optional<double> part = {}) const;

private:
  std::string tool_;
  const CommonOptions& options_;
};

/// For readers that say what they assumed: each message becomes a warning. Not to be called after the console's end.
std::function<void(const std::string&)> warning_on(const Console& console);

/// Adds options to a tool or to one of its subcommands and returns what to run once they are parsed: the exit code.
using Declare = std::function<int()>(CLI::App&, const CommonOptions&, const Console&);

/// One executable.
struct Tool {
  std::string name;
  std::string description;
  std::string example;  ///< one command that runs as it stands in the README's demo folder
  std::function<Declare> declare;
  /// Processes of one run: what their libraries say stands, and none has a limit of memory of its own.
  bool is_one_of_many = false;
};

/// The only main and the only catch: parses, runs, maps errors to one line and the published exit codes.
int run_tool(int argc, char** argv, const Tool& tool);

struct Subcommand {
  std::string name;
  std::string description;
  std::string example;  ///< as Tool::example
  Declare* declare;
};

/// A subcommand whose help shows its own example, and the options that it shares with the tool.
CLI::App* add_subcommand(CLI::App& app, const std::string& name, const std::string& description,
                         const std::string& example);

/// The `declare` of a tool that does nothing but its subcommands, of which each call names one.
std::function<Declare> declare_subcommands(std::vector<Subcommand> subcommands);

/// Numbers that are neither infinite nor NaN, which ranges let pass.
extern const CLI::Validator finite_number;

/// Likewise, and positive.
extern const CLI::Validator positive_number;
extern const CLI::Validator number_from_0;

/// -o/--output; "-" is standard output.
CLI::Option* add_output(CLI::App& app, std::string& output, const std::string& what);

/// An option that may be given often, each time with one value: what follows is another argument.
CLI::Option* add_repeated(CLI::App& app, const std::string& name, std::vector<std::string>& values,
                          const std::string& what);

/// The command line of this run, then a line for each file that it read (see checksum.h).
std::string history_entry(const std::vector<std::string>& checksum_lines);

/// "TOOL: error: MESSAGE" and the end of the line, as a run ends with.
std::string error_line(const std::string& tool, const std::string& message);

}  // namespace hextools
