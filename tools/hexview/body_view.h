// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vtkActor.h>
#include <vtkCellPicker.h>
#include <vtkFloatArray.h>
#include <vtkLookupTable.h>
#include <vtkNew.h>
#include <vtkPolyData.h>
#include <vtkPolyDataMapper.h>
#include <vtkRenderer.h>
#include <vtkScalarBarActor.h>
#include <vtkTextActor.h>

#include <optional>
#include <string>
#include <vector>

#include "hexmesh/result/result.h"
#include "hexmesh/view/slice.h"

namespace hextools {

/// The deformed surface of a body in a renderer, in the colours of its segments or of a field, with the points that
/// conditions hold and the hand that pulls.
class BodyView {
public:
  /// @param result  with its surface; also of all that is shown later
  BodyView(const hexmesh::Result& result, vtkRenderer& renderer);

  /// Shows a state. Colours once shown stay: their range grows with what it has to hold.
  void show(const hexmesh::Result& now);

  /// @param field  "segment", "displacement" or a cell field; another range of colours begins
  /// @throws Error{usage} where there is no such field
  void color_by(const std::string& field, const hexmesh::Result& now);
  const std::string& field() const { return field_; }
  const std::optional<hexmesh::ColorRange>& colors() const { return range_; }

  struct Hit {
    std::size_t point = 0;  ///< of the surface
    hexmesh::Vec3 place;    ///< of the surface under the pixel [mm]
  };
  /// What the body shows at a pixel.
  std::optional<Hit> pick(int x, int y);
  hexmesh::Vec3 place(std::size_t point) const;  ///< of a point of the surface now [mm]

  /// The hand that pulls a point, with a line to the point.
  void show_hand(std::size_t point, const hexmesh::Vec3& hand);
  void hide_hand();

private:
  void set_values(const hexmesh::Result& now);
  void draw_hand();
  void add_held_points(const hexmesh::Result& result);

  vtkRenderer& renderer_;
  vtkNew<vtkPolyData> surface_, hand_, held_;
  vtkNew<vtkFloatArray> places_, values_, segment_;
  vtkNew<vtkPolyDataMapper> mapper_;
  vtkNew<vtkActor> actor_, hand_actor_;
  vtkNew<vtkLookupTable> colors_;
  vtkNew<vtkScalarBarActor> legend_;
  vtkNew<vtkTextActor> legend_title_;
  vtkNew<vtkCellPicker> picker_;
  std::optional<std::size_t> held_point_;
  hexmesh::Vec3 hand_at_ = hexmesh::Vec3::Zero();  ///< [mm]
  std::vector<std::int32_t> cell_of_;              ///< of each point of the surface, -1 for none
  std::string field_ = "segment";
  std::optional<hexmesh::ColorRange> range_;
};

}  // namespace hextools
