// SPDX-License-Identifier: Apache-2.0
#include "cli/file_identity.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>

namespace hextools {
namespace {

namespace fs = std::filesystem;
using Status = struct stat;
using Kind = FileIdentity::Kind;

bool is_terminal(const char* name, int standard) {
  if (!name) return isatty(standard) != 0;
  const int file = open(name, O_WRONLY | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  const bool is = file >= 0 && isatty(file) != 0;
  if (file >= 0) close(file);
  return is;
}

/// @param name  nullptr for a standard stream
FileIdentity identity_of(const Status& status, const char* name, int standard) {
  FileIdentity out{status.st_dev, status.st_ino, "", Kind::pipe};
  if (S_ISREG(status.st_mode) || S_ISBLK(status.st_mode)) out.kind = Kind::file;
  if (S_ISDIR(status.st_mode)) out.kind = Kind::folder;
  if (S_ISCHR(status.st_mode)) out.kind = is_terminal(name, standard) ? Kind::terminal : Kind::device;
  return out;
}

/// A file that is not there, by the nearest folder above it that is.
FileIdentity identity_of_missing(fs::path path) {
  std::error_code failed;
  constexpr int most_links = 40;
  for (int n = 0; n < most_links && fs::is_symlink(path, failed); ++n)
    path = path.parent_path() / fs::read_symlink(path, failed);
  path = path.lexically_normal();
  fs::path rest;
  for (Status status{};;) {
    rest = rest.empty() ? path.filename() : path.filename() / rest;
    path = path.parent_path();
    if (stat(path.empty() ? "." : path.c_str(), &status) == 0)
      return {status.st_dev, status.st_ino, rest.string(), Kind::missing};
    if (path.empty() || path == path.parent_path()) return {0, 0, rest.string(), Kind::missing};
  }
}

FileIdentity identity_of(const std::string& name, int standard) {
  Status status{};
  if (name == "-") {
    if (fstat(standard, &status) != 0) return {};
    return identity_of(status, nullptr, standard);
  }
  if (stat(name.c_str(), &status) == 0) return identity_of(status, name.c_str(), standard);
  return identity_of_missing(name);
}

/// Whether a file in a folder of scans may be one of them: a folder may hold results of ours as well.
/// Source: DICOM PS3.10, 7.1: "DICM" after 128 bytes; without that the data begin with an element of group 2 or 8.
bool may_be_dicom(const fs::path& path) {
  std::string start(132, '\0');
  std::ifstream file(path, std::ios::binary);
  file.read(start.data(), std::ssize(start));
  start.resize(static_cast<std::size_t>(file.gcount()));
  if (start.size() < 4) return false;
  const auto is_group = [&](char low, char high) { return (low == 2 || low == 8) && high == 0; };
  return start.ends_with("DICM") || is_group(start[0], start[1]) || is_group(start[1], start[0]);
}

bool is_same(const fs::path& path, const FileIdentity& file) {
  Status status{};
  return stat(path.c_str(), &status) == 0 && status.st_dev == file.device && status.st_ino == file.node;
}

/// The file that the header of an NRRD or MetaImage names, if it does.
std::string data_file_of_header(const fs::path& path) {
  constexpr std::ptrdiff_t few = 16, most = 1 << 16;
  std::string start(few, '\0');
  std::ifstream file;
  file.rdbuf()->pubsetbuf(nullptr, 0);  // of a file that is no text a few bytes are enough
  file.open(path, std::ios::binary);
  file.read(start.data(), few);
  if (std::any_of(start.begin(), start.begin() + file.gcount(), [](unsigned char c) { return c >= 127 || c == 0; }))
    return "";
  std::error_code failed;
  start.resize(std::clamp<std::size_t>(fs::file_size(path, failed), few, most));
  file.read(start.data() + few, std::ssize(start) - few);
  start.resize(file.gcount() > 0 ? static_cast<std::size_t>(few + file.gcount()) : 0);
  std::istringstream lines(start);
  for (std::string line; std::getline(lines, line);)
    for (const char* key : {"data file:", "datafile:", "elementdatafile"}) {
      const std::string_view field(key);
      const bool is_key = line.size() > field.size() &&
                          std::equal(field.begin(), field.end(), line.begin(),
                                     [](char a, char b) { return a == std::tolower(static_cast<unsigned char>(b)); });
      if (!is_key) continue;
      const std::size_t first = line.find_first_not_of(" \t=", field.size()), last = line.find_last_not_of(" \t\r");
      return first == std::string::npos ? "" : line.substr(first, last + 1 - first);
    }
  return "";
}

}  // namespace

bool FileIdentity::collides_with(const FileIdentity& other) const {
  return kind != Kind::device && device == other.device && node == other.node && rest == other.rest;
}

FileIdentity identity_of_input(const std::string& name) { return identity_of(name, STDIN_FILENO); }

FileIdentity identity_of_output(const std::string& name) { return identity_of(name, STDOUT_FILENO); }

bool has_part(const std::string& input, const FileIdentity& file) {
  if (input == "-" || file.kind != Kind::file) return false;
  std::error_code failed;
  if (!fs::is_directory(input, failed)) {
    const std::string data = fs::is_regular_file(input, failed) ? data_file_of_header(input) : "";
    return !data.empty() && is_same(fs::path(input).parent_path() / data, file);
  }
  const auto options = fs::directory_options::skip_permission_denied;
  for (fs::recursive_directory_iterator entry(input, options, failed), end; !failed && entry != end;
       entry.increment(failed))
    if (is_same(entry->path(), file)) return may_be_dicom(entry->path());
  return false;
}

}  // namespace hextools
