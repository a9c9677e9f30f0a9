// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace hexmesh {

using Rgb = std::array<std::uint8_t, 3>;

/// An RGB picture; (0, 0) is the upper left pixel.
class Canvas {
public:
  Canvas(int width, int height, Rgb background = {0, 0, 0});

  int width() const noexcept { return width_; }
  int height() const noexcept { return height_; }
  Rgb& at(int x, int y) {
    return pixels_[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x)];
  }
  const Rgb& at(int x, int y) const { return const_cast<Canvas*>(this)->at(x, y); }

  /// Copy a picture with its upper left pixel at (x, y); what lies outside is left out.
  void paste(const Canvas& picture, int x, int y);

  /// Text with its upper left corner at (x, y), in pixels of the given height.
  void text(const std::string& words, int x, int y, int size, Rgb color = {255, 255, 255});

  /// Write a PNG. @throws Error{output}
  void write_png(const std::filesystem::path& path) const;

private:
  int width_, height_;
  std::vector<Rgb> pixels_;
};

}  // namespace hexmesh
