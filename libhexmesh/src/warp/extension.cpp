// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/warp/extension.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <map>

#include "hexmesh/geometry/shape_functions.h"
#include "hexmesh/lattice/locator.h"
#include "hexmesh/lattice/subcells.h"

namespace hexmesh {
namespace {

constexpr double least_seen = 0.05, least_fill = 0.1;

/// Material of a part of a cell.
struct Sample {
  Vec3 local = Vec3::Zero();  ///< its centre, [0, 1]^3
  double voxels = 0;
};

using CellLists = std::vector<std::vector<std::int32_t>>;

CellLists cells_of_nodes(const Result& r) {
  CellLists out(r.nodes.size());
  for (std::size_t c = 0; c < r.cells.size(); ++c)
    for (const std::int32_t n : r.cell_nodes[c]) out[n].push_back(static_cast<std::int32_t>(c));
  return out;
}

/// Calls f(cell, place in it) for each voxel that has material.
template <class F>
void for_each_material_voxel(const Result& r, F&& f) {
  std::vector<bool> has_material(65536);
  for (const LatticeSegment& s : r.segments) has_material[s.segment.label] = s.material.has_value();
  const CellLocator locator = locator_of(r);
  for (std::size_t n = 0; n < r.labels.size(); ++n) {
    if (r.labels[n] == 0 || !has_material[r.labels[n]]) continue;
    const Index3 v = r.voxels.index(n);
    const std::int32_t cell = locator.cell_of_voxel(v);
    if (cell < 0) continue;
    Vec3 local;
    for (std::size_t d = 0; d < 3; ++d)
      local[static_cast<Eigen::Index>(d)] = (v[d] % r.voxels_per_cell[d] + 0.5) / r.voxels_per_cell[d];
    f(cell, local);
  }
}

/// The part of a cell's volume that each node sees, in units of a cell; and the fill of each cell.
std::pair<std::vector<double>, std::vector<double>> material_seen(const Result& r) {
  const double of_voxel = 1.0 / static_cast<double>(count_in(r.voxels_per_cell));
  std::vector<double> nodes(r.nodes.size()), cells(r.cells.size());
  for_each_material_voxel(r, [&](std::int32_t cell, const Vec3& local) {
    const NodeWeights weights = shape_functions(local);
    for (int a = 0; a < num_cell_nodes; ++a)
      nodes[r.cell_nodes[cell][static_cast<std::size_t>(a)]] += of_voxel * weights[a];
    cells[cell] += of_voxel;
  });
  return {std::move(nodes), std::move(cells)};
}

/// Samples of the cells that are asked for, at most 64 in each.
std::map<std::int32_t, std::vector<Sample>> samples_of(const Result& r, const std::vector<bool>& wanted) {
  std::map<std::int32_t, std::vector<Sample>> out;
  for (std::size_t c = 0; c < wanted.size(); ++c)
    if (wanted[c]) out[static_cast<std::int32_t>(c)].resize(subcells_along * subcells_along * subcells_along);
  for_each_material_voxel(r, [&](std::int32_t cell, const Vec3& local) {
    const auto found = wanted[cell] ? out.find(cell) : out.end();
    if (found == out.end()) return;
    std::size_t part = 0;
    for (int d = 2; d >= 0; --d)
      part =
          part * subcells_along + static_cast<std::size_t>(std::min(subcells_along - 1.0, subcells_along * local[d]));
    found->second[part].local += local;
    found->second[part].voxels += 1;
  });
  for (auto& [cell, samples] : out) {
    std::erase_if(samples, [](const Sample& s) { return s.voxels == 0; });
    for (Sample& s : samples) s.local /= s.voxels;
  }
  return out;
}

/// The cells that hold a node, and those that share one with them.
std::vector<std::int32_t> cells_around(std::int32_t node, const Result& r, const CellLists& of_nodes) {
  std::vector<std::int32_t> out;
  for (const std::int32_t cell : of_nodes[node])
    for (const std::int32_t n : r.cell_nodes[cell]) out.insert(out.end(), of_nodes[n].begin(), of_nodes[n].end());
  std::sort(out.begin(), out.end());
  out.erase(std::unique(out.begin(), out.end()), out.end());
  return out;
}

}  // namespace

NodeExtension::NodeExtension(const Result& r) {
  if (count_in(r.voxels_per_cell) == 1) return;
  const auto [seen, fill] = material_seen(r);
  const CellLists of_nodes = cells_of_nodes(r);
  std::vector<bool> wanted(r.cells.size());
  for (std::size_t n = 0; n < seen.size(); ++n)
    if (seen[n] < least_seen)
      for (const std::int32_t cell : cells_around(static_cast<std::int32_t>(n), r, of_nodes)) wanted[cell] = true;
  const auto samples = samples_of(r, wanted);
  const Vec3 edges =
      r.voxels.spacing().cwiseProduct(Vec3(r.voxels_per_cell[0], r.voxels_per_cell[1], r.voxels_per_cell[2]));

  for (std::size_t n = 0; n < seen.size(); ++n) {
    if (!(seen[n] < least_seen)) continue;
    struct Place {
      std::int32_t cell;
      NodeWeights weights;
      Vec3 from_node;  ///< in edges of cells, along their axes
      double weight;
    };
    std::vector<Place> places;
    Vec3 mean = Vec3::Zero();
    double all = 0;
    for (const std::int32_t cell : cells_around(static_cast<std::int32_t>(n), r, of_nodes))
      for (const Sample& s : samples.at(cell)) {
        const NodeWeights weights = shape_functions(s.local);
        Vec3 at = Vec3::Zero();
        for (int a = 0; a < num_cell_nodes; ++a)
          at += weights[a] * r.nodes[r.cell_nodes[cell][static_cast<std::size_t>(a)]];
        const Vec3 from = (r.voxels.direction().transpose() * (at - r.nodes[n])).cwiseQuotient(edges);
        const double near = 1 + from.squaredNorm();
        places.push_back({cell, weights, from, s.voxels / (near * near)});
        mean += places.back().weight * from;
        all += places.back().weight;
      }
    if (places.empty()) continue;
    mean /= all;
    Mat3 spread = Mat3::Zero();
    for (const Place& p : places) spread += p.weight / all * (p.from_node - mean) * (p.from_node - mean).transpose();
    // Along directions in which the material hardly reaches it says nothing of a slope.
    constexpr double least_spread = 1e-3;
    const Eigen::SelfAdjointEigenSolver<Mat3> axes(spread);
    Vec3 slope = Vec3::Zero();  // weights are 1/all (1 - mean . spread^-1 (x - mean))
    for (int d = 0; d < 3; ++d)
      if (axes.eigenvalues()[d] > least_spread)
        slope += axes.eigenvectors().col(d) * (axes.eigenvectors().col(d).dot(mean) / axes.eigenvalues()[d]);
    std::map<std::int32_t, double> of_nodes_there;
    for (const Place& p : places) {
      const double weight = p.weight / all * (1 - slope.dot(p.from_node - mean));
      for (int a = 0; a < num_cell_nodes; ++a)
        of_nodes_there[r.cell_nodes[p.cell][static_cast<std::size_t>(a)]] += weight * p.weights[a];
    }
    rows_.push_back({static_cast<std::int32_t>(n), {of_nodes_there.begin(), of_nodes_there.end()}});
  }

  for (std::size_t c = 0; c < fill.size(); ++c) {
    if (!(fill[c] < least_fill)) continue;
    std::map<std::int32_t, double> of_cells;
    double all = 0;
    for (const std::int32_t node : r.cell_nodes[c])
      for (const std::int32_t cell : of_nodes[node]) of_cells[cell] = fill[cell];
    for (const auto& [cell, volume] : of_cells) all += volume;
    if (!(all > 0)) continue;
    for (auto& [cell, volume] : of_cells) volume /= all;
    slivers_.push_back({static_cast<std::int32_t>(c), {of_cells.begin(), of_cells.end()}});
  }
}

template <class Value>
std::vector<Value> NodeExtension::replaced(const std::vector<Row>& rows, std::vector<Value> values, const Value& zero) {
  std::vector<Value> made(rows.size(), zero);
  for (std::size_t n = 0; n < rows.size(); ++n)
    for (const auto& [index, weight] : rows[n].weights) made[n] += weight * values[index];
  for (std::size_t n = 0; n < rows.size(); ++n) values[rows[n].index] = made[n];
  return values;
}

std::vector<Vec3> NodeExtension::extended(std::vector<Vec3> field) const {
  if (field.empty()) return field;
  return replaced<Vec3>(rows_, std::move(field), Vec3::Zero());
}

std::vector<double> NodeExtension::without_slivers(std::vector<double> of_cells) const {
  return replaced<double>(slivers_, std::move(of_cells), 0);
}

}  // namespace hexmesh
