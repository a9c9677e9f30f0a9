// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vtkImageActor.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkRenderer.h>

#include "hexmesh/view/slice.h"
#include "hexmesh/volume/intensity_volume.h"

namespace hextools {

/// A slice of the deformed scan along one axis, in a renderer of its own.
class SliceView {
public:
  /// @param result  of the body, where it is at first
  /// @param scan    may be null; must outlive this
  SliceView(hexmesh::SliceAxis axis, const hexmesh::Result& result, const hexmesh::IntensityVolume* scan);

  vtkRenderer& renderer() { return *renderer_; }
  /// @param field   "segment" or a field, with the range of its colours
  /// @param pixels  of the renderer, width and height
  void show(const hexmesh::Result& now, const std::string& field, const std::optional<hexmesh::ColorRange>& colors,
            std::array<int, 2> pixels);
  void move(int steps);  ///< to another plane, by hundredths of the body

private:
  hexmesh::SliceAxis axis_;
  const hexmesh::IntensityVolume* scan_;
  hexmesh::Bounds frame_;
  double low_, high_;  ///< of the body along the axis [mm]
  int percent_ = 50;   ///< of the way
  vtkNew<vtkRenderer> renderer_;
  vtkNew<vtkImageData> image_;
  vtkNew<vtkImageActor> actor_;
};

}  // namespace hextools
