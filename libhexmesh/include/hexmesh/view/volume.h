// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "hexmesh/view/canvas.h"
#include "hexmesh/volume/intensity_volume.h"
#include "hexmesh/warp/bounds.h"

namespace hexmesh {

/// The number of planes that opacities are given for.
inline constexpr int reference_planes = 101;

inline constexpr double opaque = 0.5, translucent = 0.05;  ///< opacities of one of them that look so

/// How a segment looks.
struct Appearance {
  std::array<double, 3> color = {0.8, 0.5, 0.4};  ///< RGB, each in [0, 1]
  double opacity = opaque;                        ///< of one of `reference_planes` planes, in [0, 1]
};

struct VolumeOptions {
  Vec3 view = {0, 1, 0};   ///< direction of view, LPS; not zero
  Vec3 up = {0, 0, 1};     ///< what is up on the picture; not along the view
  double perspective = 0;  ///< vertical angle of view [degrees], below 120; 0 = orthographic
  int width = 512, height = 512;
  int planes = reference_planes;
  bool linear_opacity =
      false;           ///< the paper's correction alpha n_old / n_new instead of 1 - (1 - alpha)^(n_old / n_new)
  bool shaded = true;  ///< surfaces lit from the viewer's upper left
  std::optional<double> level;   ///< middle of the grey window; nothing: chosen from the body's values
  std::optional<double> window;  ///< its width
  Rgb background = {24, 24, 24};
  std::map<std::uint16_t, Appearance> appearance;  ///< by label; others as default_appearance says
};

/// Each segment with material in its colour, opaque; or translucent, and what is smaller than the largest one five
/// times as opaque. Segments without material have no cells and are not seen.
std::map<std::uint16_t, Appearance> default_appearance(const Result& result, bool see_through = false);

struct VolumeTexture;
struct VolumeCamera;

/// Draws a deformed scan as planes across the view, blended from the farthest to the nearest.
///
/// Each plane cuts the deformed cells in polygons; their corners lie on the cells' edges and carry the rest positions
/// interpolated between the edges' ends, which place the scan on them. So the scan is never resampled, and a motion
/// costs no more than a still. Source: Nesme, Faure, Payan 2010, section "Volumetric Rendering".
///
/// The scan is classified before it is interpolated: a voxel of a segment has the segment's colour, times its
/// brightness in the grey window, and its opacity; all others are clear. Beside a voxel's centre the product of colour
/// and opacity and the opacity are trilinear.
class VolumeRenderer {
public:
  /// @param scan  without it all of a segment has one colour
  VolumeRenderer(const Result& result, const IntensityVolume* scan, const VolumeOptions& options);
  ~VolumeRenderer();

  /// @param displacement  of the nodes; empty = at rest
  Canvas draw(const std::vector<Vec3>& displacement) const;

  /// Distance between two planes [mm].
  double plane_distance() const;

private:
  const Result& result_;
  VolumeOptions options_;
  std::unique_ptr<const VolumeTexture> texture_;
  std::unique_ptr<const VolumeCamera> camera_;
};

}  // namespace hexmesh
