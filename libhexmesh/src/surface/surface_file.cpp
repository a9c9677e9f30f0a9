// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/surface/surface_file.h"

#include <CGAL/IO/polygon_soup_io.h>
#include <CGAL/Simple_cartesian.h>
#include <fmt/format.h>
#include <vtkNew.h>
#include <vtkTriangleFilter.h>
#include <vtkXMLPolyDataReader.h>

#include <algorithm>
#include <fstream>

#include "from_vtk.h"
#include "hexmesh/core/error.h"

namespace hexmesh {
namespace {

using Point = CGAL::Simple_cartesian<double>::Point_3;

std::string ending_of(const std::filesystem::path& path) {
  std::string ending = path.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(), [](unsigned char c) { return std::tolower(c); });
  return ending;
}

[[noreturn]] void fail(const std::filesystem::path& path, const std::string& message) {
  throw Error(ErrorKind::input, fmt::format("surface '{}' {}", path.string(), message));
}

bool says_ras(const std::filesystem::path& path) {
  std::string start(1024, '\0');
  std::ifstream(path, std::ios::binary).read(start.data(), static_cast<std::streamsize>(start.size()));
  return start.find("SPACE=RAS") != std::string::npos;
}

TriangleSurface read_vtp(const std::filesystem::path& path) {
  vtkNew<vtkXMLPolyDataReader> reader;
  if (!reader->CanReadFile(path.c_str())) fail(path, "is no VTK XML PolyData file");
  reader->SetFileName(path.c_str());
  vtkNew<vtkTriangleFilter> triangles;
  triangles->SetInputConnection(reader->GetOutputPort());
  triangles->PassVertsOff();
  triangles->PassLinesOff();
  triangles->Update();
  if (reader->GetErrorCode() != 0) fail(path, "is damaged");
  return from_vtk(*triangles->GetOutput());
}

TriangleSurface read_soup(const std::filesystem::path& path) {
  std::vector<Point> points;
  std::vector<std::vector<std::size_t>> polygons;
  if (!CGAL::IO::read_polygon_soup(path.string(), points, polygons, CGAL::parameters::verbose(false)))
    fail(path, fmt::format("is no readable {} file", ending_of(path)));
  TriangleSurface surface;
  for (const Point& p : points) surface.points.emplace_back(p.x(), p.y(), p.z());
  for (const auto& polygon : polygons) {
    for (const std::size_t n : polygon)
      if (n >= points.size()) fail(path, fmt::format("has a face with point {}, expected below {}", n, points.size()));
    for (std::size_t a = 2; a < polygon.size(); ++a)
      surface.triangles.push_back({static_cast<std::int32_t>(polygon[0]), static_cast<std::int32_t>(polygon[a - 1]),
                                   static_cast<std::int32_t>(polygon[a])});
  }
  return surface;
}

}  // namespace

TriangleSurface read_surface(const std::filesystem::path& path) {
  const std::string ending = ending_of(path);
  if (!std::filesystem::is_regular_file(path)) fail(path, "is not there, expected a file");
  if (ending != ".vtp" && ending != ".obj" && ending != ".stl" && ending != ".ply" && ending != ".off")
    fail(path, fmt::format("ends in '{}', expected .obj, .stl, .ply, .off or .vtp", ending));
  TriangleSurface surface = ending == ".vtp" ? read_vtp(path) : read_soup(path);
  if (surface.triangles.empty()) fail(path, "has no triangles, expected some");
  for (const Vec3& p : surface.points)
    if (!p.allFinite()) fail(path, "has a point that is not finite");
  if (says_ras(path))
    for (Vec3& p : surface.points) p.head<2>() *= -1;
  return surface;
}

void write_surface(const TriangleSurface& surface, const std::filesystem::path& path) {
  std::vector<Point> points;
  for (const Vec3& p : surface.points) points.emplace_back(p[0], p[1], p[2]);
  std::vector<std::vector<std::size_t>> triangles;
  for (const auto& t : surface.triangles)
    triangles.push_back(
        {static_cast<std::size_t>(t[0]), static_cast<std::size_t>(t[1]), static_cast<std::size_t>(t[2])});
  if (!CGAL::IO::write_polygon_soup(path.string(), points, triangles,
                                    CGAL::parameters::stream_precision(17).use_binary_mode(true)))
    throw Error(ErrorKind::output, fmt::format("cannot write '{}', expected a name that ends in .obj, .stl, .ply or "
                                               ".off in a folder that can be written to",
                                               path.string()));
}

}  // namespace hexmesh
