// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/surface/voxelize.h"

#include <CGAL/AABB_traits.h>
#include <CGAL/AABB_tree.h>
#include <CGAL/AABB_triangle_primitive.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/orient_polygon_soup.h>
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "hexmesh/core/error.h"

namespace hexmesh {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point = Kernel::Point_3;
using Triangles = std::vector<Kernel::Triangle_3>;
using Primitive = CGAL::AABB_triangle_primitive<Kernel, Triangles::const_iterator>;
using Tree = CGAL::AABB_tree<CGAL::AABB_traits<Kernel, Primitive>>;

/// Its parts that hang together by shared points.
std::vector<TriangleSurface> parts_of(const TriangleSurface& surface) {
  const std::vector<std::int32_t> pieces = pieces_of(surface);
  std::map<std::int32_t, std::size_t> part_of;                  // by piece
  std::vector<std::int32_t> number(surface.points.size(), -1);  // of a point in its part
  std::vector<TriangleSurface> out;
  for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
    const auto [at, added] = part_of.emplace(pieces[surface.triangles[t][0]], out.size());
    if (added) out.emplace_back();
    add_triangle(out[at->second], surface, t, number);
  }
  return out;
}

/// The same triangles turned to face outwards where that is possible.
TriangleSurface oriented(const TriangleSurface& surface) {
  std::vector<Point> points;
  for (const Vec3& p : surface.points) points.emplace_back(p[0], p[1], p[2]);
  std::vector<std::array<std::size_t, 3>> triangles;
  for (const auto& t : surface.triangles) triangles.push_back({as_size(t[0]), as_size(t[1]), as_size(t[2])});
  CGAL::Polygon_mesh_processing::orient_polygon_soup(points, triangles);
  TriangleSurface out;
  for (const Point& p : points) out.points.emplace_back(p.x(), p.y(), p.z());
  for (const auto& t : triangles)
    out.triangles.push_back(
        {static_cast<std::int32_t>(t[0]), static_cast<std::int32_t>(t[1]), static_cast<std::int32_t>(t[2])});
  if (enclosed_volume(out) < 0)
    for (auto& t : out.triangles) std::swap(t[0], t[1]);
  return merged(out);
}

/// In voxel indices: centres at whole numbers.
Triangles in_voxels(const TriangleSurface& surface, const Grid& grid) {
  Triangles out;
  const auto point = [&](std::int32_t n) {
    const Vec3 p = grid.continuous_index(surface.points[n]);
    return Point(p[0], p[1], p[2]);
  };
  for (const auto& t : surface.triangles) {
    const Kernel::Triangle_3 triangle(point(t[0]), point(t[1]), point(t[2]));
    if (!triangle.is_degenerate()) out.push_back(triangle);
  }
  return out;
}

/// Where a line along the first axis crosses the surface, and whether it leaves (1) or enters (-1) there.
using Crossings = std::vector<std::pair<double, int>>;

Crossings cross(const Tree& tree, double y, double z, const CGAL::Bbox_3& box) {
  std::vector<Primitive::Id> hits;
  tree.all_intersected_primitives(Kernel::Segment_3(Point(box.xmin() - 1, y, z), Point(box.xmax() + 1, y, z)),
                                  std::back_inserter(hits));
  Crossings out;
  for (const Primitive::Id& hit : hits) {
    const auto vertex = [&](int n) { return Vec3(hit->vertex(n).x(), hit->vertex(n).y(), hit->vertex(n).z()); };
    const Vec3 a = vertex(0), normal = (vertex(1) - a).cross(vertex(2) - a);
    if (normal[0] == 0) continue;  // seen edge-on
    out.emplace_back(a[0] - (normal[1] * (y - a[1]) + normal[2] * (z - a[2])) / normal[0], normal[0] > 0 ? 1 : -1);
  }
  std::sort(out.begin(), out.end());
  return out;
}

/// Fills voxel centres that closed triangles surround.
/// @param by_winding  else by an odd number of crossings
void fill_inside(const Triangles& triangles, bool by_winding, const Grid& grid, std::vector<bool>& filled) {
  if (triangles.empty()) return;
  const Tree tree(triangles.begin(), triangles.end());
  const CGAL::Bbox_3 box = tree.bbox();
  const Index3& extent = grid.extent();
  const auto first = [](double low) { return static_cast<std::int32_t>(std::clamp(std::ceil(low), 0.0, 2e9)); };
  const auto last = [](double high, std::int32_t count) {
    return static_cast<std::int32_t>(std::clamp(std::floor(high), -1.0, count - 1.0));
  };
  for (std::int32_t k = first(box.zmin()); k <= last(box.zmax(), extent[2]); ++k)
    for (std::int32_t j = first(box.ymin()); j <= last(box.ymax(), extent[1]); ++j) {
      // A line through an edge or a point of the surface counts it twice or never: such lines are moved a little, and
      // those that do not come out as they went in are tried again.
      Crossings crossings;
      for (int attempt = 1; attempt <= 8; ++attempt) {
        crossings = cross(tree, j + 1.234567e-6 * attempt, k + 2.718281e-6 * attempt, box);
        int sum = 0;
        for (const auto& [x, sign] : crossings) sum += by_winding ? sign : 1;
        if (by_winding ? sum == 0 : sum % 2 == 0) break;
      }
      int winding = 0;
      for (std::size_t n = 0; n + 1 < crossings.size(); ++n) {
        winding += by_winding ? crossings[n].second : 1;
        if (by_winding ? winding == 0 : winding % 2 == 0) continue;
        for (std::int32_t i = first(crossings[n].first); i <= last(crossings[n + 1].first, extent[0]); ++i)
          filled[grid.offset({i, j, k})] = true;
      }
    }
}

/// Marks the voxels of the box around an object that it crosses. Voxels are shifted by a hair, so that what lies
/// exactly between two of them belongs to one.
template <class Object>
void mark_crossed(const Object& object, const Grid& grid, std::vector<bool>& filled) {
  constexpr double hair = 1e-7;
  const CGAL::Bbox_3 box = object.bbox();
  Index3 low, high;
  for (int d = 0; d < 3; ++d) {
    const double most = grid.extent()[d] - 1.0;
    low[d] = static_cast<std::int32_t>(std::clamp(std::floor(box.min(d) + 0.5 - hair), 0.0, most + 1));
    high[d] = static_cast<std::int32_t>(std::clamp(std::floor(box.max(d) + 0.5), -1.0, most));
  }
  for (std::int32_t k = low[2]; k <= high[2]; ++k)
    for (std::int32_t j = low[1]; j <= high[1]; ++j)
      for (std::int32_t i = low[0]; i <= high[0]; ++i) {
        const Kernel::Iso_cuboid_3 voxel(Point(i - 0.5 + hair, j - 0.5 + hair, k - 0.5 + hair),
                                         Point(i + 0.5 + hair, j + 0.5 + hair, k + 0.5 + hair));
        if (CGAL::do_intersect(voxel, object)) filled[grid.offset({i, j, k})] = true;
      }
}

bool is_above(const Kernel::Triangle_3& t, const Point& p) { return t.supporting_plane().has_on_positive_side(p); }
bool is_above(const Kernel::Segment_3&, const Point&) { return false; }

/// Marks the voxels whose centres are within a distance of a figure [mm]; of those just at it that are below.
/// @param corners  of the figure
template <class Figure>
void mark_near(const Figure& figure, const std::vector<Vec3>& corners, double distance, const Grid& grid,
               std::vector<bool>& filled) {
  Vec3 low = Vec3::Constant(INFINITY), high = -low;
  const Vec3 reach = Vec3::Constant(distance).cwiseQuotient(grid.spacing());
  for (const Vec3& corner : corners) {
    const Vec3 index = grid.continuous_index(corner);
    low = low.cwiseMin(index - reach);
    high = high.cwiseMax(index + reach);
  }
  Index3 first, last;
  for (int d = 0; d < 3; ++d) {
    const auto a = static_cast<std::size_t>(d);
    first[a] = static_cast<std::int32_t>(std::max(0.0, std::ceil(low[d])));
    last[a] = static_cast<std::int32_t>(std::min(grid.extent()[a] - 1.0, std::floor(high[d])));
  }
  for (std::int32_t k = first[2]; k <= last[2]; ++k)
    for (std::int32_t j = first[1]; j <= last[1]; ++j)
      for (std::int32_t i = first[0]; i <= last[0]; ++i) {
        const std::size_t n = grid.offset({i, j, k});
        if (filled[n]) continue;
        const Vec3 position = grid.position(Vec3(i, j, k));
        const Point p(position[0], position[1], position[2]);
        constexpr double rounding = 1e-9;
        const double most = distance * distance * (is_above(figure, p) ? 1 - rounding : 1 + rounding);
        filled[n] = CGAL::squared_distance(p, figure) <= most;
      }
}

void thicken(const TriangleSurface& sheet, double thickness, const Grid& grid, std::vector<bool>& filled) {
  const auto at = [](const Vec3& p) { return Point(p[0], p[1], p[2]); };
  for (const auto& t : sheet.triangles) {
    const std::vector<Vec3> corners = {sheet.points[t[0]], sheet.points[t[1]], sheet.points[t[2]]};
    const Kernel::Triangle_3 triangle(at(corners[0]), at(corners[1]), at(corners[2]));
    if (!triangle.is_degenerate()) mark_near(triangle, corners, thickness / 2, grid, filled);
  }
}

void thicken(const std::vector<Vec3>& line, double thickness, const Grid& grid, std::vector<bool>& filled) {
  for (std::size_t n = 0; n + 1 < line.size(); ++n)
    if (line[n] != line[n + 1])
      mark_near(Kernel::Segment_3(Point(line[n][0], line[n][1], line[n][2]),
                                  Point(line[n + 1][0], line[n + 1][1], line[n + 1][2])),
                {line[n], line[n + 1]}, thickness / 2, grid, filled);
}

/// Pieces no longer than a voxel, so that few boxes are tried.
void mark_line(const std::vector<Vec3>& line, const Grid& grid, std::vector<bool>& filled) {
  for (std::size_t n = 0; n + 1 < line.size(); ++n) {
    const Vec3 from = grid.continuous_index(line[n]), to = grid.continuous_index(line[n + 1]);
    const double pieces = std::max(1.0, std::ceil((to - from).norm()));
    for (double p = 0; p < pieces; ++p) {
      const Vec3 a = from + (to - from) * (p / pieces), b = from + (to - from) * ((p + 1) / pieces);
      if (a != b) mark_crossed(Kernel::Segment_3(Point(a[0], a[1], a[2]), Point(b[0], b[1], b[2])), grid, filled);
    }
  }
}

}  // namespace

Grid grid_around(const std::vector<Shape>& shapes, double spacing, double room) {
  Vec3 low = Vec3::Constant(INFINITY), high = -low;
  const auto include = [&](const Vec3& p) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  };
  for (const Shape& shape : shapes) {
    for (const auto& t : shape.surface.triangles)
      for (const std::int32_t n : t) include(shape.surface.points[n]);
    for (const auto& line : shape.lines)
      for (const Vec3& p : line) include(p);
  }
  const double margin = 2 + std::ceil(room / spacing);
  constexpr double most_voxels = 2147483648.0;
  const Vec3 extent = ((high - low) / spacing - Vec3::Constant(1e-9)).array().ceil().max(1.0) + 2 * margin;
  if (!(extent.maxCoeff() < 65536 && extent.prod() <= most_voxels))
    throw Error(ErrorKind::usage, fmt::format("voxels of {} mm around the surfaces are {:g} x {:g} x {:g}, expected at "
                                              "most 2^31 (a larger --spacing)",
                                              spacing, extent[0], extent[1], extent[2]));
  const Vec3 first = (low + high) / 2 - spacing * (extent - Vec3::Ones()) / 2;
  return Grid({static_cast<std::int32_t>(extent[0]), static_cast<std::int32_t>(extent[1]),
               static_cast<std::int32_t>(extent[2])},
              Vec3::Constant(spacing), first);
}

Voxelization voxelize(const Shape& shape, const Grid& grid, double thickness) {
  Voxelization out;
  std::vector<bool> filled(grid.num_voxels());
  TriangleSurface facing_one_way;  // all such parts together: one may be a hole of another
  for (TriangleSurface part : parts_of(merged(shape.surface))) {
    if (const Edges edges = edges_of(part); edges.open > 0) {
      ++out.open_parts;
      constexpr std::size_t few = 50;  // one edge in so many
      if (few * edges.open < edges.all) out.nearly_closed.emplace_back(edges.open, edges.all);
      if (thickness > 0)
        thicken(part, thickness, grid, filled);
      else
        for (const Kernel::Triangle_3& t : in_voxels(part, grid)) mark_crossed(t, grid, filled);
      continue;
    }
    ++out.closed_parts;
    if (count_open_edges(part) != 0) {
      ++out.mended_parts;
      if (TriangleSurface turned = oriented(part); count_open_edges(turned) == 0 && enclosed_volume(turned) != 0)
        part = std::move(turned);
    }
    if (count_open_edges(part) == 0)
      append(facing_one_way, part);
    else
      fill_inside(in_voxels(part, grid), false, grid, filled);
  }
  fill_inside(in_voxels(facing_one_way, grid), true, grid, filled);
  out.enclosed_ml = enclosed_volume(facing_one_way) / 1000;
  for (const auto& line : shape.lines)
    thickness > 0 ? thicken(line, thickness, grid, filled) : mark_line(line, grid, filled);
  for (std::size_t n = 0; n < filled.size(); ++n)
    if (filled[n]) out.voxels.push_back(n);
  return out;
}

}  // namespace hexmesh
