// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/surface/decimate.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/orient_polygon_soup.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Polygon_mesh_processing/repair_self_intersections.h>
#include <CGAL/Polygon_mesh_processing/self_intersections.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/Bounded_normal_change_filter.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/Count_stop_predicate.h>
#include <CGAL/Surface_mesh_simplification/edge_collapse.h>

namespace hexmesh {
namespace {

namespace processing = CGAL::Polygon_mesh_processing;
namespace simplification = CGAL::Surface_mesh_simplification;

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Mesh = CGAL::Surface_mesh<Kernel::Point_3>;

/// What is not manifold is split.
Mesh to_mesh(const TriangleSurface& surface) {
  std::vector<Kernel::Point_3> points;
  for (const Vec3& p : surface.points) points.emplace_back(p[0], p[1], p[2]);
  std::vector<std::array<std::size_t, 3>> triangles;
  for (const auto& t : surface.triangles) triangles.push_back({as_size(t[0]), as_size(t[1]), as_size(t[2])});
  processing::orient_polygon_soup(points, triangles);
  Mesh mesh;
  processing::polygon_soup_to_polygon_mesh(points, triangles, mesh);
  return mesh;
}

TriangleSurface to_surface(Mesh& mesh, std::uint16_t label) {
  mesh.collect_garbage();
  TriangleSurface surface;
  for (const auto v : mesh.vertices())
    surface.points.emplace_back(mesh.point(v).x(), mesh.point(v).y(), mesh.point(v).z());
  for (const auto f : mesh.faces()) {
    std::array<std::int32_t, 3> triangle{};
    std::size_t a = 0;
    for (const auto v : mesh.vertices_around_face(mesh.halfedge(f))) triangle[a++] = static_cast<std::int32_t>(v.idx());
    surface.triangles.push_back(triangle);
  }
  surface.segment.assign(surface.triangles.size(), label);
  return surface;
}

}  // namespace

TriangleSurface decimate(const TriangleSurface& surface, std::size_t num_triangles) {
  if (surface.triangles.size() <= num_triangles) return surface;
  Mesh mesh = to_mesh(surface);
  const simplification::Count_stop_predicate<Mesh> stop(num_triangles * 3 / 2);  // edges of a closed surface
  const simplification::Bounded_normal_change_filter<> filter;
  simplification::edge_collapse(mesh, stop, CGAL::parameters::filter(filter));
  mesh.collect_garbage();
  processing::experimental::remove_self_intersections(mesh, CGAL::parameters::preserve_genus(false));
  return to_surface(mesh, surface.segment.front());
}

std::size_t count_self_intersections(const TriangleSurface& surface) {
  std::vector<std::pair<Mesh::Face_index, Mesh::Face_index>> pairs;
  processing::self_intersections(to_mesh(surface), std::back_inserter(pairs));
  return pairs.size();
}

}  // namespace hexmesh
