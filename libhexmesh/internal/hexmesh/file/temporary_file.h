// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace hexmesh {

/// A file under a passing name, `.hextools-OWNER-XXXXXX`, removed with this object and by the signals that end a run.
///
/// OWNER says which process of which boot made it. A run that was killed (SIGKILL, a crash) leaves its files: the next
/// one that makes a file in the same folder removes those whose owner is surely gone.
class TemporaryFile {
public:
  /// @param suffix      of its name: some libraries choose the format by it
  /// @param stands_for  what messages call it
  /// @throws std::system_error
  TemporaryFile(const std::filesystem::path& folder, const std::string& suffix, const std::string& stands_for);
  ~TemporaryFile();
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;

  const std::filesystem::path& path() const noexcept { return path_; }

private:
  std::filesystem::path path_;
};

/// Likewise a folder that is empty but for what its owner puts there.
class ScratchFolder {
public:
  /// @throws std::system_error
  explicit ScratchFolder(const std::filesystem::path& parent);
  ~ScratchFolder();
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;

  const std::filesystem::path& path() const noexcept { return path_; }

private:
  std::filesystem::path path_;
};

/// A folder for outputs, with those above it that are missing; what is new and still empty goes away with this object
/// and by signals, unless it is kept.
class NewFolder {
public:
  /// @throws Error{output}
  explicit NewFolder(const std::filesystem::path& path);
  ~NewFolder();
  NewFolder(const NewFolder&) = delete;
  NewFolder& operator=(const NewFolder&) = delete;

  void keep();

private:
  void remove();

  std::vector<std::filesystem::path> made_;  ///< the uppermost first
};

/// Where temporary files go: TMPDIR, TMP, TEMP or TEMPDIR, else /tmp.
std::filesystem::path temporary_place();

/// A message with what temporary files stand for in place of their names.
std::string with_known_names(std::string message);

/// Make a file appear under a name that nothing has, in one step. The ways differ in what the file system must know.
/// @returns false where it cannot be done, with errno; EEXIST if the name is taken
bool rename_exclusively(const std::filesystem::path& from, const std::filesystem::path& to);
bool rename_by_no_replace(const std::filesystem::path& from, const std::filesystem::path& to);
bool rename_by_link(const std::filesystem::path& from, const std::filesystem::path& to);
bool rename_by_reservation(const std::filesystem::path& from, const std::filesystem::path& to);

}  // namespace hexmesh
