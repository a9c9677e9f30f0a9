// SPDX-License-Identifier: Apache-2.0
#include "cli/run_files.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cctype>
#include <set>

#include "cli/progress.h"
#include "cli/streams.h"
#include "hexmesh/core/error.h"
#include "hexmesh/file/text_file.h"

namespace hextools {

using hexmesh::Error;
using hexmesh::ErrorKind;
using Kind = FileIdentity::Kind;

namespace {

/// @throws Error{input} that says why an input is not there
void check_readable(const std::string& name) { const hexmesh::InputFile file(name); }

/// What a name promises, in small letters: its ending, if a kind of file is known by it.
std::string promised(const std::string& name) {
  static const std::set<std::string> known = {
      ".hexmesh", ".hexresult", ".hexsurface", ".toml", ".json", ".csv",  ".inp", ".html", ".vtu",
      ".vtk",     ".vtp",       ".vtkhdf",     ".vti",  ".pvd",  ".xdmf", ".stl", ".obj",  ".ply",
      ".off",     ".nrrd",      ".nhdr",       ".nii",  ".gz",   ".mha",  ".mhd", ".dcm",  ".png",
      ".jpg",     ".jpeg",      ".gif",        ".mp4",  ".webm", ".avi",  ".mov"};
  std::string ending = std::filesystem::path(name).extension().string();
  for (char& c : ending) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return known.contains(ending) ? ending : "";
}

std::string output_name(const std::string& name) { return name == "-" ? "standard output" : "output '" + name + "'"; }

}  // namespace

const hexmesh::InputFile& Input::file() const {
  at_work(name_ == "-" ? "reading standard input" : fmt::format("reading '{}'", name_));
  if (!file_)
    file_ = std::make_unique<hexmesh::InputFile>(
        name_, content_ == Content::text ? hexmesh::most_text_bytes : hexmesh::InputFile::any_size);
  return *file_;
}

Output::Output(std::string name, Content content, std::string extension, bool overwrite)
    : name_(std::move(name)), extension_(std::move(extension)) {
  if (name_ == "-" && content == Content::text) return;
  file_ = std::make_unique<hexmesh::OutputFile>(name_, extension_, overwrite);
}

const std::filesystem::path& Output::path() {
  at_work(fmt::format("making {}", output_name(name_)));
  if (!file_) file_ = std::make_unique<hexmesh::OutputFile>(name_, extension_);
  return file_->path();
}

void Output::write(std::string text) {
  if (file_)
    hexmesh::write_whole_file(file_->path(), text);
  else
    text_ = std::move(text);
}

void Output::prepare() {
  if (file_) file_->prepare();
}

void Output::commit() {
  if (file_)
    file_->commit();
  else if (text_)
    print_data(*text_);
}

Input& RunFiles::input(const std::string& name, Content content) {
  const FileIdentity identity = identity_of_input(name);
  if (identity.kind == Kind::missing) check_readable(name);
  const bool is_stream = identity.kind == Kind::pipe || identity.kind == Kind::terminal;
  for (const DeclaredInput& other : inputs_)
    if ((is_stream && identity.collides_with(other.identity)) || (name == "-" && other.input.name() == "-"))
      throw Error(ErrorKind::usage, fmt::format("{} is read for two inputs, expected one of them at most",
                                                name == "-" ? "standard input" : "'" + name + "'"));
  for (const DeclaredOutput& output : declared_)
    if (identity.kind == Kind::file && identity.collides_with(output.identity))
      throw Error(ErrorKind::usage,
                  fmt::format("{} is also an input, expected another name", output_name(output.name)));
  return inputs_.emplace_back(DeclaredInput{Input(name, content), identity}).input;
}

Input* RunFiles::input_if_named(const std::string& name, Content content) {
  return name.empty() ? nullptr : &input(name, content);
}

const RunFiles::DeclaredInput* RunFiles::input_that_has(const FileIdentity& file) const {
  if (file.kind != Kind::file) return nullptr;
  for (const DeclaredInput& input : inputs_)
    if (file.collides_with(input.identity) || has_part(input.input.name(), file)) return &input;
  return nullptr;
}

void RunFiles::check_output(const std::string& name, const FileIdentity& identity, Content content) const {
  if (name.empty()) throw Error(ErrorKind::usage, "the name of an output is empty, expected one");
  if (const DeclaredInput* input = input_that_has(identity)) {
    const std::string part = input->identity.kind == Kind::folder
                                 ? fmt::format("part of the input '{}'", input->input.name())
                                 : std::string("also an input");
    throw Error(ErrorKind::usage, fmt::format("{} is {}, expected another name", output_name(name), part));
  }
  for (const DeclaredOutput& other : declared_) {
    const bool is_twice = name == "-" && other.name == "-";
    if (!is_twice && !identity.collides_with(other.identity)) continue;
    if (is_twice || identity.collides_with(identity_of_output("-")))
      throw Error(ErrorKind::usage, "two outputs go to standard output, expected one at most");
    if (name == other.name)
      throw Error(ErrorKind::usage, fmt::format("two outputs are both '{}', expected two names", name));
    throw Error(ErrorKind::usage,
                fmt::format("outputs '{}' and '{}' are the same file, expected two names", other.name, name));
  }
  if (content == Content::binary && identity.kind == Kind::terminal)
    throw Error(ErrorKind::usage,
                fmt::format("{} is a terminal, expected a file or a pipe for what is no text", output_name(name)));
}

Output& RunFiles::output(const std::string& name, Content content, const std::string& extension) {
  FileIdentity identity = identity_of_output(name);
  check_output(name, identity, content);
  Output& out = outputs_.emplace_back(name, content, extension, options_.force);
  if (const std::string other = promised(name);
      !extension.empty() && !other.empty() && other != promised("file" + extension))
    throw Error(ErrorKind::usage,
                fmt::format("output '{}' would be no {}, expected a name that ends in {}", name, other, extension));
  declared_.push_back({name, std::move(identity)});
  return out;
}

Output* RunFiles::output_if_named(const std::string& name, Content content, const std::string& extension) {
  return name.empty() ? nullptr : &output(name, content, extension);
}

void RunFiles::reserve_standard_output(Content content) {
  FileIdentity identity = identity_of_output("-");
  check_output("-", identity, content);
  declared_.push_back({"-", std::move(identity)});
}

void RunFiles::make_folder(const std::string& name) {
  if (name.empty()) throw Error(ErrorKind::usage, "the name of the output folder is empty, expected one");
  if (!promised(name).empty() && !std::filesystem::is_directory(name))
    throw Error(ErrorKind::usage,
                fmt::format("output '{}' would be a folder, expected a name without {}", name, promised(name)));
  folders_.emplace_back(name);
}

bool RunFiles::is_input(const std::string& name) const { return input_that_has(identity_of_output(name)) != nullptr; }

void RunFiles::commit() {
  for (Output& output : outputs_) output.prepare();
  for (Output& output : outputs_)
    if (output.is_stream()) output.commit();
  for (Output& output : outputs_)
    if (!output.is_stream()) output.commit();
  for (hexmesh::NewFolder& folder : folders_) folder.keep();
}

}  // namespace hextools
