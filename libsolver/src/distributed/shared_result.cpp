// SPDX-License-Identifier: Apache-2.0
#include "distributed/shared_result.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "hexmesh/lattice/locator.h"
#include "level/cell_changes.h"
#include "level/make_result.h"
#include "terms/make_elastic_cells.h"

namespace hexsolver::mpi {
namespace {

using hexmesh::Lattice;

/// How the surface points of one share of the file move: with the cell that holds them, or else the nearest.
/// @param u      at the nodes of the piece
/// @param first  becomes the number of the first of them
std::vector<Vec3> surface_displacement(const SharedLevel& level, const NodeVector& u, std::size_t& first) {
  const Processes& all = level.all();
  const Piece& read = level.piece();
  const auto rank = static_cast<std::size_t>(all.rank()), count = static_cast<std::size_t>(all.count());
  std::vector<Vec3> points;
  all.all_or_none([&] {
    const std::size_t num_points = level.file().num_surface_points();
    first = num_points * rank / count;
    points = level.file().surface_points(first, num_points * (rank + 1) / count - first);
  });
  struct Point {
    std::size_t number;  ///< among those of the process that read it
    std::array<double, 3> position;
  };
  struct Moved {
    std::size_t number;
    double distance;  ///< of the cell from the point [mm]
    std::array<double, 3> by;
  };
  const Lattice& piece = read.lattice();
  const hexmesh::Level& cells = read.level();
  const Vec3 size = piece.cell_size(level.level());
  const hexmesh::CellLocator locator(piece.voxels, cells.voxels_per_cell, cells.cells);
  const auto move = [&](const Point& p) -> Moved {
    const hexmesh::Embedding e = locator.locate_position(Vec3::Map(p.position.data()));
    if (e.cell < 0) return {p.number, std::numeric_limits<double>::infinity(), {}};
    const Vec3 by = read.mesh().interpolate(e.cell, hexmesh::shape_functions(e.local), u);
    const Vec3 outside = (-e.local).cwiseMax(e.local - Vec3::Ones()).cwiseMax(0).cwiseProduct(size);
    return {p.number, outside.norm(), {by[0], by[1], by[2]}};
  };

  // To the process whose layers they lie in.
  std::vector<std::vector<Point>> to(count);
  for (std::size_t p = 0; p < points.size(); ++p) {
    const double layer = (level.outline().voxels.continuous_index(points[p])[2] + 0.5) / cells.voxels_per_cell[2];
    const auto process = static_cast<std::size_t>(read.layers().process_of(
        static_cast<std::int32_t>(std::clamp(layer, 0.0, 1.0 * read.layers().end(all.count() - 1)))));
    to[process].push_back({p, {points[p][0], points[p][1], points[p][2]}});
  }
  std::vector<std::vector<Moved>> answers;
  for (const std::vector<Point>& asked : all.exchange(to)) {
    answers.emplace_back();
    for (const Point& p : asked) answers.back().push_back(move(p));
  }
  std::vector<Vec3> out(points.size(), Vec3::Zero());
  std::vector<Point> strays;  // other processes may have a nearer cell
  for (const std::vector<Moved>& from : all.exchange(answers))
    for (const Moved& m : from) {
      out[m.number] = Vec3::Map(m.by.data());
      if (m.distance > Piece::margin * size[2])
        strays.push_back({m.number, {points[m.number][0], points[m.number][1], points[m.number][2]}});
    }
  const std::size_t own_strays = all.sum_before(strays.size());
  std::vector<Moved> candidates;
  const std::vector<Point> everybodys = all.gather(strays);
  for (std::size_t n = 0; n < everybodys.size(); ++n) {
    candidates.push_back(move(everybodys[n]));
    candidates.back().number = n;
  }
  std::erase_if(candidates, [](const Moved& m) { return !std::isfinite(m.distance); });
  std::vector<double> nearest(strays.size(), std::numeric_limits<double>::infinity());
  for (const Moved& m : all.gather(candidates)) {
    if (m.number < own_strays || m.number >= own_strays + strays.size()) continue;
    const std::size_t n = m.number - own_strays;
    if (m.distance >= nearest[n]) continue;
    nearest[n] = m.distance;
    out[strays[n].number] = Vec3::Map(m.by.data());
  }
  return out;
}

template <class T>
void keep(std::vector<T>& values, std::size_t first, std::size_t count) {
  const auto begin = values.begin() + static_cast<std::ptrdiff_t>(first);
  values = std::vector<T>(begin, begin + static_cast<std::ptrdiff_t>(count));
}

}  // namespace

hexmesh::ResultRows result_rows(const SharedLevel& level, Vec u, SolveReport& report) {
  const Processes& all = level.all();
  const Piece& read = level.piece();
  const Scene& scene = level.scene();
  // Measures of the cells that this process writes, with those around them.
  const Lattice& piece = read.lattice();
  const std::vector<Index3>& nodes = read.mesh().nodes();
  NodeVector v;
  NodeCopies(u, level.nodes().find(read.in_whole(nodes))).get(u, v);
  const auto cells =
      make_elastic_cells(read.mesh(), piece, level.level(),
                         {level.elasticity(), scene.rotation, scene.volumetric, scene.stiffness, {}, false});
  const SurfaceShare& share = read.share();
  CellMeasures measures = measure_cells(*cells, v, [&](const Index3& node) { return share.has_node(node); });
  const double checkers = static_cast<double>(measures.checkerboard_nodes);
  report.pressure_checkerboard =
      std::sqrt(all.sum(checkers * measures.pressure_checkerboard * measures.pressure_checkerboard) /
                std::max(1.0, all.sum(checkers)));
  hexmesh::ResultRows rows{state_of_cells(piece, level.level(), *cells, v, std::move(measures))};
  hexmesh::Result& r = rows.part;
  const std::size_t first = read.rows().first_cell, count = read.rows().num_own_cells;
  CellChanges changes = count_changes(r, first, count);
  changes = {all.sum(changes.cells), all.sum(changes.strained), all.sum(changes.turned), all.sum(changes.inverted),
             all.least(changes.least_jacobian)};
  report_changes(changes, report);

  std::size_t first_node = 0, num_nodes = 0;
  for (const Index3& node : nodes) {
    first_node += !share.has_node(node) && num_nodes == 0;
    num_nodes += share.has_node(node);
  }
  rows.first_cell = read.rows().first_row;
  rows.first_node = all.sum_before(num_nodes);
  // The nodes of the whole come in the same order as those here.
  for (hexmesh::CellNodes& of_cell : r.cell_nodes)
    for (std::int32_t& n : of_cell)
      n += static_cast<std::int32_t>(rows.first_node) - static_cast<std::int32_t>(first_node);
  r.cells = read.in_whole(std::move(r.cells));
  keep(r.cells, first, count);
  keep(r.cell_nodes, first, count);
  keep(r.segment, first, count);
  for (auto& [name, values] : r.cell_fields) keep(values, first, count);
  keep(r.nodes, first_node, num_nodes);
  keep(r.displacement, first_node, num_nodes);
  r.surface_displacement = surface_displacement(level, v, rows.first_point);
  return rows;
}

}  // namespace hexsolver::mpi
