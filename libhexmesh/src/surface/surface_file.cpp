// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/surface/surface_file.h"

#include <CGAL/IO/polygon_soup_io.h>
#include <CGAL/Simple_cartesian.h>
#include <fmt/format.h>
#include <vtkCellArray.h>
#include <vtkFieldData.h>
#include <vtkIdList.h>
#include <vtkNew.h>
#include <vtkStringArray.h>
#include <vtkTriangleFilter.h>
#include <vtkXMLPolyDataReader.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <sstream>

#include "../core/text.h"
#include "../file/refuse.h"
#include "from_vtk.h"
#include "hexmesh/core/error.h"
#include "hexmesh/file/text_file.h"
#include "surface_header.h"

namespace hexmesh {
namespace {

using Point = CGAL::Simple_cartesian<double>::Point_3;

std::string ending_of(const std::filesystem::path& path) { return lower(path.extension().string()); }

bool says_ras(const std::filesystem::path& path) {
  std::string start(1024, '\0');
  std::ifstream(path, std::ios::binary).read(start.data(), static_cast<std::streamsize>(start.size()));
  return start.find("SPACE=RAS") != std::string::npos;
}

/// All polylines of a mesh.
std::vector<std::vector<Vec3>> lines_of(vtkPolyData& mesh) {
  std::vector<std::vector<Vec3>> out;
  vtkCellArray* lines = mesh.GetLines();
  vtkNew<vtkIdList> ids;
  for (vtkIdType n = 0; n < lines->GetNumberOfCells(); ++n) {
    lines->GetCellAtId(n, ids);
    out.emplace_back();
    for (vtkIdType a = 0; a < ids->GetNumberOfIds(); ++a) out.back().push_back(Vec3::Map(mesh.GetPoint(ids->GetId(a))));
  }
  return out;
}

/// Whether a mesh names only points that it has.
bool is_consistent(vtkPolyData& mesh) {
  const vtkIdType count = mesh.GetNumberOfPoints();
  vtkNew<vtkIdList> ids;
  for (vtkCellArray* cells : {mesh.GetPolys(), mesh.GetLines(), mesh.GetStrips(), mesh.GetVerts()})
    for (vtkIdType n = 0; n < cells->GetNumberOfCells(); ++n) {
      cells->GetCellAtId(n, ids);
      for (vtkIdType a = 0; a < ids->GetNumberOfIds(); ++a)
        if (ids->GetId(a) < 0 || ids->GetId(a) >= count) return false;
    }
  return true;
}

/// RAS to LPS.
void turn(Shape& shape) {
  for (Vec3& p : shape.surface.points) p.head<2>() *= -1;
  for (auto& line : shape.lines)
    for (Vec3& p : line) p.head<2>() *= -1;
}

Shape read_vtp(const std::filesystem::path& path) {
  vtkObject::GlobalWarningDisplayOff();
  vtkNew<vtkXMLPolyDataReader> reader;
  if (!reader->CanReadFile(path.c_str())) refuse(path, "is no VTK XML PolyData file");
  reader->SetFileName(path.c_str());
  reader->Update();
  if (reader->GetErrorCode() != 0 || !is_consistent(*reader->GetOutput())) refuse(path, "is damaged");
  vtkNew<vtkTriangleFilter> triangles;
  triangles->SetInputData(reader->GetOutput());
  triangles->PassVertsOff();
  triangles->PassLinesOff();
  triangles->Update();
  Shape shape{from_vtk(*triangles->GetOutput()), lines_of(*reader->GetOutput())};
  auto* space = vtkStringArray::SafeDownCast(reader->GetOutput()->GetFieldData()->GetAbstractArray("SPACE"));
  if (space && space->GetNumberOfValues() > 0 && space->GetValue(0) == "RAS") turn(shape);
  return shape;
}

/// The line elements of an OBJ file, which CGAL's reader leaves out.
std::vector<std::vector<Vec3>> obj_lines(const std::filesystem::path& path) {
  std::ifstream file(path);
  std::vector<Vec3> points;
  std::vector<std::vector<Vec3>> out;
  for (std::string line; std::getline(file, line);) {
    std::istringstream words(line);
    std::string word;
    words >> word;
    if (word == "v") {
      Vec3 p = Vec3::Constant(NAN);
      words >> p[0] >> p[1] >> p[2];
      points.push_back(p);
    } else if (word == "l") {
      out.emplace_back();
      while (words >> word) {  // "3" or "3/1"; -1 is the last point so far
        const long number = std::strtol(word.c_str(), nullptr, 10);
        const long n = number < 0 ? number + static_cast<long>(points.size()) : number - 1;
        if (n < 0 || n >= static_cast<long>(points.size()))
          refuse(path, "has a line with point {}, expected 1 to {}", word, points.size());
        out.back().push_back(points[n]);
      }
    }
  }
  return out;
}

/// Plain text OFF. CGAL's reader believes the numbers of corners.
Shape read_off(const std::filesystem::path& path) {
  std::ifstream file(path);
  std::stringstream words;
  std::string line;
  if (!std::getline(file, line) || (line != "OFF" && line != "OFF\r")) refuse(path, "is no plain text OFF file");
  while (std::getline(file, line)) words << line.substr(0, line.find('#')) << '\n';
  const auto bytes = static_cast<double>(std::filesystem::file_size(path));
  double vertices = 0, faces = 0, edges = 0;
  if (!(words >> vertices >> faces >> edges) || !(vertices >= 0 && vertices <= bytes && faces >= 0 && faces <= bytes))
    refuse(path, "claims {:g} points and {:g} faces, expected what its {:g} bytes hold", vertices, faces, bytes);
  Shape shape;
  for (double n = 0; n < vertices; ++n) {
    Vec3 p;
    if (!(words >> p[0] >> p[1] >> p[2])) refuse(path, "has too few points");
    shape.surface.points.push_back(p);
  }
  std::getline(words, line);
  for (double n = 0; n < faces;) {
    if (!std::getline(words, line)) refuse(path, "has too few faces");
    std::istringstream face(line);
    std::int32_t corners = 0;
    if (!(face >> corners)) continue;  // an empty line
    ++n;
    std::vector<std::int32_t> polygon;
    for (std::int32_t corner = 0; std::ssize(polygon) < corners && face >> corner;) {
      if (corner < 0 || corner >= std::ssize(shape.surface.points))
        refuse(path, "has a face with point {}, expected below {}", corner, shape.surface.points.size());
      polygon.push_back(corner);
    }
    if (corners < 1 || std::ssize(polygon) != corners) refuse(path, "has the face '{}'", line.substr(0, 60));
    for (std::size_t a = 2; a < polygon.size(); ++a)
      shape.surface.triangles.push_back({polygon[0], polygon[a - 1], polygon[a]});
  }
  return shape;
}

/// What CGAL's reader of OBJ does not go on from; empty: nothing known.
std::string unread_in_obj(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::size_t number = 1;
  for (std::string line; std::getline(file, line); ++number) {
    if (line.ends_with('\r')) line.pop_back();
    if (line.find('\0') != line.npos) return fmt::format(": line {} has a byte 0", number);
    if (line.ends_with('\\')) return fmt::format(": line {} goes on in the next, expected each face on a line", number);
  }
  return "";
}

Shape read_soup(const std::filesystem::path& path) {
  std::vector<Point> points;
  std::vector<std::vector<std::size_t>> polygons;
  bool read = false;
  try {
    read = CGAL::IO::read_polygon_soup(path.string(), points, polygons, CGAL::parameters::verbose(false));
  } catch (const std::exception&) {  // of a count that only its own lines contradict
  }
  Shape shape;
  if (ending_of(path) == ".obj") shape.lines = obj_lines(path);
  if (!read && shape.lines.empty())
    refuse(path, "is no readable {} file{}", ending_of(path), ending_of(path) == ".obj" ? unread_in_obj(path) : "");
  for (const Point& p : points) shape.surface.points.emplace_back(p.x(), p.y(), p.z());
  for (const auto& polygon : polygons) {
    for (const std::size_t n : polygon)
      if (n >= points.size()) refuse(path, "has a face with point {}, expected below {}", n, points.size());
    for (std::size_t a = 2; a < polygon.size(); ++a)
      shape.surface.triangles.push_back({static_cast<std::int32_t>(polygon[0]),
                                         static_cast<std::int32_t>(polygon[a - 1]),
                                         static_cast<std::int32_t>(polygon[a])});
  }
  return shape;
}

}  // namespace

bool is_surface_name(const std::filesystem::path& path) {
  const std::string ending = ending_of(path);
  return ending == ".vtp" || ending == ".obj" || ending == ".stl" || ending == ".ply" || ending == ".off";
}

Shape read_shape(const std::filesystem::path& path) {
  const std::string ending = ending_of(path);
  if (!std::filesystem::is_regular_file(path)) refuse(path, "is not there, expected a file");
  if (!is_surface_name(path)) refuse(path, "ends in '{}', expected .obj, .stl, .ply, .off or .vtp", ending);
  check_surface_header(path, ending);
  Shape shape = ending == ".vtp" ? read_vtp(path) : ending == ".off" ? read_off(path) : read_soup(path);
  if (shape.surface.triangles.empty() && shape.lines.empty())
    refuse(path, "has no triangles and no lines, expected some");
  const auto check = [&](const Vec3& p) {
    if (!p.allFinite()) refuse(path, "has a point that is not finite");
  };
  for (const Vec3& p : shape.surface.points) check(p);
  for (const auto& line : shape.lines)
    for (const Vec3& p : line) check(p);
  if (says_ras(path)) turn(shape);
  return shape;
}

TriangleSurface read_surface(const std::filesystem::path& path) {
  Shape shape = read_shape(path);
  if (shape.surface.triangles.empty()) refuse(path, "has no triangles, expected some");
  return std::move(shape.surface);
}

void write_surface(const TriangleSurface& surface, const std::filesystem::path& path) {
  std::vector<Point> points;
  for (const Vec3& p : surface.points) points.emplace_back(p[0], p[1], p[2]);
  std::vector<std::vector<std::size_t>> triangles;
  for (const auto& t : surface.triangles) triangles.push_back({as_size(t[0]), as_size(t[1]), as_size(t[2])});
  // CGAL does not notice a full disk.
  std::ostringstream out;
  const std::string ending = ending_of(path);
  const auto settings = CGAL::parameters::stream_precision(17);
  CGAL::IO::set_mode(out, ending == ".stl" || ending == ".ply" ? CGAL::IO::BINARY : CGAL::IO::ASCII);
  const bool written = (ending == ".obj" && CGAL::IO::write_OBJ(out, points, triangles, settings)) ||
                       (ending == ".off" && CGAL::IO::write_OFF(out, points, triangles, settings)) ||
                       (ending == ".ply" && CGAL::IO::write_PLY(out, points, triangles, settings)) ||
                       (ending == ".stl" && CGAL::IO::write_STL(out, points, triangles, settings));
  if (!written)
    throw Error(ErrorKind::output, fmt::format("cannot write '{}', expected a name that ends in .obj, .stl, .ply or "
                                               ".off",
                                               path.string()));
  write_whole_file(path, out.str());
}

}  // namespace hexmesh
