// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "hexmesh/file/result_file.h"
#include "hexmesh/view/canvas.h"

namespace hexmesh {

/// Slices as a radiologist reads them: the patient's left on the right of axial and coronal pictures, front up in
/// axial, head up in coronal and sagittal ones, front on the left of sagittal ones.
enum class SliceAxis { sagittal = 0, coronal = 1, axial = 2 };  ///< = the LPS axis across the slice

struct SliceOptions {
  double pixel_mm = 0;           ///< 0: such that the longer side has about 420 pixels
  std::optional<double> level;   ///< middle of the grey window; nothing: chosen from the body's values
  std::optional<double> window;  ///< its width
  double margin_mm = 12;         ///< shown around the body
};

/// Draws slices of the scan before and after the deformation.
///
/// A pixel at x shows the scan at the rest position X of the material that is there now: the deformed cell that holds x
/// is found and its trilinear map inverted. Places that the body left are black; the surroundings, which are not
/// simulated, are shown where they were, darkened.
class SliceRenderer {
public:
  /// @param scan  without it, the body is shown in its segments' colours with a 10 mm grid of the rest shape
  SliceRenderer(const Result& result, const IntensityVolume* scan, const SliceOptions& options);

  /// Extent of the body along an LPS axis, at rest and deformed together [mm].
  std::pair<double, double> range(SliceAxis axis) const;

  /// Before (left) and after (right), with segment outlines in their colours.
  /// @param position  LPS coordinate of the plane [mm]
  Canvas before_and_after(SliceAxis axis, double position) const;

private:
  struct Frame;
  Frame frame(SliceAxis axis, double position) const;
  Canvas draw(const Frame& frame, const std::vector<Vec3>& rest) const;
  std::vector<Vec3> rest_positions_before(const Frame& frame) const;
  std::vector<Vec3> rest_positions_after(const Frame& frame) const;
  std::uint16_t label_at(const Vec3& rest) const;
  std::uint8_t grey(double value) const;

  const Result& result_;
  const IntensityVolume* scan_;
  SliceOptions options_;
  std::vector<std::optional<Rgb>> color_of_label_;
  Vec3 low_, high_;  ///< box of the body at rest and deformed [mm]
  double black_ = 0, white_ = 1;
};

}  // namespace hexmesh
