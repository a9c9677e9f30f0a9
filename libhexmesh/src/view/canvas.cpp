// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/view/canvas.h"

#include <fmt/format.h>
#include <vtkFreeTypeTools.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPNGWriter.h>
#include <vtkStdString.h>
#include <vtkTextProperty.h>

#include <algorithm>

#include "hexmesh/core/error.h"

namespace hexmesh {

Canvas::Canvas(int width, int height, Rgb background)
    : width_(width),
      height_(height),
      pixels_(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), background) {}

void Canvas::paste(const Canvas& picture, int x, int y) {
  for (int j = std::max(0, -y); j < std::min(picture.height(), height_ - y); ++j)
    for (int i = std::max(0, -x); i < std::min(picture.width(), width_ - x); ++i) at(x + i, y + j) = picture.at(i, j);
}

void Canvas::text(const std::string& words, int x, int y, int size, Rgb color) {
  vtkNew<vtkTextProperty> style;
  style->SetFontSize(size);
  style->SetColor(1, 1, 1);
  vtkNew<vtkImageData> image;
  std::array<int, 2> dimensions{};
  if (!vtkFreeTypeTools::GetInstance()->RenderString(style, vtkStdString(words), 72, image, dimensions.data())) return;
  const int* extent = image->GetExtent();
  const int height = extent[3] - extent[2] + 1;
  for (int j = 0; j < height; ++j)
    for (int i = 0; i <= extent[1] - extent[0]; ++i) {
      const int px = x + i, py = y + height - 1 - j;  // VTK counts rows from below
      if (px < 0 || py < 0 || px >= width_ || py >= height_) continue;
      const auto* rgba = static_cast<const unsigned char*>(image->GetScalarPointer(extent[0] + i, extent[2] + j, 0));
      for (std::size_t c = 0; c < 3; ++c)
        at(px, py)[c] = static_cast<std::uint8_t>((color[c] * rgba[3] + at(px, py)[c] * (255 - rgba[3])) / 255);
    }
}

void Canvas::write_png(const std::filesystem::path& path) const {
  vtkNew<vtkImageData> image;
  image->SetDimensions(width_, height_, 1);
  image->AllocateScalars(VTK_UNSIGNED_CHAR, 3);
  for (int y = 0; y < height_; ++y)
    for (int x = 0; x < width_; ++x) {
      auto* to = static_cast<unsigned char*>(image->GetScalarPointer(x, height_ - 1 - y, 0));
      std::copy_n(at(x, y).begin(), 3, to);
    }
  vtkNew<vtkPNGWriter> writer;
  writer->SetFileName(path.c_str());
  writer->SetInputData(image);
  writer->Write();
  if (writer->GetErrorCode() != 0) throw Error(ErrorKind::output, fmt::format("cannot write '{}'", path.string()));
}

}  // namespace hexmesh
