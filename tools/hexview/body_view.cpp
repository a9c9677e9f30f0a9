// SPDX-License-Identifier: Apache-2.0
#include "body_view.h"

#include <fmt/format.h>
#include <vtkCellArray.h>
#include <vtkCellData.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkProperty.h>
#include <vtkTextProperty.h>
#include <vtkUnsignedCharArray.h>

#include <algorithm>
#include <map>
#include <set>

#include "cli/result_state.h"
#include "hexmesh/view/color_map.h"

namespace hextools {
namespace {

using hexmesh::Vec3;

constexpr int num_colors = 256;

void set_vertices(vtkPolyData& data, const std::vector<Vec3>& places) {
  vtkNew<vtkPoints> points;
  vtkNew<vtkCellArray> vertices;
  for (const Vec3& place : places) {
    const vtkIdType id = points->InsertNextPoint(place.data());
    vertices->InsertNextCell(1, &id);
  }
  data.SetPoints(points);
  data.SetVerts(vertices);
}

}  // namespace

BodyView::BodyView(const hexmesh::Result& result, vtkRenderer& renderer) : renderer_(renderer) {
  const hexmesh::TriangleSurface& surface = result.surface;
  vtkNew<vtkPoints> points;
  places_->SetNumberOfComponents(3);
  places_->SetNumberOfTuples(static_cast<vtkIdType>(surface.points.size()));
  points->SetData(places_);
  surface_->SetPoints(points);

  std::map<std::uint16_t, hexmesh::Rgb> color_of;
  for (const hexmesh::LatticeSegment& s : result.segments) color_of[s.segment.label] = hexmesh::to_rgb(s.segment.color);
  vtkNew<vtkCellArray> triangles;
  vtkNew<vtkUnsignedCharArray> colors;
  colors->SetName("segment");
  colors->SetNumberOfComponents(3);
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    triangles->InsertNextCell({surface.triangles[t][0], surface.triangles[t][1], surface.triangles[t][2]});
    colors->InsertNextTypedTuple(color_of[surface.segment[t]].data());
  }
  surface_->SetPolys(triangles);
  surface_->GetCellData()->SetScalars(colors);

  values_->SetName("field");
  values_->SetNumberOfTuples(static_cast<vtkIdType>(surface.points.size()));
  const hexmesh::CellLocator locator = hexmesh::locator_of(result);
  for (const Vec3& p : surface.points) cell_of_.push_back(locator.locate_position(p).cell);

  colors_->SetNumberOfTableValues(num_colors);
  for (int n = 0; n < num_colors; ++n) {
    const hexmesh::Rgb c = hexmesh::viridis(n / (num_colors - 1.0));
    colors_->SetTableValue(n, c[0] / 255.0, c[1] / 255.0, c[2] / 255.0, 1);
  }
  mapper_->SetInputData(surface_);
  mapper_->SetLookupTable(colors_);
  mapper_->UseLookupTableScalarRangeOn();
  actor_->SetMapper(mapper_);
  actor_->GetProperty()->SetInterpolationToGouraud();
  renderer_.AddActor(actor_);

  legend_->SetLookupTable(colors_);
  legend_->SetNumberOfLabels(5);
  legend_->SetPosition(0.83, 0.2);
  legend_->SetWidth(0.15);
  legend_->SetHeight(0.5);
  legend_->SetBarRatio(0.2);
  legend_->UnconstrainedFontSizeOn();
  vtkTextProperty& title = *legend_title_->GetTextProperty();  // the bar's own is cut at the border of a narrow view
  title.SetJustificationToRight();
  legend_title_->GetPositionCoordinate()->SetCoordinateSystemToNormalizedViewport();
  legend_title_->SetPosition(0.985, 0.71);
  for (vtkTextProperty* text : {&title, legend_->GetLabelTextProperty()}) {
    text->SetFontSize(13);
    text->BoldOff();
    text->ItalicOff();
    text->ShadowOff();
  }
  legend_->VisibilityOff();
  legend_title_->VisibilityOff();
  renderer_.AddViewProp(legend_);
  renderer_.AddViewProp(legend_title_);

  add_held_points(result);
  vtkNew<vtkPolyDataMapper> hand_mapper;
  hand_mapper->SetInputData(hand_);
  hand_actor_->SetMapper(hand_mapper);
  hand_actor_->GetProperty()->SetColor(1, 0.9, 0.1);
  hand_actor_->GetProperty()->SetPointSize(12);
  hand_actor_->GetProperty()->SetLineWidth(2);
  hand_actor_->GetProperty()->RenderPointsAsSpheresOn();
  hand_actor_->PickableOff();
  hand_actor_->VisibilityOff();
  renderer_.AddActor(hand_actor_);
  picker_->SetTolerance(0);
  picker_->PickFromListOn();
  picker_->AddPickList(actor_);
  show(result);
}

/// What is held and not moved, in blue.
void BodyView::add_held_points(const hexmesh::Result& result) {
  const std::set<std::string> moved = moved_by(result);
  std::vector<Vec3> places;
  for (const hexmesh::ConditionPoints& c : result.conditions)
    if (!moved.contains(c.name)) places.insert(places.end(), c.points.begin(), c.points.end());
  set_vertices(*held_, places);
  vtkNew<vtkPolyDataMapper> mapper;
  mapper->SetInputData(held_);
  vtkNew<vtkActor> actor;
  actor->SetMapper(mapper);
  actor->GetProperty()->SetColor(60 / 255.0, 120 / 255.0, 1);
  actor->GetProperty()->SetPointSize(5);
  actor->GetProperty()->LightingOff();
  actor->PickableOff();
  renderer_.AddActor(actor);
}

void BodyView::show(const hexmesh::Result& now) {
  const std::vector<Vec3>& rest = now.surface.points;
  float* to = places_->GetPointer(0);
  for (std::size_t p = 0; p < rest.size(); ++p) {
    const Vec3 at = now.surface_displacement.empty() ? rest[p] : Vec3(rest[p] + now.surface_displacement[p]);
    for (int d = 0; d < 3; ++d) *to++ = static_cast<float>(at[d]);
  }
  places_->Modified();
  surface_->Modified();
  surface_->ComputeBounds();
  if (field_ != "segment") set_values(now);
  draw_hand();
}

void BodyView::set_values(const hexmesh::Result& now) {
  const hexmesh::ColorRange here = hexmesh::color_range(now, field_);
  range_ = range_ ? hexmesh::joined(*range_, here) : here;
  const auto found = now.cell_fields.find(field_);
  for (std::size_t p = 0; p < cell_of_.size(); ++p) {
    double value = 0;
    if (found != now.cell_fields.end())
      value = cell_of_[p] < 0 ? range_->low : found->second[hexmesh::as_size(cell_of_[p])];
    else if (!now.surface_displacement.empty())
      value = now.surface_displacement[p].norm();
    values_->SetValue(static_cast<vtkIdType>(p), static_cast<float>(value));
  }
  values_->Modified();
  colors_->SetTableRange(range_->low, range_->high > range_->low ? range_->high : range_->low + 1);
}

void BodyView::color_by(const std::string& field, const hexmesh::Result& now) {
  if (field != "segment") hexmesh::color_range(now, field);  // refuses what there is not
  field_ = field;
  range_.reset();
  const bool is_field = field_ != "segment";
  surface_->GetPointData()->SetScalars(is_field ? values_.Get() : nullptr);
  if (is_field) {
    set_values(now);
    mapper_->SetScalarModeToUsePointData();
    const std::string unit = hexmesh::unit_of_field(field_);
    legend_title_->SetInput((unit.empty() ? field_ : fmt::format("{} [{}]", field_, unit)).c_str());
  } else {
    mapper_->SetScalarModeToUseCellData();
  }
  legend_->SetVisibility(is_field);
  legend_title_->SetVisibility(is_field);
  surface_->Modified();
}

std::optional<BodyView::Hit> BodyView::pick(int x, int y) {
  if (picker_->Pick(x, y, 0, &renderer_) == 0 || picker_->GetCellId() < 0) return {};
  Hit hit;
  picker_->GetPickPosition(hit.place.data());
  double nearest = INFINITY;
  vtkNew<vtkIdList> corners;
  surface_->GetCellPoints(picker_->GetCellId(), corners);
  for (const vtkIdType id : *corners) {
    const double distance = (place(static_cast<std::size_t>(id)) - hit.place).norm();
    if (!(distance < nearest)) continue;
    nearest = distance;
    hit.point = static_cast<std::size_t>(id);
  }
  return hit;
}

Vec3 BodyView::place(std::size_t point) const {
  const float* p = places_->GetPointer(3 * static_cast<vtkIdType>(point));
  return {p[0], p[1], p[2]};
}

void BodyView::show_hand(std::size_t point, const Vec3& hand) {
  held_point_ = point;
  hand_at_ = hand;
  draw_hand();
}

void BodyView::hide_hand() {
  held_point_.reset();
  draw_hand();
}

void BodyView::draw_hand() {
  hand_actor_->SetVisibility(held_point_.has_value());
  if (!held_point_) return;
  set_vertices(*hand_, {place(*held_point_), hand_at_});
  vtkNew<vtkCellArray> line;
  line->InsertNextCell({0, 1});
  hand_->SetLines(line);
}

}  // namespace hextools
