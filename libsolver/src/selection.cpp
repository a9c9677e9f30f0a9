// SPDX-License-Identifier: Apache-2.0
#include "hexsolver/selection.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <limits>

#include "hexmesh/core/error.h"
#include "hexmesh/lattice/locator.h"

namespace hexsolver {
namespace {

using hexmesh::Embedding;
using hexmesh::Error;
using hexmesh::ErrorKind;

/// A point of the embedded surface that conditions may select.
struct Candidate {
  Vec3 position;
  Embedding embedding;
  std::vector<std::uint16_t> neighbours;  ///< labels behind the exposed faces it stands for
};

std::vector<Candidate> face_candidates(const hexmesh::Lattice& lattice, const hexmesh::CellLocator& locator,
                                       bool whole_voxels) {
  std::vector<Candidate> out;
  const hexmesh::ExposedFace* last = nullptr;
  const std::vector<hexmesh::ExposedFace> faces = hexmesh::exposed_faces(lattice);
  for (const hexmesh::ExposedFace& face : faces) {
    const bool same_voxel = last && last->voxel == face.voxel;
    last = &face;
    if (whole_voxels && same_voxel) {
      out.back().neighbours.push_back(face.neighbour);
      continue;
    }
    const Vec3 index = whole_voxels ? Vec3(face.voxel[0], face.voxel[1], face.voxel[2]) : hexmesh::face_index(face);
    out.push_back({lattice.voxels.position(index), locator.in_cell_of_voxel(face.voxel, index), {face.neighbour}});
  }
  return out;
}

/// Nodes that touch a missing cell or one that is not full.
std::vector<Candidate> node_candidates(const hexmesh::Lattice& lattice, int level, const Mesh& mesh) {
  const hexmesh::Level& cells = lattice.levels[static_cast<std::size_t>(level)];
  std::vector<int> full_cells(mesh.num_nodes());
  std::vector<Candidate> of_node(mesh.num_nodes());
  for (std::size_t c = 0; c < mesh.num_cells(); ++c)
    for (int a = 0; a < 8; ++a) {
      const auto node = static_cast<std::size_t>(mesh.cell_nodes()[c][static_cast<std::size_t>(a)]);
      full_cells[node] += !cells.is_boundary(c);
      Embedding& e = of_node[node].embedding;
      e.cell = static_cast<std::int32_t>(c);
      for (int d = 0; d < 3; ++d) e.local[d] = hexmesh::corner_bit(a, d);
    }
  std::vector<Candidate> out;
  for (std::size_t n = 0; n < mesh.num_nodes(); ++n)
    if (full_cells[n] < 8) {
      of_node[n].position = mesh.position(n);
      out.push_back(of_node[n]);
    }
  return out;
}

std::size_t nearest(const std::vector<Candidate>& candidates, const Vec3& point) {
  std::size_t best = 0;
  for (std::size_t n = 1; n < candidates.size(); ++n)
    if ((candidates[n].position - point).squaredNorm() < (candidates[best].position - point).squaredNorm()) best = n;
  return best;
}

void select_ball(const Ball& ball, const Condition& condition, const std::vector<Candidate>& candidates,
                 std::vector<char>& chosen) {
  const std::size_t closest = nearest(candidates, ball.center);
  const double distance = (candidates[closest].position - ball.center).norm();
  if (distance > condition.selection.max_distance)
    throw Error(ErrorKind::geometry,
                fmt::format("condition '{}' ({}): its point [{:g}, {:g}, {:g}] is {:.1f} mm from the nearest surface "
                            "point, expected at most max_distance_mm = {:g}",
                            condition.name, condition.where, ball.center[0], ball.center[1], ball.center[2], distance,
                            condition.selection.max_distance));
  if (ball.radius == 0) {
    chosen[closest] = 1;
    return;
  }
  for (std::size_t n = 0; n < candidates.size(); ++n)
    if ((candidates[n].position - ball.center).norm() <= ball.radius) chosen[n] = 1;
}

std::uint16_t label_of(const Condition& condition, const hexmesh::Lattice& lattice) {
  std::vector<std::string> names;
  for (const hexmesh::LatticeSegment& s : lattice.segments) {
    if (s.segment.name == condition.selection.segment) return s.segment.label;
    names.push_back(s.segment.name);
  }
  throw Error(ErrorKind::input,
              fmt::format("condition '{}' ({}): unknown segment '{}', expected one of: {}", condition.name,
                          condition.where, condition.selection.segment, fmt::join(names, ", ")));
}

std::vector<char> choose(const Condition& condition, const hexmesh::Lattice& lattice,
                         const std::vector<Candidate>& candidates) {
  const Selection& s = condition.selection;
  std::vector<char> chosen(candidates.size());
  for (const Ball& ball : s.balls) select_ball(ball, condition, candidates, chosen);
  const std::uint16_t label = s.segment.empty() ? std::uint16_t{0} : label_of(condition, lattice);
  for (std::size_t n = 0; n < candidates.size(); ++n) {
    const Vec3& p = candidates[n].position;
    if (s.box && (s.box->to_box * (p - s.box->center)).lpNorm<Eigen::Infinity>() <= 1 + 1e-9) chosen[n] = 1;
    if (s.halfspace && (p - s.halfspace->point).dot(s.halfspace->normal) >= -1e-9) chosen[n] = 1;
    if (!s.segment.empty() && std::count(candidates[n].neighbours.begin(), candidates[n].neighbours.end(), label))
      chosen[n] = 1;
  }
  return chosen;
}

std::string nothing_selected(const Condition& condition, const hexmesh::Lattice& lattice,
                             const std::vector<Candidate>& candidates) {
  const Selection& s = condition.selection;
  std::string detail = "expected at least one point of the surface";
  if (s.balls.size() == 1) {
    const Vec3& center = s.balls[0].center;
    detail = fmt::format("the nearest is {:.1f} mm from its point, expected radius_mm of at least that",
                         (candidates[nearest(candidates, center)].position - center).norm());
  } else if (s.box || s.halfspace) {
    double least = std::numeric_limits<double>::infinity();
    for (const Candidate& c : candidates)
      least = std::min(least, s.halfspace ? -(c.position - s.halfspace->point).dot(s.halfspace->normal)
                                          : (c.position - s.box->center).norm());
    detail = fmt::format("the nearest is {:.1f} mm from {}", least,
                         s.box ? "the box's centre, expected one inside" : "the half-space, expected one inside");
  } else if (!s.segment.empty() && lattice.segments.size() > 1) {
    detail = fmt::format("no material touches segment '{}' (one with a material of its own?)", s.segment);
  }
  return fmt::format("condition '{}' ({}) selects no point: {}", condition.name, condition.where, detail);
}

}  // namespace

std::vector<ConstraintPoint> select_points(const Scene& scene, const hexmesh::Lattice& lattice, int level,
                                           const Mesh& mesh) {
  const hexmesh::Level& cells = lattice.levels[static_cast<std::size_t>(level)];
  const hexmesh::CellLocator locator(lattice.voxels, cells.voxels_per_cell, cells.cells);
  std::array<std::vector<Candidate>, 3> candidates;
  const auto of_kind = [&](SurfacePoints on) -> const std::vector<Candidate>& {
    auto& list = candidates[static_cast<std::size_t>(on)];
    if (list.empty())
      list = on == SurfacePoints::nodes ? node_candidates(lattice, level, mesh)
                                        : face_candidates(lattice, locator, on == SurfacePoints::voxels);
    return list;
  };

  std::vector<ConstraintPoint> points;
  for (std::size_t c = 0; c < scene.conditions.size(); ++c) {
    const Condition& condition = scene.conditions[c];
    const std::vector<Candidate>& list = of_kind(condition.selection.on);
    const std::vector<char> chosen = choose(condition, lattice, list);
    if (std::count(chosen.begin(), chosen.end(), 1) == 0)
      throw Error(ErrorKind::geometry, nothing_selected(condition, lattice, list));
    for (std::size_t n = 0; n < list.size(); ++n)
      if (chosen[n])
        points.push_back({static_cast<std::int32_t>(c), list[n].embedding.cell,
                          hexmesh::shape_functions(list[n].embedding.local), condition.by, condition.axes});
  }
  return points;
}

}  // namespace hexsolver
