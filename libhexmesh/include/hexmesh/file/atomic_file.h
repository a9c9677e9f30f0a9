// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

namespace hexmesh {

/// A file to read that may be standard input: `-` is spooled to a temporary file, removed with this object.
class InputFile {
public:
  /// @param name  a path, or "-" for standard input
  /// @throws Error{input} if there is no such file
  explicit InputFile(const std::string& name);
  ~InputFile();
  InputFile(const InputFile&) = delete;
  InputFile& operator=(const InputFile&) = delete;

  const std::filesystem::path& path() const noexcept { return path_; }

private:
  std::filesystem::path path_;
  bool spooled_ = false;
};

/// A file that appears under its name whole or not at all: written beside it under a temporary name, then
/// commit() syncs and renames it, or copies it to standard output where the name is "-".
///
/// Without commit() the destructor removes it; SIGINT, SIGTERM, SIGHUP and SIGPIPE remove it too.
class OutputFile {
public:
  /// @param name       a path, or "-" for standard output
  /// @param extension  of the temporary file, e.g. ".nrrd": some libraries choose the format by it
  /// @param overwrite  whether a file of that name may be replaced
  /// @throws Error{output} if the folder cannot be written to, or the file exists and may not be replaced
  explicit OutputFile(const std::string& name, const std::string& extension = "", bool overwrite = false);
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  /// Where to write until commit().
  const std::filesystem::path& path() const noexcept { return temporary_; }

  /// @throws Error{output}
  void commit();

private:
  std::string name_;
  std::filesystem::path temporary_;
};

/// Remove the temporary files of this process when it is ended by a signal. Called once by every tool.
void remove_temporary_files_on_signals();

}  // namespace hexmesh
