// SPDX-License-Identifier: Apache-2.0
#include "distributed/shared_result.h"

#include <algorithm>
#include <cmath>

#include "distributed/cell_flags.h"
#include "level/cell_changes.h"
#include "level/make_result.h"
#include "terms/make_elastic_cells.h"

namespace hexsolver::mpi {
namespace {

using hexmesh::Lattice;

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
  NodeCopies(u, level.nodes().find(read.keys().nodes)).get(u, v);
  std::vector<bool> rotating;
  if (all.sum(level.rotating().size()) > 0) {
    std::vector<Piece::Holder> of_piece;
    for (std::size_t c = 0; c < read.mesh().num_cells(); ++c) of_piece.push_back(read.cell(c));
    rotating = CellFlags(level, level.rotating()).of(of_piece);
  }
  const auto cells =
      make_elastic_cells(read.mesh(), {piece, level.level()},
                         elastic_settings(scene, level.elasticity(), std::move(rotating), level.condense_piece()));
  const SurfaceShare& share = read.share();
  CellMeasures measures = measure_cells(*cells, v, [&](const Index3& node) { return share.has_node(node); });
  const double checkers = static_cast<double>(measures.checkerboard_nodes);
  report.pressure_checkerboard =
      std::sqrt(all.sum(checkers * measures.pressure_checkerboard * measures.pressure_checkerboard) /
                std::max(1.0, all.sum(checkers)));
  hexmesh::ResultRows rows{state_of_cells({piece, level.level()}, *cells, v, std::move(measures))};
  hexmesh::Result& r = rows.part;
  // As the piece numbers them: of nodes at one index those with cells here.
  r.cell_nodes = read.mesh().cell_nodes();
  r.nodes.clear();
  for (std::size_t n = 0; n < nodes.size(); ++n) r.nodes.push_back(read.mesh().position(n));
  const std::size_t first = read.rows().first_cell, count = read.rows().num_own_cells;
  const CellChanges changes = count_changes(r, first, count);
  report_changes(changes.combined([&](auto part) { return all.sum(part); }, [&](double x) { return all.least(x); },
                                  [&](double x) { return all.largest(x); }),
                 report);

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
  for (Index3& cell : r.cells) cell[2] += read.rows().low;
  keep(r.cells, first, count);
  keep(r.cell_nodes, first, count);
  keep(r.segment, first, count);
  for (auto& [name, values] : r.cell_fields) keep(values, first, count);
  keep(r.nodes, first_node, num_nodes);
  keep(r.displacement, first_node, num_nodes);
  return rows;
}

}  // namespace hexsolver::mpi
