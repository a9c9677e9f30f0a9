// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/view/canvas.h"

#include <fmt/format.h>
#include <vtkFreeTypeTools.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPNGReader.h>
#include <vtkPNGWriter.h>
#include <vtkSmartPointer.h>
#include <vtkStdString.h>
#include <vtkTextProperty.h>
#include <vtkUnsignedCharArray.h>

#include <algorithm>
#include <cmath>

#include "hexmesh/core/error.h"
#include "hexmesh/file/text_file.h"

namespace hexmesh {

Rgb to_rgb(const std::array<double, 3>& color) {
  Rgb out;
  for (std::size_t c = 0; c < 3; ++c)
    out[c] = static_cast<std::uint8_t>(std::lround(255 * std::clamp(color[c], 0.0, 1.0)));
  return out;
}

Canvas::Canvas(int width, int height, Rgb background)
    : width_(width), height_(height), pixels_(as_size(width) * as_size(height), background) {}

void Canvas::paste(const Canvas& picture, int x, int y) {
  for (int j = std::max(0, -y); j < std::min(picture.height(), height_ - y); ++j)
    for (int i = std::max(0, -x); i < std::min(picture.width(), width_ - x); ++i) at(x + i, y + j) = picture.at(i, j);
}

void Canvas::text(const std::string& words, int x, int y, int size, Rgb color) {
  add_text(words, x, y, size, color, false);
}

void Canvas::text_ending_at(const std::string& words, int x, int y, int size, Rgb color) {
  add_text(words, x, y, size, color, true);
}

namespace {

/// White words; nothing if there are none to draw.
vtkSmartPointer<vtkImageData> picture_of(const std::string& words, int size) {
  vtkNew<vtkTextProperty> style;
  style->SetFontSize(size);
  style->SetColor(1, 1, 1);
  auto image = vtkSmartPointer<vtkImageData>::New();
  std::array<int, 2> dimensions{};
  vtkFreeTypeTools& tools = *vtkFreeTypeTools::GetInstance();
  tools.ScaleToPowerTwoOff();  // no wider than the words
  return tools.RenderString(style, vtkStdString(words), 72, image, dimensions.data()) ? image : nullptr;
}

}  // namespace

int Canvas::text_width(const std::string& words, int size) {
  const auto image = picture_of(words, size);
  return image ? image->GetExtent()[1] - image->GetExtent()[0] + 1 : 0;
}

void Canvas::add_text(const std::string& words, int x, int y, int size, Rgb color, bool ends_there) {
  const auto image = picture_of(words, size);
  if (!image) return;
  const int* extent = image->GetExtent();
  const int width = extent[1] - extent[0] + 1, height = extent[3] - extent[2] + 1;
  for (int j = 0; j < height; ++j)
    for (int i = 0; i < width; ++i) {
      const int px = x + i - (ends_there ? width : 0), py = y + height - 1 - j;  // VTK counts rows from below
      if (px < 0 || py < 0 || px >= width_ || py >= height_) continue;
      const auto* rgba = static_cast<const unsigned char*>(image->GetScalarPointer(extent[0] + i, extent[2] + j, 0));
      for (std::size_t c = 0; c < 3; ++c)
        at(px, py)[c] = static_cast<std::uint8_t>((color[c] * rgba[3] + at(px, py)[c] * (255 - rgba[3])) / 255);
    }
}

void Canvas::line(int x0, int y0, int x1, int y1, Rgb color) {
  const int steps = std::max({std::abs(x1 - x0), std::abs(y1 - y0), 1});
  for (int n = 0; n <= steps; ++n) {
    const double t = static_cast<double>(n) / steps;
    const auto x = static_cast<int>(std::lround(x0 + t * (x1 - x0)));
    const auto y = static_cast<int>(std::lround(y0 + t * (y1 - y0)));
    if (x >= 0 && y >= 0 && x < width_ && y < height_) at(x, y) = color;
  }
}

void Canvas::arrow(int x0, int y0, int x1, int y1, Rgb color) {
  line(x0, y0, x1, y1, color);
  const double length = std::hypot(x1 - x0, y1 - y0);
  if (length < 2) return;
  const double head = std::min(6.0, length / 2), x = (x1 - x0) / length, y = (y1 - y0) / length;
  for (const double side : {-0.5, 0.5})
    line(x1, y1, x1 + static_cast<int>(std::lround(head * (-x - side * y))),
         y1 + static_cast<int>(std::lround(head * (-y + side * x))), color);
}

namespace {

vtkSmartPointer<vtkPNGWriter> png_writer(const Canvas& canvas) {
  vtkNew<vtkImageData> image;
  image->SetDimensions(canvas.width(), canvas.height(), 1);
  image->AllocateScalars(VTK_UNSIGNED_CHAR, 3);
  for (int y = 0; y < canvas.height(); ++y)
    for (int x = 0; x < canvas.width(); ++x) {
      auto* to = static_cast<unsigned char*>(image->GetScalarPointer(x, canvas.height() - 1 - y, 0));
      std::copy_n(canvas.at(x, y).begin(), 3, to);
    }
  auto writer = vtkSmartPointer<vtkPNGWriter>::New();
  writer->SetInputData(image);
  return writer;
}

}  // namespace

std::vector<std::uint8_t> Canvas::png() const {
  const auto writer = png_writer(*this);
  writer->WriteToMemoryOn();
  writer->Write();
  vtkUnsignedCharArray* bytes = writer->GetResult();
  return {bytes->GetPointer(0), bytes->GetPointer(0) + bytes->GetNumberOfValues()};
}

void Canvas::write_png(const std::filesystem::path& path) const {
  const std::vector<std::uint8_t> bytes = png();  // libpng says on standard error where it cannot write to a file
  write_whole_file(path, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

Canvas read_png(const std::filesystem::path& path) {
  vtkNew<vtkPNGReader> reader;
  if (!reader->CanReadFile(path.c_str()))
    throw Error(ErrorKind::input, fmt::format("'{}' is no PNG file, expected one", path.string()));
  reader->SetFileName(path.c_str());
  reader->Update();
  vtkImageData* image = reader->GetOutput();
  const int channels = image->GetNumberOfScalarComponents();
  if (image->GetScalarType() != VTK_UNSIGNED_CHAR || channels < 3)
    throw Error(ErrorKind::input, fmt::format("'{}' is no picture of 8 bits a channel in colour", path.string()));
  const int* size = image->GetDimensions();
  Canvas canvas(size[0], size[1]);
  for (int y = 0; y < size[1]; ++y)
    for (int x = 0; x < size[0]; ++x)
      std::copy_n(static_cast<const unsigned char*>(image->GetScalarPointer(x, size[1] - 1 - y, 0)), 3,
                  canvas.at(x, y).begin());
  return canvas;
}

}  // namespace hexmesh
