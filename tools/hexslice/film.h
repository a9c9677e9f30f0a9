// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include "hexmesh/file/temporary_file.h"
#include "hexmesh/view/canvas.h"

namespace hextools {

/// Whether a name is that of a film: .mp4, .webm or .gif.
bool is_film_name(const std::string& name);

/// Whether it is a GIF, which has no more than 50 pictures a second.
bool is_gif_name(const std::filesystem::path& name);

/// Pictures that become a film, by the program ffmpeg where there is one.
class Film {
public:
  /// @param name  as the user gave it
  /// @throws Error{output} where there is no ffmpeg
  explicit Film(std::string name);

  /// @param picture  all are of the first one's size, but for captions
  void add(const hexmesh::Canvas& picture);

  /// Writes the film.
  /// @param path  its ending tells the format
  /// @throws Error{output} with what ffmpeg says
  void write(const std::filesystem::path& path, int pictures_per_second) const;

private:
  std::string name_;
  hexmesh::ScratchFolder folder_;
  int width_ = 0, height_ = 0, count_ = 0;
};

}  // namespace hextools
