// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/file/atomic_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <cstring>

#include "hexmesh/core/error.h"

namespace hexmesh {
namespace {

namespace fs = std::filesystem;

// A signal handler may only touch plain memory: fixed slots, each published by its flag.
struct TemporaryName {
  std::atomic<bool> used = false;
  std::array<char, 4096> path{};
};
std::array<TemporaryName, 16> temporary_names;

void remember(const fs::path& path) {
  const std::string text = path.string();
  for (TemporaryName& slot : temporary_names) {
    if (slot.used || text.size() + 1 > slot.path.size()) continue;
    std::memcpy(slot.path.data(), text.c_str(), text.size() + 1);
    slot.used = true;
    return;
  }
}

void forget(const fs::path& path) {
  for (TemporaryName& slot : temporary_names)
    if (slot.used && path.string() == slot.path.data()) slot.used = false;
}

extern "C" void remove_and_exit(int signal_number) {
  for (TemporaryName& slot : temporary_names)
    if (slot.used) unlink(slot.path.data());
  _exit(128 + signal_number);
}

/// Copy all bytes from one file descriptor to another; false where reading or writing fails.
bool copy_bytes(int from, int to) {
  std::array<char, 1 << 16> buffer;
  while (true) {
    const ssize_t got = read(from, buffer.data(), buffer.size());
    if (got == 0) return true;
    if (got < 0) {
      if (errno == EINTR) continue;
      return false;
    }
    for (ssize_t done = 0; done < got;) {
      const ssize_t put = write(to, buffer.data() + done, static_cast<std::size_t>(got - done));
      if (put < 0 && errno != EINTR) return false;
      if (put > 0) done += put;
    }
  }
}

int create_temporary(const fs::path& folder, const std::string& suffix, fs::path& path) {
  std::string pattern = (folder / (".hextools-XXXXXX" + suffix)).string();
  const int file = mkstemps(pattern.data(), static_cast<int>(suffix.size()));
  path = pattern;
  if (file >= 0) remember(path);
  return file;
}

void remove_temporary(const fs::path& path) {
  std::error_code ignored;
  fs::remove(path, ignored);
  forget(path);
}

}  // namespace

InputFile::InputFile(const std::string& name) : path_(name) {
  if (name != "-") {
    if (!fs::exists(path_))
      throw Error(ErrorKind::input, fmt::format("no such file '{}', expected a readable path or -", name));
    return;
  }
  const int file = create_temporary(fs::temp_directory_path(), "", path_);
  if (file < 0)
    throw Error(ErrorKind::output, fmt::format("cannot spool standard input to '{}': {}, expected a writable TMPDIR",
                                               fs::temp_directory_path().string(), std::strerror(errno)));
  spooled_ = true;
  const bool copied = copy_bytes(STDIN_FILENO, file);
  close(file);
  if (copied && fs::file_size(path_) > 0) return;
  remove_temporary(path_);
  throw Error(ErrorKind::input, "standard input is empty, expected the bytes of a file");
}

InputFile::~InputFile() {
  if (spooled_) remove_temporary(path_);
}

OutputFile::OutputFile(const std::string& name, const std::string& extension, bool overwrite) : name_(name) {
  const fs::path target = name;
  if (name != "-" && !overwrite && fs::exists(target))
    throw Error(ErrorKind::output, fmt::format("'{}' exists, expected a new name or --force", name));
  fs::path folder = fs::temp_directory_path();
  if (name != "-") folder = target.has_parent_path() ? target.parent_path() : fs::path(".");
  const int file = create_temporary(folder, extension, temporary_);
  if (file < 0)
    throw Error(ErrorKind::output, fmt::format("cannot write '{}': {}, expected an existing, writable folder", name,
                                               std::strerror(errno)));
  close(file);
}

OutputFile::~OutputFile() {
  if (!temporary_.empty()) remove_temporary(temporary_);
}

void OutputFile::commit() {
  const int file = open(temporary_.c_str(), O_RDONLY);
  bool done = file >= 0;
  if (done && name_ == "-") {
    done = copy_bytes(file, STDOUT_FILENO);
  } else if (done) {
    const mode_t mask = umask(0);
    umask(mask);
    done = fsync(file) == 0 && fchmod(file, 0666 & ~mask) == 0 && rename(temporary_.c_str(), name_.c_str()) == 0;
  }
  const int why = errno;
  if (file >= 0) close(file);
  if (!done) throw Error(ErrorKind::output, fmt::format("cannot write '{}': {}", name_, std::strerror(why)));
  remove_temporary(temporary_);
  temporary_.clear();
}

void remove_temporary_files_on_signals() {
  struct sigaction action {};
  action.sa_handler = remove_and_exit;
  for (const int s : {SIGINT, SIGTERM, SIGHUP, SIGPIPE}) sigaction(s, &action, nullptr);
}

}  // namespace hexmesh
