// SPDX-License-Identifier: Apache-2.0
#include "slice_view.h"

#include <vtkCamera.h>
#include <vtkImageMapper3D.h>
#include <vtkImageProperty.h>

#include <algorithm>
#include <cstring>

namespace hextools {
namespace {

/// Puts a picture into an image of VTK's, whose first row is the lowest.
void set_image(const hexmesh::Canvas& picture, vtkImageData& image) {
  const int width = picture.width(), height = picture.height();
  if (image.GetDimensions()[0] != width || image.GetDimensions()[1] != height) {
    image.SetDimensions(width, height, 1);
    image.AllocateScalars(VTK_UNSIGNED_CHAR, 3);
  }
  for (int y = 0; y < height; ++y)
    std::memcpy(image.GetScalarPointer(0, height - 1 - y, 0), &picture.at(0, y), 3 * static_cast<std::size_t>(width));
  image.Modified();
}

}  // namespace

SliceView::SliceView(hexmesh::SliceAxis axis, const hexmesh::Result& result, const hexmesh::IntensityVolume* scan)
    : axis_(axis), scan_(scan), frame_(hexmesh::bounds_of(result)) {
  const auto d = static_cast<int>(axis);
  low_ = frame_.low[d];
  high_ = frame_.high[d];
  // What is pulled goes beyond where it was.
  constexpr double around = 0.15;
  const hexmesh::Vec3 margin = hexmesh::Vec3::Constant(around * (frame_.high - frame_.low).maxCoeff());
  frame_ = {frame_.low - margin, frame_.high + margin};
  actor_->GetMapper()->SetInputData(image_);
  actor_->GetProperty()->SetInterpolationTypeToLinear();
  renderer_->AddActor(actor_);
  renderer_->GetActiveCamera()->ParallelProjectionOn();
}

void SliceView::move(int steps) { percent_ = std::clamp(percent_ + steps, 0, 100); }

void SliceView::show(const hexmesh::Result& now, const std::string& field,
                     const std::optional<hexmesh::ColorRange>& colors, std::array<int, 2> pixels) {
  hexmesh::SliceOptions options;
  options.before = false;
  options.bounds = frame_;
  options.legend = false;
  constexpr int border = 60;  // of letters and captions
  options.size = std::max(50, std::min(pixels[0], pixels[1]) - border);
  if (field != "segment") {
    options.color_by = field;
    options.colors = colors;
  }
  const hexmesh::SliceRenderer slices(now, scan_, options);
  const hexmesh::Canvas picture = slices.draw(hexmesh::plane_across(axis_, low_ + (high_ - low_) * percent_ / 100.0));
  set_image(picture, *image_);
  renderer_->ResetCamera();
  const double ratio = static_cast<double>(pixels[1]) / pixels[0];
  renderer_->GetActiveCamera()->SetParallelScale(std::max<double>(picture.height(), ratio * picture.width()) / 2);
}

}  // namespace hextools
