// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <set>
#include <string>
#include <vector>

#include "hexmesh/lattice/locator.h"
#include "hexmesh/view/canvas.h"
#include "hexmesh/view/grey_window.h"
#include "hexmesh/view/obstacle.h"
#include "hexmesh/warp/displacement_field.h"

namespace hexmesh {

/// Slices as a radiologist reads them: the patient's left on the right of axial and coronal pictures, front up in
/// axial, head up in coronal and sagittal ones, front on the left of sagittal ones.
enum class SliceAxis { sagittal = 0, coronal = 1, axial = 2 };  ///< = the LPS axis across the slice

/// A plane and how it lies on the picture.
struct SlicePlane {
  std::string name;  ///< for captions, e.g. "axial"
  Vec3 point;        ///< on it [mm]
  Vec3 right, down;  ///< unit vectors; right x down is the direction of view
};

/// @param position  LPS coordinate across the slice [mm]
SlicePlane plane_across(SliceAxis axis, double position);

/// Any plane, turned as the one of the three that it is nearest to.
/// @pre normal is not zero
SlicePlane oblique_plane(const Vec3& point, const Vec3& normal);

/// "R", "LA", ...: where a direction points to in the patient; a second letter where it is oblique.
std::string orientation_letters(const Vec3& direction);

/// Which values the ends of the colours stand for.
struct ColorRange {
  double low = 0, high = 1;
  double least = 0, greatest = 1;  ///< of the field, which may lie beyond
};

/// The range that shows a field well: displacements from 0 to the largest; of a field of the cells, all but the lowest
/// and highest hundredth; of one that is the same everywhere, 5 % to both sides.
/// @param color_by   "displacement" or a cell field
/// @param magnified  what the result's displacement was multiplied by
/// @throws Error{usage} where there is no such field, naming those that there are
ColorRange color_range(const Result& result, const std::string& color_by, double magnified = 1);

/// The range that shows both.
ColorRange joined(const ColorRange& a, const ColorRange& b);

struct SliceOptions {
  double pixel_mm = 0;  ///< 0: such that the longer side has about `size` pixels
  int size = 420;
  std::optional<double> level;           ///< middle of the grey window; nothing: chosen from the body's values
  std::optional<double> window;          ///< its width
  double margin_mm = 12;                 ///< shown around the body
  bool before = true, deformed = true;   ///< which of the two pictures; side by side where both
  bool outlines = true;                  ///< of the segments, in their colours
  bool lattice = false;                  ///< borders between cells
  bool arrows = false;                   ///< the part of the displacement within the plane, from where to where
  std::set<std::string> moved = {};      ///< names of the conditions that move their points; the others hold them
  bool scene = false;                    ///< points of conditions near the plane, and where those go that are moved
  std::vector<Obstacle> obstacles = {};  ///< with `scene`, on the deformed picture if there is one
  TriangleSurface target = {};           ///< whose outline is drawn where it is, e.g. what a body was fitted to
  double grid_mm = 0;                    ///< distance of lines that move with the material; 0: none
  std::string color_by;                  ///< "displacement" [mm] or a cell field, over the scan, with a legend
  bool legend = true;                    ///< beside each picture; a contact sheet has one for all
  std::optional<Bounds> bounds;          ///< what to show; nothing: the body at rest and deformed
  bool white = false;                    ///< paper, and what surrounds the body lightened rather than darkened
  double magnified = 1;  ///< what the result's displacement was multiplied by: captions tell, colours do not
  std::optional<ColorRange> colors;  ///< nothing: as color_range() says
};

/// Draws slices of the scan before and after the deformation.
///
/// A pixel at x shows the scan at the rest position X of the material that is there now (see displacement_to_rest).
/// Places that the body left are empty; the surroundings, which are not simulated, are shown where they were, faded.
class SliceRenderer {
public:
  /// @param scan  without it, the body is shown in its segments' colours
  /// @throws Error{usage} as color_range(), or where options.pixel_mm makes pictures larger than 8192 pixels
  SliceRenderer(const Result& result, const IntensityVolume* scan, const SliceOptions& options);

  /// Extent of what is shown along a direction [mm].
  std::pair<double, double> range(const Vec3& direction) const;

  /// The picture with its caption, letters of orientation, scale bar and legend.
  /// @param note  added to the caption
  /// @throws Error{usage} where the plane is oblique and its picture too large
  Canvas draw(const SlicePlane& plane, const std::string& note = "") const;

  /// Pictures of one size in rows and columns, with one legend if there are colours.
  Canvas contact_sheet(const std::vector<Canvas>& pictures) const;

private:
  Grid frame(const SlicePlane& plane) const;
  Canvas paint(const Grid& frame, const DisplacementField& to_rest, bool deformed) const;
  void add_arrows(const Grid& frame, const DisplacementField& to_rest, bool deformed, Canvas& canvas) const;
  std::pair<std::string, double> shown_unit() const;  ///< of colours, and how many of it are one of the field's
  void add_scene(const Grid& frame, bool deformed, Canvas& canvas) const;
  void add_target(const Grid& frame, Canvas& canvas) const;
  Canvas legend(int height) const;  ///< of a bar of that height
  std::int32_t cell_at(const Vec3& rest) const;
  double color_value(const Vec3& rest, const Vec3& displacement) const;
  std::uint8_t grey(double value) const;
  std::uint8_t faded(std::uint8_t grey) const;

  const Result& result_;
  const IntensityVolume* scan_;
  SliceOptions options_;
  CellLocator locator_;
  std::vector<std::optional<Rgb>> color_of_label_;
  std::vector<bool> has_material_;  ///< by label
  Bounds bounds_;
  GreyWindow window_;
  const std::vector<double>* field_ = nullptr;  ///< of color_by, if it is one of the cells
  ColorRange colors_;
};

/// Pictures of one size in rows and columns.
Canvas contact_sheet(const std::vector<Canvas>& pictures, bool white = false);

/// The same body, displaced by a multiple of what it was.
Result magnified(Result result, double factor);

/// The unit that a field of a result is stored in, "" for plain numbers.
std::string unit_of_field(const std::string& name);

}  // namespace hexmesh
