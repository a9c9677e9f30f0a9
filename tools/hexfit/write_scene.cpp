// SPDX-License-Identifier: Apache-2.0
#include "write_scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "hexmesh/core/error.h"
#include "hexmesh/file/surface_target.h"
#include "hexmesh/file/text_file.h"

namespace hextools {
namespace {

using std::filesystem::path;

/// Without "." and "..".
path folder_of(const path& file) { return std::filesystem::absolute(file).lexically_normal().parent_path(); }

/// In TOML's basic strings.
std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    out += static_cast<unsigned char>(c) < 0x20 ? '_' : c;
  }
  return out + '"';
}

/// A file seen from a folder.
std::string from_folder(const path& file, const path& folder) {
  return std::filesystem::absolute(file).lexically_normal().lexically_proximate(folder).string();
}

}  // namespace

SceneWriter::SceneWriter(const FitOptions& o) : o_(o) {
  using hexmesh::Error;
  using hexmesh::ErrorKind;
  if (o.scene_output.empty()) return;
  if (o.scene_output == "-")
    throw Error(ErrorKind::usage, "--write-scene is '-', expected a file, beside which surfaces can lie");
  if (std::count(o.landmarks.begin(), o.landmarks.end(), "-") > 0)
    throw Error(ErrorKind::usage, "--landmarks is '-', expected files that the scene of --write-scene can name");
  if (!o.scene.empty() && o.level)
    throw Error(ErrorKind::usage, "--write-scene goes without --level, expected solve.level in --scene");
  if (!o.settings.empty()) throw Error(ErrorKind::usage, "--write-scene goes without --set, expected these in --scene");
  if (!o.scene.empty() && folder_of(o.scene) != folder_of(o.scene_output))
    throw Error(ErrorKind::usage, "--write-scene is in another folder than --scene, whose names are relative to it");
}

void SceneWriter::write(const Input* base, const std::vector<hexsolver::Match>& matches, RunFiles& files) const {
  if (o_.scene_output.empty()) return;
  const path scene = o_.scene_output;
  std::string text =
      base ? hexmesh::read_text_file(base->path(), base->known_as()) + "\n" : "[solve]\nlaw = \"neo-hookean\"\n";
  if (o_.level) text += fmt::format("level = {}\n", *o_.level);
  std::size_t number = 0;
  for (const hexsolver::Match& m : matches) {
    text += "\n[[match]]\nname = " + quoted(m.name) + "\n";
    if (m.is_of_landmarks()) {
      text += fmt::format("from = {}\nto = {}\n", quoted(from_folder(o_.landmarks[0], folder_of(scene))),
                          quoted(from_folder(o_.landmarks[1], folder_of(scene))));
    } else {
      path surface = scene;
      surface.replace_extension(fmt::format("{}.hexsurface", ++number));
      hexmesh::write_surface_target(m.target, files.output(surface.string(), Content::binary).path());
      text += "surface = " + quoted(surface.filename().string()) + "\n";
      if (!m.segment.empty()) text += "segment = " + quoted(m.segment) + "\n";
      if (m.is_partial) text += fmt::format("part = {}\n", *m.is_partial);
      if (m.outliers) text += fmt::format("outliers_mm = {}\n", *m.outliers);
    }
    if (m.trust > 0) text += fmt::format("trust_mm = {}\n", m.trust);
  }
  files.output(o_.scene_output, Content::text, ".toml").write(std::move(text));
}

}  // namespace hextools
