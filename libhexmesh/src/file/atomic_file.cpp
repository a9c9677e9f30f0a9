// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/file/atomic_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <system_error>

#include "hexmesh/core/error.h"
#include "hexmesh/file/temporary_file.h"

namespace hexmesh {
namespace {

namespace fs = std::filesystem;

using Status = struct stat;

/// A file descriptor that is closed with this object, unless it is one of the standard streams.
class Descriptor {
public:
  explicit Descriptor(int number) : number_(number) {}
  ~Descriptor() {
    if (number_ > STDERR_FILENO) close(number_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  operator int() const { return number_; }

private:
  int number_;
};

/// All of the bytes; false where that fails, with errno.
bool write_all(int to, const char* bytes, std::size_t count) {
  while (count > 0) {
    const ssize_t put = write(to, bytes, count);
    if (put < 0 && errno != EINTR) return false;
    if (put <= 0) continue;
    bytes += put;
    count -= static_cast<std::size_t>(put);
  }
  return true;
}

enum class Copied { all, too_many, cannot_read, cannot_write };

/// What is to be read up to its end, or up to more than `most_bytes`; errno says why not.
Copied copy_bytes(int from, int to, std::uintmax_t most_bytes, std::uintmax_t& count) {
  std::array<char, 1 << 16> buffer;
  for (count = 0; count <= most_bytes;) {
    const ssize_t got = read(from, buffer.data(), buffer.size());
    if (got == 0) return Copied::all;
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return Copied::cannot_read;
    if (!write_all(to, buffer.data(), static_cast<std::size_t>(got))) return Copied::cannot_write;
    count += static_cast<std::uintmax_t>(got);
  }
  return Copied::too_many;
}

[[noreturn]] void refuse_input(const std::string& name, const std::string& what) {
  throw Error(ErrorKind::input,
              name == "-" ? fmt::format("standard input {}", what) : fmt::format("'{}' {}", name, what));
}

void check_size(const std::string& name, std::uintmax_t bytes, std::uintmax_t most_bytes) {
  if (bytes > most_bytes)
    refuse_input(name, fmt::format("has more than {} MB, expected a text that people write", most_bytes >> 20));
}

[[noreturn]] void refuse_output(const std::string& name, const std::string& why) {
  throw Error(ErrorKind::output,
              fmt::format("cannot write {}: {}", name == "-" ? "standard output" : "'" + name + "'", why));
}

/// What /dev/stdout and the like lead to.
bool leads_to_standard_output(const std::string& name, const Status& status) {
  Status out{};
  if (fstat(STDOUT_FILENO, &out) != 0 || out.st_dev != status.st_dev || out.st_ino != status.st_ino) return false;
  // A file by its own name is replaced as any other.
  return !S_ISREG(status.st_mode) || name.starts_with("/dev/") || name.starts_with("/proc/");
}

/// Where links lead to, also to what is not there yet.
fs::path end_of_links(const std::string& name) {
  constexpr int most_links = 40;  // as many as the kernel follows
  fs::path path = name;
  std::error_code no_link;
  for (int n = 0; n < most_links; ++n) {
    const fs::path next = fs::read_symlink(path, no_link);
    if (no_link) return path;
    path = next.is_absolute() ? next : path.parent_path() / next;
  }
  refuse_output(name, std::strerror(ELOOP));
}

}  // namespace

std::string input_name(const std::string& name) { return name == "-" ? "standard input" : name; }

InputFile::InputFile(const std::string& name, std::uintmax_t most_bytes) : path_(name) {
  Status status{};
  if ((name == "-" ? fstat(STDIN_FILENO, &status) : stat(name.c_str(), &status)) != 0) {
    if (name != "-" && (errno == ENOENT || errno == ENOTDIR))
      throw Error(ErrorKind::input, fmt::format("no such file '{}', expected a readable path or -", name));
    refuse_input(name, fmt::format("cannot be read: {}, expected a file", std::strerror(errno)));
  }
  if (S_ISDIR(status.st_mode) && (name == "-" || most_bytes != any_size))
    refuse_input(name, "is a folder, expected a file");
  const bool is_null = S_ISCHR(status.st_mode) && status.st_rdev == makedev(1, 3);
  if (S_ISBLK(status.st_mode) || (S_ISCHR(status.st_mode) && !is_null && !(name == "-" && isatty(STDIN_FILENO))))
    refuse_input(name, "is a device, expected a file or a pipe");
  const bool stays = S_ISREG(status.st_mode) || S_ISDIR(status.st_mode);
  if (S_ISREG(status.st_mode) && most_bytes != any_size)
    check_size(name, static_cast<std::uintmax_t>(status.st_size), most_bytes);
  if (name == "-" || !stays) spool(name, most_bytes);
}

void InputFile::spool(const std::string& name, std::uintmax_t most_bytes) {
  const Descriptor from(name == "-" ? STDIN_FILENO : open(name.c_str(), O_RDONLY | O_CLOEXEC));
  if (from < 0) refuse_input(name, fmt::format("cannot be read: {}, expected a file or a pipe", std::strerror(errno)));
  const auto fail = [&](const std::string& why) {
    throw Error(ErrorKind::output,
                fmt::format("cannot spool {} to '{}': {}, expected a writable TMPDIR with room",
                            name == "-" ? "standard input" : "'" + name + "'", temporary_place().string(), why));
  };
  try {
    spool_ = std::make_unique<TemporaryFile>(temporary_place(), name == "-" ? "" : path_.extension().string(),
                                             input_name(name));
  } catch (const std::system_error& e) {
    fail(e.code().message());
  }
  path_ = spool_->path();
  const Descriptor to(open(path_.c_str(), O_WRONLY | O_CLOEXEC));
  std::uintmax_t bytes = 0;
  const Copied copied = to < 0 ? Copied::cannot_write : copy_bytes(from, to, most_bytes, bytes);
  if (copied == Copied::cannot_write) fail(std::strerror(errno));
  if (copied == Copied::cannot_read)
    refuse_input(name, fmt::format("cannot be read: {}, expected a file or a pipe", std::strerror(errno)));
  check_size(name, bytes, most_bytes);
  if (bytes == 0) refuse_input(name, "is empty, expected the bytes of a file");
}

InputFile::~InputFile() = default;

OutputFile::OutputFile(const std::string& name, const std::string& extension, bool overwrite)
    : name_(name), overwrite_(overwrite) {
  Status status{};
  if (name == "-") {
    kind_ = Kind::standard_output;
  } else if (stat(name.c_str(), &status) == 0) {
    if (S_ISDIR(status.st_mode)) refuse_output(name, "it is a folder, expected the name of a file");
    if (leads_to_standard_output(name, status)) {
      kind_ = Kind::standard_output;
    } else if ((S_ISREG(status.st_mode) || S_ISBLK(status.st_mode)) && !overwrite) {
      throw Error(ErrorKind::output,
                  fmt::format("'{}' exists, expected a new name or leave to replace it (--force)", name));
    } else if (S_ISREG(status.st_mode)) {
      std::error_code failed;
      target_ = fs::canonical(name, failed);
      if (failed) refuse_output(name, failed.message());
      mode_ = status.st_mode & 0777;
    } else {
      kind_ = Kind::stream;
    }
  } else if (errno == ENOENT && !name.empty()) {
    target_ = end_of_links(name);
  } else {
    refuse_output(name, fmt::format("{}, expected the name of a file", std::strerror(errno)));
  }
  const fs::path folder = kind_ == Kind::file ? target_.parent_path() : temporary_place();
  try {
    temporary_ = std::make_unique<TemporaryFile>(folder.empty() ? fs::path(".") : folder, extension,
                                                 name == "-" ? "standard output" : name);
  } catch (const std::system_error& e) {
    refuse_output(name,
                  fmt::format("{}, expected an existing, writable folder{}", e.code().message(),
                              kind_ == Kind::file ? "" : fmt::format(" in place of '{}' (TMPDIR)", folder.string())));
  }
}

OutputFile::~OutputFile() = default;

const fs::path& OutputFile::path() const noexcept { return temporary_->path(); }

void OutputFile::prepare() {
  if (prepared_ || is_stream()) return;
  const Descriptor file(open(path().c_str(), O_RDONLY | O_CLOEXEC));
  const mode_t mask = umask(0);
  umask(mask);
  const mode_t mode = mode_ != 0 ? mode_ : 0666 & ~mask;
  if (file < 0 || fsync(file) != 0 || fchmod(file, mode) != 0) refuse_output(name_, std::strerror(errno));
  prepared_ = true;
}

void OutputFile::commit() {
  prepare();
  if (is_stream()) {
    const Descriptor from(open(path().c_str(), O_RDONLY | O_CLOEXEC));
    const Descriptor to(kind_ == Kind::standard_output ? STDOUT_FILENO : open(name_.c_str(), O_WRONLY | O_CLOEXEC));
    std::uintmax_t bytes = 0;
    if (from < 0 || to < 0 || copy_bytes(from, to, InputFile::any_size, bytes) != Copied::all)
      refuse_output(name_, std::strerror(errno));
  } else if (!(overwrite_ ? rename(path().c_str(), target_.c_str()) == 0 : rename_exclusively(path(), target_))) {
    if (errno == EEXIST)
      throw Error(ErrorKind::output,
                  fmt::format("'{}' exists, expected a new name or leave to replace it (--force)", name_));
    refuse_output(name_, std::strerror(errno));
  }
}

void write_standard_output(std::string_view bytes) {
  if (!write_all(STDOUT_FILENO, bytes.data(), bytes.size())) refuse_output("-", std::strerror(errno));
}

}  // namespace hexmesh
