// SPDX-License-Identifier: Apache-2.0
#include "tool.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <omp.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <new>
#include <optional>
#include <utility>

#include "cli/commit.h"
#include "cli/machine.h"
#include "cli/nearest_word.h"
#include "cli/progress.h"
#include "cli/streams.h"
#include "hexmesh/core/error.h"
#include "hexmesh/core/memory.h"
#include "hexmesh/core/printable.h"
#include "hexmesh/file/atomic_file.h"
#include "hexmesh/file/temporary_file.h"

namespace hextools {
namespace {

/// Threads of OpenMP that wait at a barrier are to sleep soon: one that spins keeps the one it waits for from running
/// wherever there are more threads than free processors. The runtime reads this before main(), and is linked statically
/// so that this comes first. What the user's environment says goes first.
[[gnu::constructor(101)]] void wait_without_spinning() {
  if (std::getenv("OMP_WAIT_POLICY") || std::getenv("GOMP_SPINCOUNT")) return;
  setenv("GOMP_SPINCOUNT", "1000", 0);
}

using hexmesh::Error;
using hexmesh::ErrorKind;

constexpr int exit_bug = 70;
std::string quoted_command_line;
std::string running_tool;

/// Likewise what no text can hold, as bash reads it: $'liver\xe9.nrrd'.
std::string quoted_bytes(const std::string& word) {
  std::string out = "$'";
  for (const char c : word)
    if (c == '\'' || c == '\\')
      out += std::string("\\") + c;
    else
      out += c >= ' ' && c <= '~' ? std::string(1, c) : fmt::format("\\x{:02x}", static_cast<unsigned char>(c));
  return out + "'";
}

/// For a shell.
std::string quoted(const std::string& word) {
  if (hexmesh::printable_line(word) != word) return quoted_bytes(word);
  if (!word.empty() && word.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789"
                                              "_-+=./:,@%") == std::string::npos)
    return word;
  std::string out = "'";
  for (const char c : word) out += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return out + "'";
}

int exit_code(ErrorKind kind) {
  switch (kind) {
    case ErrorKind::usage:
      return 2;
    case ErrorKind::input:
      return 3;
    case ErrorKind::geometry:
      return 4;
    case ErrorKind::output:
      return 6;
  }
  return exit_bug;
}

/// hexsolve 0.2.0 (1acd72f)
std::string version_line(const std::string& tool) {
  const std::string version = tool + " " HEXTOOLS_VERSION;
  return *commit ? fmt::format("{} ({})", version, commit) : version;
}

int fail(const std::string& tool, int code, const std::string& message) {
  say(error_line(tool, message));
  return code;
}

/// Where nothing was asked for, what was foreseen wrongly may take nearly all there is.
void set_memory(CommonOptions& common) {
  const double all = memory_of_machine();
  const bool is_asked = common.max_memory_mb > 0;
  if (!is_asked) common.max_memory_mb = 0.8e-6 * all;
  hexmesh::limit_memory(1e6 * common.max_memory_mb, is_asked ? 0 : 0.95 * all);
}

std::string out_of_memory_line;       ///< there may be no memory to make it
std::atomic_flag is_ending;           ///< by end_at_once()
std::atomic<bool> ends_well = false;  ///< run_tool() has said what there is to say

/// From any thread, where nothing can unwind; the first that comes ends the run.
[[noreturn]] void end_at_once() {
  while (is_ending.test_and_set()) pause();
  say(out_of_memory_line);
  hexmesh::remove_temporary_files();
  std::_Exit(exit_code(ErrorKind::input));
}

/// OpenMP's runtime ends a process that it has no thread for.
void end_by_library() {
  if (!ends_well) end_at_once();
}

/// An error that nobody caught: one in a thread of OpenMP, from where none gets out, or a bug.
[[noreturn]] void end_uncaught() {
  if (const std::exception_ptr error = std::current_exception()) try {
      std::rethrow_exception(error);
    } catch (const std::exception& e) {
      if (hexmesh::is_out_of_memory(e)) end_at_once();
    } catch (...) {  // told below
    }
  say(error_line(running_tool, "this is a bug of ours, please report it: an error that nobody caught"));
  std::abort();
}

}  // namespace

std::string error_line(const std::string& tool, const std::string& message) {
  return fmt::format("{}: error: {}\n", tool, hexmesh::printable_line(hexmesh::with_known_names(message)));
}

void Console::note(const std::string& message) const {
  if (!options_.quiet) say(fmt::format("{}: {}\n", tool_, hexmesh::with_known_names(message)));
}

void Console::warning(const std::string& message) const {
  say(fmt::format("{}: warning: {}\n", tool_, hexmesh::printable_line(hexmesh::with_known_names(message))));
}

void Console::error(const std::string& message) const { say(error_line(tool_, message)); }

void Console::progress(const std::string& line, std::optional<double> part) const {
  at_work(line, part);
  if (options_.progress == "always" && !options_.quiet) say(fmt::format("{}:   {}\n", tool_, line));
}

std::function<void(const std::string&)> warning_on(const Console& console) {
  return [&console](const std::string& message) { console.warning(message); };
}

namespace {

/// --help and --version.
int show_help(const CLI::App& app, const std::string& tool, const CLI::ParseError& asked_for) {
  const int code = app.exit(asked_for);
  try {
    flush_standard_output();
    return code;
  } catch (const Error& e) {
    return fail(tool, exit_code(e.kind()), e.what());
  }
}

}  // namespace

namespace {

/// What help ends with.
std::string footer_with(const std::string& example) {
  return "Example:\n  " + example +
         "\n\nExit codes: 0 ok, 2 usage, 3 bad input, 4 geometry or supports, 5 not converged, 6 output, 70 a bug "
         "of ours.\nUnits: mm, N, patient LPS; keys of scenes and materials name theirs.";
}

constexpr const char* common_options = "Common";

/// Help of a subcommand has the options of the tool too, which it takes as well.
class Help : public CLI::Formatter {
public:
  std::string make_subcommands(const CLI::App* app, CLI::AppFormatMode mode) const override {
    std::string out;
    if (const CLI::App* tool = app->get_parent())
      out = make_group(common_options, false,
                       tool->get_options([](const CLI::Option* o) { return o->get_group() == common_options; }));
    return out + CLI::Formatter::make_subcommands(app, mode);
  }
};

/// Names a word of the command line that was left over since it is neither an option nor a subcommand, with what was
/// probably meant; empty: there is none.
std::string what_is_unknown(const CLI::App& app, const std::string& command) {
  std::vector<std::string> options, subcommands;
  std::vector<const CLI::App*> apps = {&app};
  for (const CLI::App* subcommand : app.get_subcommands()) apps.push_back(subcommand);
  for (const CLI::App* a : apps)
    for (const CLI::Option* o : a->get_options())
      for (const std::string& name : o->get_lnames()) options.push_back("--" + name);
  for (const CLI::App* subcommand : app.get_subcommands([](const CLI::App*) { return true; }))
    subcommands.push_back(subcommand->get_name());
  const auto tell = [&](const std::string& word, const char* what, const std::vector<std::string>& known) {
    const std::string meant = nearest_word(word, known);
    return fmt::format("'{}' is no {} of {}{}", word, what, command,
                       meant.empty() ? "" : fmt::format(", did you mean '{}'?", meant));
  };
  std::vector<std::string> words;  // left over
  for (const CLI::App* a : apps)
    for (const std::string& word : a->remaining()) words.push_back(word);
  for (const std::string& whole : words)
    if (const std::string word = whole.substr(0, whole.find('='));
        word.starts_with("--") && word.size() > 2 && std::find(options.begin(), options.end(), word) == options.end())
      return tell(word, "option", options);
  if (!words.empty() && !subcommands.empty() && app.get_subcommands().empty())
    return tell(words.front(), "subcommand", subcommands);
  return {};
}

int run_to_exit_code(int argc, char** argv, const Tool& tool) {
  running_tool = tool.name;
  std::set_terminate(end_uncaught);
  hexmesh::remove_temporary_files_on_signals();
  if (!tool.is_one_of_many) silence_libraries();
  std::vector<std::string> words = {tool.name};
  for (int n = 1; n < argc; ++n) words.push_back(quoted(argv[n]));
  quoted_command_line = fmt::format("{}", fmt::join(words, " "));

  CommonOptions common;
  const Console console(tool.name, common);
  CLI::App app(tool.description, tool.name);
  app.formatter(std::make_shared<Help>());
  app.footer(footer_with(tool.example));
  app.fallthrough();
  app.set_version_flag("--version", version_line(tool.name));
  app.add_flag("-q,--quiet", common.quiet, "Say nothing but warnings and errors")->group(common_options);
  app.add_flag("--force", common.force, "Replace outputs that exist")->group(common_options);
  app.add_option(
         "--progress", common.progress,
         "Tell on standard error what a run is at while it takes long: in one line on a terminal, every ten seconds "
         "elsewhere; always: every step in a line of its own")
      ->check(CLI::IsMember({"auto", "always", "never"}))
      ->capture_default_str()
      ->group(common_options);
  app.add_option("--threads", common.threads, "Threads to use; 0 = all processors. Results do not depend on it")
      ->check(CLI::Range(0, 1024))
      ->capture_default_str()
      ->group(common_options);
  if (!tool.is_one_of_many)
    app.add_option(
           "--max-memory", common.max_memory_mb,
           "Refuse what is foreseen to take more memory than this beside the program itself [MB], and end the run "
           "where it takes a quarter and 64 MB more; hexsolve takes longer first; default: four fifths of the "
           "machine's")
        ->check(positive_number)
        ->group(common_options);
  try {
    const std::function<int()> run = tool.declare(app, common, console);
    app.parse(argc, argv);
    omp_set_num_threads(common.threads > 0 ? common.threads : default_threads());
    if (!tool.is_one_of_many) {
      set_memory(common);
      out_of_memory_line = error_line(tool.name, hexmesh::out_of_memory_message());
      std::atexit(end_by_library);
    }
    hexmesh::use_large_pages();
    std::optional<ProgressTeller> teller;
    if (!tool.is_one_of_many) teller.emplace(tool.name, common);
    const int code = run();
    flush_standard_output();
    return code;
  } catch (const CLI::ParseError& e) {
    if (e.get_exit_code() == 0) return show_help(app, tool.name, e);
    std::string command = tool.name;
    for (const CLI::App* subcommand : app.get_subcommands()) command += " " + subcommand->get_name();
    const auto is = [&](CLI::ExitCodes code) { return e.get_exit_code() == static_cast<int>(code); };
    const bool has_words_left = is(CLI::ExitCodes::ExtrasError) || is(CLI::ExitCodes::RequiredError);
    const std::string unknown = has_words_left ? what_is_unknown(app, command) : "";
    return fail(tool.name, exit_code(ErrorKind::usage),
                fmt::format("{} (see {} --help)", unknown.empty() ? e.what() : unknown, command));
  } catch (const Error& e) {
    const int code = fail(tool.name, exit_code(e.kind()), e.what());
    // A library that could not write a file tries once more at exit, and may not survive it.
    if (e.kind() == ErrorKind::output) std::_Exit(code);
    return code;
  } catch (const std::filesystem::filesystem_error& e) {
    return fail(
        tool.name, exit_code(ErrorKind::input),
        fmt::format("'{}' cannot be read: {}, expected a file or folder", e.path1().string(), e.code().message()));
  } catch (const std::exception& e) {
    if (hexmesh::is_out_of_memory(e))
      return fail(tool.name, exit_code(ErrorKind::input), hexmesh::out_of_memory_message());
    return fail(tool.name, exit_bug, fmt::format("this is a bug of ours, please report it: {}", e.what()));
  }
}

}  // namespace

int run_tool(int argc, char** argv, const Tool& tool) {
  const int code = run_to_exit_code(argc, argv, tool);
  ends_well = true;
  return code;
}

CLI::App* add_subcommand(CLI::App& app, const std::string& name, const std::string& description,
                         const std::string& example) {
  CLI::App* added = app.add_subcommand(name, description);
  added->footer(footer_with(example));
  return added;
}

std::function<Declare> declare_subcommands(std::vector<Subcommand> subcommands) {
  return [subcommands = std::move(subcommands)](CLI::App& app, const CommonOptions& common,
                                                const Console& console) -> std::function<int()> {
    app.require_subcommand(1);
    std::vector<std::pair<const CLI::App*, std::function<int()>>> runs;
    for (const Subcommand& subcommand : subcommands) {
      CLI::App* added = add_subcommand(app, subcommand.name, subcommand.description, subcommand.example);
      runs.emplace_back(added, subcommand.declare(*added, common, console));
    }
    return [runs = std::move(runs)] {
      const auto named = std::find_if(runs.begin(), runs.end(), [](const auto& run) { return run.first->parsed(); });
      return named->second();
    };
  };
}

namespace {

/// A finite number for which a condition holds.
CLI::Validator finite(bool (*holds)(double), const std::string& expected, const std::string& description) {
  return CLI::Validator(
      [=](const std::string& text) {
        double value = 0;
        const bool is_good = CLI::detail::lexical_cast(text, value) && std::isfinite(value) && holds(value);
        return is_good ? std::string() : fmt::format("is {}, expected {}", text, expected);
      },
      description);
}

}  // namespace

const CLI::Validator finite_number = finite([](double) { return true; }, "a number", "");
const CLI::Validator positive_number = finite([](double v) { return v > 0; }, "a number > 0", "NUMBER > 0");
const CLI::Validator number_from_0 = finite([](double v) { return v >= 0; }, "a number >= 0", "NUMBER >= 0");

CLI::Option* add_output(CLI::App& app, std::string& output, const std::string& what) {
  return app.add_option("-o,--output", output, what + "; - is standard output")->required();
}

CLI::Option* add_repeated(CLI::App& app, const std::string& name, std::vector<std::string>& values,
                          const std::string& what) {
  return app.add_option(name, values, what)->allow_extra_args(false);
}

std::string history_entry(const std::vector<std::string>& checksum_lines) {
  std::string out = quoted_command_line;
  for (const std::string& line : checksum_lines) out += fmt::format("\n{}", hexmesh::printable_line(line));
  return out;
}

}  // namespace hextools
