// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/view/vtk_export.h"

#include <fmt/format.h>
#include <vtkCapsuleSource.h>
#include <vtkCellArray.h>
#include <vtkCellData.h>
#include <vtkCellType.h>
#include <vtkCubeSource.h>
#include <vtkCylinderSource.h>
#include <vtkDoubleArray.h>
#include <vtkFieldData.h>
#include <vtkIdList.h>
#include <vtkIntArray.h>
#include <vtkNew.h>
#include <vtkPlaneSource.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkSmartPointer.h>
#include <vtkSphereSource.h>
#include <vtkStringArray.h>
#include <vtkUnsignedCharArray.h>
#include <vtkUnsignedShortArray.h>
#include <vtkUnstructuredGrid.h>
#include <vtkXMLPolyDataWriter.h>
#include <vtkXMLUnstructuredGridWriter.h>

#include <Eigen/Geometry>
#include <map>

#include "hexmesh/core/error.h"
#include "hexmesh/core/printable.h"
#include "hexmesh/file/text_file.h"
#include "hexmesh/view/canvas.h"
#include "hexmesh/view/obstacle.h"

namespace hexmesh {
namespace {

void add_vectors(vtkPointSet& set, const char* name, const std::vector<Vec3>& values) {
  vtkNew<vtkDoubleArray> array;
  array->SetName(name);
  array->SetNumberOfComponents(3);
  array->SetNumberOfTuples(static_cast<vtkIdType>(values.size()));
  for (std::size_t n = 0; n < values.size(); ++n) array->SetTuple(static_cast<vtkIdType>(n), values[n].data());
  set.GetPointData()->AddArray(array);
}

/// @param displacement  empty: at rest, no such data
void set_points(vtkPointSet& set, const std::vector<Vec3>& rest, const std::vector<Vec3>& displacement,
                Configuration configuration) {
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  points->SetNumberOfPoints(static_cast<vtkIdType>(rest.size()));
  for (std::size_t n = 0; n < rest.size(); ++n) {
    const bool moves = configuration == Configuration::deformed && !displacement.empty();
    const Vec3 p = moves ? Vec3(rest[n] + displacement[n]) : rest[n];
    points->SetPoint(static_cast<vtkIdType>(n), p.data());
  }
  set.SetPoints(points);
  if (displacement.empty()) return;
  add_vectors(set, "displacement", displacement);
  set.GetPointData()->SetActiveVectors("displacement");
}

void add_segment(vtkDataSet& set, const std::vector<std::uint16_t>& labels,
                 const std::vector<LatticeSegment>& segments) {
  vtkNew<vtkUnsignedShortArray> array;
  array->SetName("segment");
  array->SetNumberOfTuples(static_cast<vtkIdType>(labels.size()));
  for (std::size_t n = 0; n < labels.size(); ++n) array->SetValue(static_cast<vtkIdType>(n), labels[n]);
  set.GetCellData()->AddArray(array);

  std::map<std::uint16_t, Rgb> color_of;
  for (const LatticeSegment& s : segments) color_of[s.segment.label] = to_rgb(s.segment.color);
  vtkNew<vtkUnsignedCharArray> colors;
  colors->SetName("segment_color");
  colors->SetNumberOfComponents(3);
  colors->SetNumberOfTuples(static_cast<vtkIdType>(labels.size()));
  for (std::size_t n = 0; n < labels.size(); ++n)
    colors->SetTypedTuple(static_cast<vtkIdType>(n), color_of[labels[n]].data());
  set.GetCellData()->AddArray(colors);
}

/// Names of the labels and the units, where ParaView's Information tab shows them.
void add_notes(vtkDataSet& set, const Result& result) {
  vtkNew<vtkStringArray> segments;
  segments->SetName("segments");
  for (const LatticeSegment& s : result.segments)
    segments->InsertNextValue(fmt::format("{} = {}", s.segment.label, s.segment.name));
  set.GetFieldData()->AddArray(segments);
  vtkNew<vtkStringArray> units;
  units->SetName("units");
  units->InsertNextValue(
      "mm, N, MPa, s; patient LPS; displacement, rest_displacement, displacement_from_rest, contact_gap in mm; "
      "velocity in mm/s; "
      "load, contact_force, reaction in N; "
      "strain_energy_density in "
      "N/mm^2; "
      "von_mises_stress, pressure, smoothed_pressure, contact_pressure, young_modulus in MPa; rotation_degrees in "
      "degrees; all else 1");
  set.GetFieldData()->AddArray(units);
}

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text)
    if (c == '&')
      out += "&amp;";
    else if (c == '<')
      out += "&lt;";
    else if (c == '"')
      out += "&quot;";
    else
      out += c;
  return out;
}

template <class Writer, class Data>
void write(Data& data, const std::filesystem::path& path) {
  vtkObject::GlobalWarningDisplayOff();  // the error that is thrown says it
  vtkNew<Writer> writer;
  writer->SetFileName(path.c_str());
  writer->SetInputData(&data);
  writer->SetDataModeToAppended();
  writer->EncodeAppendedDataOff();
  if (writer->Write() != 1 || writer->GetErrorCode() != 0)
    throw Error(ErrorKind::output, fmt::format("cannot write '{}'", path.string()));
}

}  // namespace

void write_vtu(const Result& result, Configuration configuration, const std::filesystem::path& path) {
  vtkNew<vtkUnstructuredGrid> grid;
  set_points(*grid, result.nodes, result.displacement, configuration);
  if (!result.displacement_raw.empty()) add_vectors(*grid, "displacement_raw", result.displacement_raw);
  if (!result.rest_displacement.empty()) {
    add_vectors(*grid, "rest_displacement", result.rest_displacement);
    add_vectors(*grid, "displacement_from_rest", displacement_from_rest(result));
  }
  if (!result.velocity.empty()) add_vectors(*grid, "velocity", result.velocity);
  if (!result.load.empty()) add_vectors(*grid, "load", result.load);
  if (!result.contact_force.empty()) add_vectors(*grid, "contact_force", result.contact_force);
  vtkNew<vtkCellArray> cells;
  cells->AllocateEstimate(static_cast<vtkIdType>(result.cells.size()), 8);
  for (const auto& nodes : result.cell_nodes) {
    std::array<vtkIdType, 8> ids;
    for (std::size_t a = 0; a < 8; ++a) ids[a] = nodes[corners_around_faces[a]];
    cells->InsertNextCell(8, ids.data());
  }
  grid->SetCells(VTK_HEXAHEDRON, cells);
  add_segment(*grid, result.segment, result.segments);
  for (const auto& [name, values] : result.cell_fields) {
    vtkNew<vtkDoubleArray> array;
    array->SetName(escaped(printable_line(name)).c_str());  // VTK's writer takes it as it is
    array->SetNumberOfTuples(static_cast<vtkIdType>(values.size()));
    for (std::size_t n = 0; n < values.size(); ++n) array->SetValue(static_cast<vtkIdType>(n), values[n]);
    grid->GetCellData()->AddArray(array);
  }
  add_notes(*grid, result);
  write<vtkXMLUnstructuredGridWriter>(*grid, path);
}

void write_vtp(const Result& result, Configuration configuration, const std::filesystem::path& path) {
  vtkNew<vtkPolyData> surface;
  set_points(*surface, result.surface.points, result.surface_displacement, configuration);
  vtkNew<vtkCellArray> triangles;
  for (const auto& t : result.surface.triangles) {
    const std::array<vtkIdType, 3> ids = {t[0], t[1], t[2]};
    triangles->InsertNextCell(3, ids.data());
  }
  surface->SetPolys(triangles);
  add_segment(*surface, result.surface.segment, result.segments);
  add_notes(*surface, result);
  write<vtkXMLPolyDataWriter>(*surface, path);
}

void write_conditions_vtp(const Result& result, const std::vector<ConditionForce>& forces, Configuration configuration,
                          const std::filesystem::path& path) {
  std::vector<Vec3> points, displacement, reaction, axes;
  vtkNew<vtkStringArray> names;
  names->SetName("name");
  vtkNew<vtkIntArray> numbers;
  numbers->SetName("condition");
  vtkNew<vtkCellArray> vertices;
  for (std::size_t c = 0; c < result.conditions.size(); ++c) {
    const ConditionPoints& condition = result.conditions[c];
    for (std::size_t p = 0; p < condition.points.size(); ++p) {
      const vtkIdType id = std::ssize(points);
      vertices->InsertNextCell(1, &id);
      points.push_back(condition.points[p]);
      displacement.push_back(condition.displacement[p]);
      reaction.push_back(forces[c].reaction);
      axes.emplace_back(condition.axes[0], condition.axes[1], condition.axes[2]);
      names->InsertNextValue(condition.name);
      numbers->InsertNextValue(static_cast<int>(c));
    }
  }
  vtkNew<vtkPolyData> set;
  set_points(*set, points, displacement, configuration);
  set->SetVerts(vertices);
  set->GetPointData()->AddArray(names);
  set->GetPointData()->AddArray(numbers);
  add_vectors(*set, "reaction", reaction);
  add_vectors(*set, "axes", axes);
  add_notes(*set, result);
  write<vtkXMLPolyDataWriter>(*set, path);
}

namespace {

constexpr int parts_around = 48;

/// A source's shape with its axes turned, in another place.
vtkSmartPointer<vtkPolyData> placed(vtkPolyDataAlgorithm& source, const Mat3& axes, const Vec3& middle) {
  source.Update();
  vtkSmartPointer<vtkPolyData> shape = source.GetOutput();
  for (vtkIdType p = 0; p < shape->GetNumberOfPoints(); ++p) {
    const Vec3 at = middle + axes * Eigen::Map<const Vec3>(shape->GetPoint(p));
    shape->GetPoints()->SetPoint(p, at.data());
  }
  return shape;
}

/// Those of a source whose axis is that of y.
Mat3 axes_along(const Vec3& way) {
  Mat3 axes;
  axes.col(1) = way.normalized();
  axes.col(0) = axes.col(1).unitOrthogonal();
  axes.col(2) = axes.col(0).cross(axes.col(1));
  return axes;
}

/// @param middle, half  of the body, beside which a plane is shown
vtkSmartPointer<vtkPolyData> triangles_of(const Obstacle& o, const Vec3& middle, double half) {
  if (const auto* plane = std::get_if<HalfSpace>(&o.solid)) {
    vtkNew<vtkPlaneSource> square;
    const Vec3 across = plane->normal.unitOrthogonal(), beside = plane->normal.cross(across);
    const Vec3 corner = middle - o.depth(middle) * plane->normal - half * (across + beside);
    const Vec3 next = corner + 2 * half * across, last = corner + 2 * half * beside;
    square->SetOrigin(corner[0], corner[1], corner[2]);
    square->SetPoint1(next[0], next[1], next[2]);
    square->SetPoint2(last[0], last[1], last[2]);
    square->Update();
    return square->GetOutput();
  }
  if (const auto* ball = std::get_if<Ball>(&o.solid)) {
    vtkNew<vtkSphereSource> source;
    source->SetCenter(ball->center[0], ball->center[1], ball->center[2]);
    source->SetRadius(ball->radius);
    source->SetThetaResolution(parts_around);
    source->SetPhiResolution(parts_around / 2);
    source->Update();
    return source->GetOutput();
  }
  if (const auto* capsule = std::get_if<Capsule>(&o.solid)) {
    vtkNew<vtkCapsuleSource> source;
    source->SetRadius(capsule->radius);
    source->SetCylinderLength((capsule->to - capsule->from).norm());
    source->SetThetaResolution(parts_around);
    source->SetPhiResolution(parts_around / 2);
    return placed(*source, axes_along(capsule->to - capsule->from), (capsule->from + capsule->to) / 2);
  }
  if (const auto* cylinder = std::get_if<Cylinder>(&o.solid)) {
    vtkNew<vtkCylinderSource> source;
    source->SetRadius(cylinder->radius);
    source->SetHeight((cylinder->to - cylinder->from).norm());
    source->SetResolution(parts_around);
    return placed(*source, axes_along(cylinder->to - cylinder->from), (cylinder->from + cylinder->to) / 2);
  }
  if (const auto* block = std::get_if<Block>(&o.solid)) {
    vtkNew<vtkCubeSource> source;
    source->SetXLength(2 * block->half[0]);
    source->SetYLength(2 * block->half[1]);
    source->SetZLength(2 * block->half[2]);
    return placed(*source, block->axes, block->center);
  }
  const TriangleSurface& surface = std::get<std::shared_ptr<const Enclosed>>(o.solid)->surface();
  auto out = vtkSmartPointer<vtkPolyData>::New();
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  vtkNew<vtkCellArray> faces;
  for (const Vec3& p : surface.points) points->InsertNextPoint(p.data());
  for (const auto& t : surface.triangles) faces->InsertNextCell({t[0], t[1], t[2]});
  out->SetPoints(points);
  out->SetPolys(faces);
  return out;
}

}  // namespace

void write_obstacles_vtp(const std::vector<Obstacle>& obstacles, const Bounds& body,
                         const std::filesystem::path& path) {
  const Vec3 middle = (body.low + body.high) / 2;
  const double half = (body.high - body.low).norm() / 2;
  vtkNew<vtkPolyData> set;
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  vtkNew<vtkCellArray> faces;
  vtkNew<vtkIntArray> numbers;
  numbers->SetName("obstacle");
  vtkNew<vtkStringArray> names;
  names->SetName("name");
  for (std::size_t n = 0; n < obstacles.size(); ++n) {
    const vtkSmartPointer<vtkPolyData> shape = triangles_of(obstacles[n], middle, half);
    vtkPolyData& made = *shape;
    const vtkIdType first = points->GetNumberOfPoints();
    for (vtkIdType p = 0; p < made.GetNumberOfPoints(); ++p) points->InsertNextPoint(made.GetPoint(p));
    for (vtkIdType f = 0; f < made.GetNumberOfCells(); ++f) {
      vtkNew<vtkIdList> corners;
      made.GetCellPoints(f, corners);
      for (vtkIdType c = 0; c < corners->GetNumberOfIds(); ++c) corners->SetId(c, first + corners->GetId(c));
      faces->InsertNextCell(corners);
      numbers->InsertNextValue(static_cast<int>(n));
      names->InsertNextValue(obstacles[n].name);
    }
  }
  set->SetPoints(points);
  set->SetPolys(faces);
  set->GetCellData()->AddArray(numbers);
  set->GetCellData()->AddArray(names);
  write<vtkXMLPolyDataWriter>(*set, path);
}

void write_pvd(const std::vector<std::pair<double, std::string>>& files, const std::filesystem::path& path) {
  std::string out =
      "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"0.1\" byte_order=\"LittleEndian\">\n"
      "  <Collection>\n";
  for (const auto& [time, file] : files)
    out += fmt::format("    <DataSet timestep=\"{:.9g}\" part=\"0\" file=\"{}\"/>\n", time, escaped(file));
  write_whole_file(path, out + "  </Collection>\n</VTKFile>\n");
}

}  // namespace hexmesh
