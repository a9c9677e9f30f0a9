// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <list>
#include <memory>
#include <optional>
#include <string>

#include "cli/file_identity.h"
#include "cli/tool.h"
#include "hexmesh/file/atomic_file.h"
#include "hexmesh/file/temporary_file.h"

namespace hextools {

enum class Content { text, binary };

/// A file, folder or standard input that a run reads.
class Input {
public:
  Input(std::string name, Content content) : name_(std::move(name)), content_(content) {}

  /// As on the command line.
  const std::string& name() const { return name_; }

  /// What messages call it.
  std::string known_as() const { return hexmesh::input_name(name_); }

  /// Where to read it, as often as needed: standard input and pipes are spooled when this is first asked for.
  /// @throws as hexmesh::InputFile
  const std::filesystem::path& path() const { return file().path(); }

  /// What names in it are relative to.
  std::filesystem::path folder() const { return file().folder(); }

private:
  const hexmesh::InputFile& file() const;

  std::string name_;
  Content content_;
  mutable std::unique_ptr<hexmesh::InputFile> file_;
};

/// A file or standard output that a run writes. It appears when all of the run's outputs do.
class Output {
public:
  Output(std::string name, Content content, std::string extension, bool overwrite);

  /// As on the command line.
  const std::string& name() const { return name_; }

  /// Where a library is to write it.
  const std::filesystem::path& path();

  void write(std::string text);

  bool is_stream() const { return !file_ || file_->is_stream(); }
  bool is_standard_output() const { return !file_ || file_->is_standard_output(); }
  void prepare();
  void commit();

private:
  std::string name_, extension_;
  std::optional<std::string> text_;            ///< for standard output, which needs no file for it
  std::unique_ptr<hexmesh::OutputFile> file_;  ///< none for a text on standard output until a path is asked for
};

/// All that a run reads and writes, declared before anything is written.
///
/// No output is also an input or another output, whatever names, links or streams lead to it; the outputs appear
/// together, or none of them does.
class RunFiles {
public:
  explicit RunFiles(const CommonOptions& options) : options_(options) {}

  /// @param content  texts are those that people write: no folder, of a bounded size
  /// @throws Error{input} if there is no such file; Error{usage} if it is an output, or a stream that is read already
  Input& input(const std::string& name, Content content = Content::binary);

  /// Nothing for an empty name.
  Input* input_if_named(const std::string& name, Content content = Content::binary);

  /// @param extension  that the format is known by, also to libraries that choose it by the name; empty: any
  /// @throws Error{usage} if it is an input or another output, or binary and goes to a terminal, or its name promises
  ///         another format; as hexmesh::OutputFile
  Output& output(const std::string& name, Content content, const std::string& extension = "");

  /// Nothing for an empty name.
  Output* output_if_named(const std::string& name, Content content, const std::string& extension = "");

  /// Standard output for what is written to it before the run ends.
  /// @throws Error{usage} as output()
  void reserve_standard_output(Content content);

  /// Makes a folder for outputs. @throws Error{output}; Error{usage} where its name promises a file
  void make_folder(const std::string& name);

  /// Whether a file is one of the inputs, which is never to be removed.
  bool is_input(const std::string& name) const;

  /// All outputs appear: streams first, which can fail. @throws Error{output}
  void commit();

private:
  struct DeclaredInput {
    Input input;
    FileIdentity identity;
  };
  struct DeclaredOutput {
    std::string name;
    FileIdentity identity;
  };

  void check_output(const std::string& name, const FileIdentity& identity, Content content) const;
  const DeclaredInput* input_that_has(const FileIdentity& file) const;

  const CommonOptions& options_;
  std::list<DeclaredInput> inputs_;
  std::list<DeclaredOutput> declared_;
  std::list<hexmesh::NewFolder> folders_;  ///< before the outputs, which lie in them
  std::list<Output> outputs_;
};

}  // namespace hextools
