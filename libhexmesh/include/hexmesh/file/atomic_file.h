// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <memory>
#include <string>
#include <string_view>

namespace hexmesh {

class TemporaryFile;

/// Most bytes of a text that people write: scenes and materials.
inline constexpr std::uintmax_t most_text_bytes = std::uintmax_t{4} << 20;

/// A file or folder to read. Standard input (`-`) and pipes are spooled to a temporary file, removed with this object,
/// so that they can be read again.
class InputFile {
public:
  static constexpr std::uintmax_t any_size = std::numeric_limits<std::uintmax_t>::max();

  /// @param name        a path, or "-" for standard input
  /// @param most_bytes  where there is a limit, a folder is refused too
  /// @throws Error{input} if there is no such file, it is a device, or larger; Error{output} if it cannot be spooled
  explicit InputFile(const std::string& name, std::uintmax_t most_bytes = any_size);
  ~InputFile();
  InputFile(const InputFile&) = delete;
  InputFile& operator=(const InputFile&) = delete;

  const std::filesystem::path& path() const noexcept { return path_; }

  /// What relative names in the file are relative to: its folder; of standard input and pipes the working directory.
  std::filesystem::path folder() const { return spool_ ? std::filesystem::path() : path_.parent_path(); }

private:
  void spool(const std::string& name, std::uintmax_t most_bytes);

  std::filesystem::path path_;
  std::unique_ptr<TemporaryFile> spool_;
};

/// "-" as people call it, any other name as it is.
std::string input_name(const std::string& name);

/// A file that appears under its name whole or not at all: written beside it under a temporary name until commit().
///
/// Links are followed: the file they lead to is replaced. Standard output (`-`), pipes and devices get the bytes at
/// commit(). Without commit() the destructor removes the temporary file; signals that end the run remove it too.
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
  const std::filesystem::path& path() const noexcept;

  /// Whether the bytes go into a pipe or device, where they cannot be taken back.
  bool is_stream() const noexcept { return kind_ != Kind::file; }
  bool is_standard_output() const noexcept { return kind_ == Kind::standard_output; }

  /// All that can fail before the name is taken: the bytes on the disk. commit() does it where it was not done.
  /// @throws Error{output}
  void prepare();

  /// Without `overwrite` one of two runs that want the name gets it.
  /// @throws Error{output}
  void commit();

private:
  enum class Kind { file, stream, standard_output };

  std::string name_;
  bool overwrite_ = false, prepared_ = false;
  Kind kind_ = Kind::file;
  std::filesystem::path target_;  ///< where links lead to
  unsigned mode_ = 0;             ///< of the file that is replaced; 0 = none is
  std::unique_ptr<TemporaryFile> temporary_;
};

/// @throws Error{output} unless all of it was written
void write_standard_output(std::string_view bytes);

/// Remove the temporary files of this process when a signal ends it; a reader that leaves and a file that gets too
/// large become errors of writing. Called once by every tool.
void remove_temporary_files_on_signals();

/// At once, before a process ends that cannot unwind.
void remove_temporary_files();

}  // namespace hexmesh
