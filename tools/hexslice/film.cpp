// SPDX-License-Identifier: Apache-2.0
#include "film.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <fstream>
#include <vector>

#include "cli/child_process.h"
#include "hexmesh/core/error.h"

namespace hextools {
namespace {

using hexmesh::Error;
using hexmesh::ErrorKind;

const std::array<std::string, 3> film_endings = {".mp4", ".webm", ".gif"};

/// In small letters.
std::string ending_of(const std::filesystem::path& name) {
  std::string ending = name.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(), [](unsigned char c) { return std::tolower(c); });
  return ending;
}
constexpr int no_program = 127;

/// Runs a program found on the PATH, with what it says in a file.
/// @returns its exit code; no_program where there is none
int run_program(std::vector<std::string> words, const std::filesystem::path& said) {
  const int file = open(said.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
  if (file < 0) return no_program;
  pid_t process = 0;
  const int failed = begin_program(std::move(words), {-1, file, file}, process);
  close(file);
  const int code = failed == 0 ? wait_for_program(process) : -1;
  return code < 0 ? no_program : code;
}

}  // namespace

bool is_film_name(const std::string& name) {
  return std::find(film_endings.begin(), film_endings.end(), ending_of(name)) != film_endings.end();
}

bool is_gif_name(const std::filesystem::path& name) { return ending_of(name) == ".gif"; }

Film::Film(std::string name) : name_(std::move(name)), folder_(hexmesh::temporary_place()) {
  if (run_program({"ffmpeg", "-version"}, folder_.path() / "said") != 0)
    throw Error(ErrorKind::output,
                fmt::format("'{}' takes the program ffmpeg, which cannot be run, expected it on the PATH, or a folder "
                            "for pictures",
                            name_));
}

void Film::add(const hexmesh::Canvas& picture) {
  if (count_ == 0) {  // most formats want even numbers
    width_ = picture.width() + picture.width() % 2;
    height_ = picture.height() + picture.height() % 2;
  }
  hexmesh::Canvas frame(width_, height_, picture.at(0, 0));
  frame.paste(picture, 0, 0);
  frame.write_png(folder_.path() / fmt::format("{:06}.png", count_++));
}

void Film::write(const std::filesystem::path& path, int pictures_per_second) const {
  const std::filesystem::path said = folder_.path() / "said";
  std::string pattern;
  for (const char c : folder_.path().string()) pattern += c == '%' ? "%%" : std::string(1, c);
  std::vector<std::string> words = {"ffmpeg",     "-loglevel",
                                    "error",      "-y",
                                    "-framerate", fmt::format("{}", pictures_per_second),
                                    "-i",         pattern + "/%06d.png",
                                    "-bitexact",  "-map_metadata",
                                    "-1"};
  // A GIF has 256 colours: those of this film.
  const std::vector<std::string> looks =
      is_gif_name(path) ? std::vector<std::string>{"-vf", "split[a][b];[a]palettegen[p];[b][p]paletteuse"}
                        : std::vector<std::string>{"-pix_fmt", "yuv420p"};
  words.insert(words.end(), looks.begin(), looks.end());
  words.push_back(path.string());
  if (run_program(words, said) == 0) return;
  std::string line;
  std::getline(std::ifstream(said), line);
  throw Error(ErrorKind::output, fmt::format("cannot make '{}': ffmpeg says '{}'", name_, line));
}

}  // namespace hextools
