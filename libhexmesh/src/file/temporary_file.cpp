// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/file/temporary_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sched.h>
#include <signal.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <map>
#include <mutex>
#include <set>
#include <system_error>

#include "hexmesh/core/error.h"
#include "hexmesh/file/atomic_file.h"

namespace hexmesh {
namespace {

namespace fs = std::filesystem;

/// What a signal handler removes. It may only touch plain memory: a list that only grows, each name published by its
/// flag.
struct Remembered {
  const std::string path;
  Remembered* const next;
  std::atomic<bool> used = true;
};
std::atomic<Remembered*> remembered = nullptr;

std::mutex one_at_a_time;  ///< of the threads that make files

/// The last comes first: what lies in a folder is removed before the folder.
void remember(const fs::path& path) {
  const std::scoped_lock lock(one_at_a_time);
  remembered = new Remembered{path.string(), remembered};
}

void forget(const fs::path& path) {
  for (Remembered* entry = remembered; entry; entry = entry->next)
    if (entry->path == path.string()) entry->used = false;
}

/// Signals that end a run and can wait.
constexpr std::array ending = {SIGINT, SIGTERM, SIGQUIT, SIGXCPU, SIGALRM, SIGUSR1, SIGUSR2, SIGHUP};

std::atomic<int> uninterrupted = 0;

/// While it lives no signal ends the run: between the making of a file and its being remembered. This thread gets none,
/// and where another gets it, that one waits.
class Uninterrupted {
public:
  Uninterrupted() {
    sigset_t blocked;
    sigemptyset(&blocked);
    for (const int s : ending) sigaddset(&blocked, s);
    pthread_sigmask(SIG_BLOCK, &blocked, &before_);
    ++uninterrupted;
  }
  ~Uninterrupted() {
    --uninterrupted;
    pthread_sigmask(SIG_SETMASK, &before_, nullptr);
  }
  Uninterrupted(const Uninterrupted&) = delete;
  Uninterrupted& operator=(const Uninterrupted&) = delete;

private:
  sigset_t before_;
};

void remove_remembered() {
  for (Remembered* entry = remembered; entry; entry = entry->next)
    if (entry->used && unlink(entry->path.c_str()) != 0) rmdir(entry->path.c_str());
}

extern "C" void remove_and_exit(int signal_number) {
  while (uninterrupted > 0) sched_yield();
  remove_remembered();
  _exit(128 + signal_number);
}

/// A bug: the process ends as it would have.
extern "C" void remove_and_crash(int signal_number) {
  remove_remembered();
  raise(signal_number);
}

/// What files stand for, by their names.
std::map<std::string, std::string> known_names;

const std::string prefix = ".hextools-";

std::string first_line_of(const fs::path& path) {
  std::string line;
  std::ifstream file(path);
  std::getline(file, line);
  return line;
}

/// When a process began, in ticks since the boot; empty where there is none but a dead one.
/// Source: proc(5), /proc/pid/stat, fields 3 and 22.
std::string start_of(long process) {
  const std::string line = first_line_of(fmt::format("/proc/{}/stat", process));
  const std::size_t end_of_name = line.rfind(')');
  if (end_of_name == std::string::npos || end_of_name + 2 >= line.size()) return "";
  const char state = line[end_of_name + 2];
  if (state == 'Z' || state == 'X') return "";
  std::size_t at = end_of_name + 2;
  for (int field = 3; field < 22; ++field) {
    at = line.find(' ', at);
    if (at == std::string::npos) return "";
    ++at;
  }
  return line.substr(at, line.find(' ', at) - at);
}

/// What tells apart processes of the same number: the boot, and the container or name space.
const std::string& process_space() {
  static const std::string space = [] {
    std::error_code failed;
    const std::string boot = first_line_of("/proc/sys/kernel/random/boot_id");
    const fs::path numbers = fs::read_symlink("/proc/self/ns/pid", failed);
    if (boot.empty() || failed) return std::string();
    std::uint32_t hash = 2166136261U;  // FNV-1a
    for (const char c : boot + numbers.string()) hash = (hash ^ static_cast<unsigned char>(c)) * 16777619U;
    return fmt::format("{:08x}", hash);
  }();
  return space;
}

/// SPACE-PROCESS-START, or nothing where the system does not tell.
std::string owner() {
  const std::string start = start_of(getpid());
  if (process_space().empty() || start.empty()) return "unknown";
  return fmt::format("{}-{}-{}", process_space(), getpid(), start);
}

/// Whether a temporary file is of a process of this boot and space that is there no more.
bool is_abandoned(const std::string& name) {
  std::array<char, 16> space{};
  std::array<char, 32> start{};
  long process = 0;
  if (std::sscanf(name.c_str(), ".hextools-%8[0-9a-f]-%ld-%31[0-9]-", space.data(), &process, start.data()) != 3)
    return false;
  if (process_space().empty() || process_space() != space.data() || process <= 0) return false;
  if (kill(static_cast<pid_t>(process), 0) != 0) return errno == ESRCH;
  // Another process may have the number by now, and a dead one keeps it until its parent asks.
  if (access(fmt::format("/proc/{}/stat", process).c_str(), R_OK) != 0) return false;
  return start_of(process) != start.data();
}

/// Once for each folder.
void remove_abandoned(const fs::path& folder) {
  static std::set<std::string> done;
  const std::scoped_lock lock(one_at_a_time);
  if (!done.insert(folder.string()).second) return;
  std::error_code failed;
  for (fs::directory_iterator entry(folder, failed), end; !failed && entry != end; entry.increment(failed)) {
    const std::string name = entry->path().filename().string();
    std::error_code ignored;
    if (name.starts_with(prefix) && is_abandoned(name)) fs::remove_all(entry->path(), ignored);
  }
}

std::string pattern_in(const fs::path& folder, const std::string& suffix) {
  remove_abandoned(folder);
  return (folder / fmt::format("{}{}-XXXXXX{}", prefix, owner(), suffix)).string();
}

[[noreturn]] void throw_errno() { throw std::system_error(errno, std::generic_category()); }

}  // namespace

TemporaryFile::TemporaryFile(const fs::path& folder, const std::string& suffix, const std::string& stands_for) {
  std::string pattern = pattern_in(folder, suffix);
  const Uninterrupted until_remembered;
  const int file = mkostemps(pattern.data(), static_cast<int>(suffix.size()), O_CLOEXEC);
  if (file < 0) throw_errno();
  close(file);
  path_ = pattern;
  remember(path_);
  const std::scoped_lock lock(one_at_a_time);
  known_names[path_.string()] = stands_for;
}

TemporaryFile::~TemporaryFile() {
  std::error_code ignored;
  fs::remove(path_, ignored);
  forget(path_);
}

ScratchFolder::ScratchFolder(const fs::path& parent) {
  std::string pattern = pattern_in(parent, "");
  const Uninterrupted until_remembered;
  if (!mkdtemp(pattern.data())) throw_errno();
  path_ = pattern;
  remember(path_);
}

ScratchFolder::~ScratchFolder() {
  std::error_code ignored;
  fs::remove_all(path_, ignored);
  forget(path_);
}

NewFolder::NewFolder(const fs::path& path) {
  const auto fail = [&](int why) {
    throw Error(ErrorKind::output, fmt::format("cannot make the folder '{}': {}, expected a writable place",
                                               path.string(), std::strerror(why)));
  };
  std::vector<fs::path> missing;
  fs::path above = path.lexically_normal();
  if (!above.has_filename()) above = above.parent_path();
  std::error_code failed;
  for (; !above.empty() && !fs::exists(above, failed); above = above.parent_path()) {
    if (failed) fail(failed.value());
    missing.push_back(above);
  }
  if (!above.empty() && !fs::is_directory(above, failed)) fail(ENOTDIR);
  for (auto folder = missing.rbegin(); folder != missing.rend(); ++folder) {
    const Uninterrupted until_remembered;
    if (mkdir(folder->c_str(), 0777) == 0) {
      remember(*folder);
      made_.push_back(*folder);
    } else if (errno != EEXIST || !fs::is_directory(*folder, failed)) {  // another run may have made it
      const int why = errno;
      remove();
      fail(why);
    }
  }
}

NewFolder::~NewFolder() { remove(); }

void NewFolder::remove() {
  for (auto folder = made_.rbegin(); folder != made_.rend(); ++folder) {
    forget(*folder);
    rmdir(folder->c_str());  // leaves one that others put something into
  }
}

void NewFolder::keep() {
  for (const fs::path& folder : made_) forget(folder);
  made_.clear();
}

fs::path temporary_place() {
  for (const char* name : {"TMPDIR", "TMP", "TEMP", "TEMPDIR"})
    if (const char* value = std::getenv(name); value && *value) return value;
  return "/tmp";
}

std::string with_known_names(std::string message) {
  if (message.find(prefix) == std::string::npos) return message;
  const std::scoped_lock lock(one_at_a_time);
  for (const auto& [path, name] : known_names)
    for (std::size_t at = message.find(path); at != std::string::npos; at = message.find(path, at + name.size()))
      message.replace(at, path.size(), name);
  return message;
}

bool rename_by_no_replace(const fs::path& from, const fs::path& to) {
  return renameat2(AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(), RENAME_NOREPLACE) == 0;
}

bool rename_by_link(const fs::path& from, const fs::path& to) {
  if (link(from.c_str(), to.c_str()) != 0) return false;
  unlink(from.c_str());
  return true;
}

bool rename_by_reservation(const fs::path& from, const fs::path& to) {
  const Uninterrupted until_renamed;
  const int file = open(to.c_str(), O_CREAT | O_EXCL | O_WRONLY | O_CLOEXEC, 0600);
  if (file < 0) return false;
  close(file);
  remember(to);
  const bool moved = rename(from.c_str(), to.c_str()) == 0;
  forget(to);
  if (!moved) unlink(to.c_str());
  return moved;
}

bool rename_exclusively(const fs::path& from, const fs::path& to) {
  for (const auto way : {rename_by_no_replace, rename_by_link, rename_by_reservation}) {
    if (way(from, to)) return true;
    if (errno == EEXIST || errno == ENOENT || errno == ENOSPC || errno == EDQUOT) return false;
  }
  return false;
}

void remove_temporary_files() { remove_remembered(); }

void remove_temporary_files_on_signals() {
  struct sigaction action {};
  action.sa_handler = remove_and_exit;
  for (const int s : ending)
    if (s != SIGHUP) sigaction(s, &action, nullptr);
  struct sigaction crash {};
  crash.sa_handler = remove_and_crash;
  crash.sa_flags = SA_RESETHAND;
  for (const int s : {SIGABRT, SIGBUS, SIGFPE, SIGILL, SIGSEGV}) {
    struct sigaction before {};  // sanitizers have handlers of their own
    if (sigaction(s, nullptr, &before) == 0 && before.sa_handler == SIG_DFL) sigaction(s, &crash, nullptr);
  }
  // A run that is to outlive its terminal (nohup) goes on.
  struct sigaction before {};
  sigaction(SIGHUP, nullptr, &before);
  if (before.sa_handler != SIG_IGN) sigaction(SIGHUP, &action, nullptr);
  // What cannot be written is an error of writing: a reader that left, a file that got too large.
  action.sa_handler = SIG_IGN;
  for (const int s : {SIGPIPE, SIGXFSZ}) sigaction(s, &action, nullptr);
}

}  // namespace hexmesh
