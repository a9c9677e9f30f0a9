// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "hexmesh/core/index.h"

namespace hexmesh {

using Rgb = std::array<std::uint8_t, 3>;

/// From parts of 1.
Rgb to_rgb(const std::array<double, 3>& color);

/// An RGB picture; (0, 0) is the upper left pixel.
class Canvas {
public:
  Canvas(int width, int height, Rgb background = {0, 0, 0});

  int width() const noexcept { return width_; }
  int height() const noexcept { return height_; }
  Rgb& at(int x, int y) { return pixels_[offset_in({width_, height_, 1}, {x, y, 0})]; }
  const Rgb& at(int x, int y) const { return const_cast<Canvas*>(this)->at(x, y); }

  /// Copy a picture with its upper left pixel at (x, y); what lies outside is left out.
  void paste(const Canvas& picture, int x, int y);

  /// Text with its upper left corner at (x, y), in pixels of the given height.
  void text(const std::string& words, int x, int y, int size, Rgb color = {255, 255, 255});

  static int text_width(const std::string& words, int size);  ///< [pixels]

  /// The same with its upper right corner at (x, y).
  void text_ending_at(const std::string& words, int x, int y, int size, Rgb color = {255, 255, 255});

  /// A straight line between two pixels; what lies outside is left out.
  void line(int x0, int y0, int x1, int y1, Rgb color);

  /// A line with a head at its end.
  void arrow(int x0, int y0, int x1, int y1, Rgb color);

  /// The bytes of a PNG.
  std::vector<std::uint8_t> png() const;

  /// Write a PNG. @throws Error{output}
  void write_png(const std::filesystem::path& path) const;

private:
  void add_text(const std::string& words, int x, int y, int size, Rgb color, bool ends_there);

  int width_, height_;
  std::vector<Rgb> pixels_;
};

/// A PNG of 8 bits a channel as a picture. @throws Error{input}
Canvas read_png(const std::filesystem::path& path);

}  // namespace hexmesh
