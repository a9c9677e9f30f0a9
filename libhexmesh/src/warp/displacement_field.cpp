// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/warp/displacement_field.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "hexmesh/core/error.h"
#include "hexmesh/lattice/locator.h"

namespace hexmesh {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr double margin_in_displacements = 1.5;
constexpr double least_margin = 10;  // [mm]
constexpr std::size_t most_samples = 24000000;
constexpr double most_voxels = 2e9;

Index3 nearest_voxel(const Vec3& index) {
  return {static_cast<std::int32_t>(std::lround(index[0])), static_cast<std::int32_t>(std::lround(index[1])),
          static_cast<std::int32_t>(std::lround(index[2]))};
}

Vec3 displacement_of(const Result& result, std::size_t node) {
  return result.displacement.empty() ? Vec3::Zero() : result.displacement[node];
}

/// Material of a body at rest: voxels with a material that are in its cells.
class Solid {
public:
  explicit Solid(const Result& result)
      : result_(result), locator_(result.voxels, result.voxels_per_cell, result.cells), has_material_(65536, false) {
    for (const LatticeSegment& s : result.segments) has_material_[s.segment.label] = s.material.has_value();
  }

  bool at(const Index3& voxel) const {
    return result_.voxels.contains(voxel) && has_material_[result_.labels[result_.voxels.offset(voxel)]] &&
           locator_.cell_of_voxel(voxel) >= 0;
  }
  /// Distance of a continuous voxel index from the nearest voxel of material, in voxels along the axis where it is
  /// largest; 0 inside one, infinite beyond `reach`.
  double distance(const Vec3& index, double reach) const {
    const Index3 home = nearest_voxel(index);
    if (at(home)) return 0;
    const int shell = static_cast<int>(std::ceil(reach));
    double least = std::numeric_limits<double>::infinity();
    for (int k = -shell; k <= shell; ++k)
      for (int j = -shell; j <= shell; ++j)
        for (int i = -shell; i <= shell; ++i) {
          const Index3 v = {home[0] + i, home[1] + j, home[2] + k};
          if (!at(v)) continue;
          const Vec3 outside = ((index - Vec3(v[0], v[1], v[2])).cwiseAbs().array() - 0.5).max(0);
          least = std::min(least, outside.maxCoeff());
        }
    return least <= reach ? least : std::numeric_limits<double>::infinity();
  }
  /// Whether a cell has another one on every side, edge and corner.
  bool is_interior(const Index3& cell) const {
    for (int n = 0; n < 27; ++n) {
      Index3 voxel;
      const std::array<int, 3> step = {n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1};
      for (std::size_t d = 0; d < 3; ++d) voxel[d] = (cell[d] + step[d]) * result_.voxels_per_cell[d];
      if (locator_.cell_of_voxel(voxel) < 0) return false;
    }
    return true;
  }
  /// Where what is at a voxel of `grid` was: in the body by its exact field, around it by the warp's; nothing where the
  /// warp folds so that the body would be seen a second time.
  std::optional<Vec3> rest_of(const Grid& grid, std::size_t n, const DisplacementField& exact,
                              const DisplacementField& to_rest) const {
    const Index3 v = grid.index(n);
    const Vec3 x = grid.position(Vec3(v[0], v[1], v[2]));
    if (const Vec3 step = exact.values[n].cast<double>(); !std::isnan(step[0])) return x + step;
    const Vec3 rest = x + to_rest.at(x);
    if (at(nearest_voxel(result_.voxels.continuous_index(rest)))) return std::nullopt;
    return rest;
  }
  const CellLocator& locator() const { return locator_; }

private:
  const Result& result_;
  CellLocator locator_;
  std::vector<bool> has_material_;
};

/// A cell's node positions and their inverse trilinear map.
struct DeformedCell {
  Eigen::Matrix<double, 3, 8> corners;

  /// Local coordinates of x within [-margin, 1 + margin], if there are any; Newton's method from the centre.
  std::optional<Vec3> locate(const Vec3& x, const Vec3& margin) const {
    Vec3 s = Vec3::Constant(0.5);
    bool converged = false;
    for (int iteration = 0; iteration < 12; ++iteration) {
      const Vec3 miss = x - corners * shape_functions(s);
      const Mat3 jacobian = corners * shape_gradients(s);
      if (!(std::abs(jacobian.determinant()) > 1e-12)) return std::nullopt;
      const Vec3 step = jacobian.inverse() * miss;
      s += step;
      if (!(s.lpNorm<Eigen::Infinity>() < 10)) return std::nullopt;
      if (step.lpNorm<Eigen::Infinity>() < 1e-6) {
        converged = true;
        break;
      }
    }
    if (!converged) return std::nullopt;
    const auto beyond = ((s.array() - 0.5).abs() - 0.5 - margin.array()).eval();
    if (beyond.maxCoeff() > 0) return std::nullopt;
    return s;
  }
};

/// u = H u(q) of a place in a cell.
Vec3 embedded(const Result& result, const Embedding& e) {
  const NodeWeights weights = shape_functions(e.local);
  Vec3 u = Vec3::Zero();
  for (int a = 0; a < num_cell_nodes; ++a)
    u += weights[a] *
         displacement_of(result, static_cast<std::size_t>(
                                     result.cell_nodes[static_cast<std::size_t>(e.cell)][static_cast<std::size_t>(a)]));
  return u;
}

struct IndexBox {
  Index3 first, last;
};

/// The deformed cells of a body with the samples of a grid that each may hold.
class DeformedCells {
public:
  DeformedCells(const Result& result, const Grid& grid, double reach)
      : result_(result), grid_(grid), reach_(reach), solid_(result) {
    boxes_.resize(result.cells.size());
    margins_.resize(result.cells.size());
#pragma omp parallel for schedule(static, 512)
    for (std::size_t c = 0; c < result.cells.size(); ++c) {
      // Rounding, unless the cell's map is continued; that only where no other cell follows.
      margins_[c] = Vec3::Constant(1e-4);
      if (reach > 0 && !solid_.is_interior(result.cells[c]))
        for (int d = 0; d < 3; ++d)
          margins_[c][d] = std::max(1e-4, reach / result.voxels_per_cell[static_cast<std::size_t>(d)]);
      boxes_[c] = box(c);
    }
  }

  /// Set those values of the layers [first, last] along an axis that have material, by cells in their order.
  void sample(int axis, std::int32_t first, std::int32_t last, std::vector<Eigen::Vector3f>& values) const {
    const auto d = static_cast<std::size_t>(axis);
    std::vector<float> distances;  // in voxels, of what the values are from the material
    const auto layer_size = grid_.num_voxels() / static_cast<std::size_t>(grid_.extent()[d]);
    distances.assign(layer_size * static_cast<std::size_t>(last - first + 1), std::numeric_limits<float>::infinity());
    Index3 inner = grid_.extent(), v;
    inner[d] = last - first + 1;
    for (std::size_t c = 0; c < result_.cells.size(); ++c) {
      IndexBox b = boxes_[c];
      b.first[d] = std::max(b.first[d], first);
      b.last[d] = std::min(b.last[d], last);
      if (b.first[d] > b.last[d]) continue;
      const DeformedCell cell = cell_at(c);
      for (v[2] = b.first[2]; v[2] <= b.last[2]; ++v[2])
        for (v[1] = b.first[1]; v[1] <= b.last[1]; ++v[1])
          for (v[0] = b.first[0]; v[0] <= b.last[0]; ++v[0]) {
            Index3 local = v;
            local[d] -= first;
            float& nearest = distances[static_cast<std::size_t>(local[0]) +
                                       static_cast<std::size_t>(inner[0]) *
                                           (static_cast<std::size_t>(local[1]) +
                                            static_cast<std::size_t>(inner[1]) * static_cast<std::size_t>(local[2]))];
            if (nearest == 0) continue;
            const Vec3 x = grid_.position(Vec3(v[0], v[1], v[2]));
            const std::optional<Vec3> s = cell.locate(x, margins_[c]);
            if (!s) continue;
            const Vec3 index = rest_index(c, *s);
            const auto distance = static_cast<float>(std::max(solid_.distance(index, reach_), beyond(*s)));
            if (!(distance < nearest)) continue;
            nearest = distance;
            values[grid_.offset(v)] = (result_.voxels.position(index) - x).cast<float>();
          }
    }
  }

private:
  DeformedCell cell_at(std::size_t c) const {
    DeformedCell cell;
    for (int a = 0; a < num_cell_nodes; ++a) {
      const auto node = static_cast<std::size_t>(result_.cell_nodes[c][static_cast<std::size_t>(a)]);
      cell.corners.col(a) = result_.nodes[node] + displacement_of(result_, node);
    }
    return cell;
  }

  /// Cells are boxes of voxels at rest, along the voxels' axes.
  Vec3 rest_index(std::size_t c, const Vec3& s) const {
    Vec3 index;
    for (int d = 0; d < 3; ++d) {
      const auto e = static_cast<std::size_t>(d);
      index[d] = (result_.cells[c][e] + s[d]) * result_.voxels_per_cell[e] - 0.5;
    }
    return index;
  }

  /// How far local coordinates are outside the cell, in voxels along the axis where that is most.
  double beyond(const Vec3& s) const {
    double most = 0;
    for (int d = 0; d < 3; ++d)
      most = std::max(most, (std::abs(s[d] - 0.5) - 0.5) * result_.voxels_per_cell[static_cast<std::size_t>(d)]);
    return most < 1e-3 ? 0 : most;
  }

  IndexBox box(std::size_t c) const {
    const DeformedCell cell = cell_at(c);
    Vec3 low = Vec3::Constant(std::numeric_limits<double>::infinity()), high = -low;
    for (int corner = 0; corner < num_cell_nodes; ++corner) {
      Vec3 s;
      for (int d = 0; d < 3; ++d) s[d] = corner_bit(corner, d) == 1 ? 1 + margins_[c][d] : -margins_[c][d];
      const Vec3 index = grid_.continuous_index(cell.corners * shape_functions(s));
      low = low.cwiseMin(index);
      high = high.cwiseMax(index);
    }
    IndexBox out;
    for (int d = 0; d < 3; ++d) {
      const auto e = static_cast<std::size_t>(d);
      const double end = grid_.extent()[e];
      // Past the end where the box is empty or not finite.
      out.first[e] = static_cast<std::int32_t>(low[d] > -1 ? std::min(std::ceil(low[d]), end) : 0.0);
      out.last[e] = static_cast<std::int32_t>(high[d] < end - 1 ? std::max(std::floor(high[d]), -1.0) : end - 1);
    }
    return out;
  }

  const Result& result_;
  const Grid& grid_;
  double reach_;
  Solid solid_;
  std::vector<IndexBox> boxes_;
  std::vector<Vec3> margins_;  ///< how far the map of each cell is continued, in cells
};

/// Calls `use(rest position, displacement)` for the centre of each voxel of material.
template <class Use>
void for_each_voxel(const Result& result, Use&& use) {
  const Solid solid(result);
  const Grid& grid = result.voxels;
  for (std::size_t n = 0; n < grid.num_voxels(); ++n) {
    const Index3 v = grid.index(n);
    if (!solid.at(v)) continue;
    const Vec3 index(v[0], v[1], v[2]);
    const Embedding e = solid.locator().in_cell_of_voxel(v, index);
    use(grid.position(index), result.displacement.empty() ? Vec3(Vec3::Zero()) : embedded(result, e));
  }
}

DisplacementField unknown_on(const Grid& grid) {
  return {grid, std::vector<Eigen::Vector3f>(grid.num_voxels(), Eigen::Vector3f::Constant(static_cast<float>(nan)))};
}

/// The grid continued by whole voxels to hold the bounds.
Grid continued(const Grid& grid, const Bounds& bounds) {
  Vec3 low = Vec3::Zero(), high = grid.corner(7);
  for (int corner = 0; corner < 8; ++corner) {
    Vec3 p;
    for (int d = 0; d < 3; ++d) p[d] = corner_bit(corner, d) == 1 ? bounds.high[d] : bounds.low[d];
    const Vec3 index = grid.continuous_index(p);
    low = low.cwiseMin(index);
    high = high.cwiseMax(index);
  }
  low = low.array().floor();
  const Vec3 count = (high - low).array().ceil() + 1;
  if (!(count.prod() < most_voxels))
    throw Error(ErrorKind::geometry, fmt::format("a grid around the body at rest and deformed takes {:.3g} voxels, "
                                                 "expected fewer: the body moved too far for its voxels",
                                                 count.prod()));
  return Grid(
      {static_cast<std::int32_t>(count[0]), static_cast<std::int32_t>(count[1]), static_cast<std::int32_t>(count[2])},
      grid.spacing(), grid.position(low), grid.direction());
}

}  // namespace

Vec3 DisplacementField::at(const Vec3& position) const {
  const Vec3 index = grid.continuous_index(position);
  const Vec3 last = grid.corner(7);
  if (!((index.array() >= 0).all() && (index.array() <= last.array()).all())) return Vec3::Zero();
  Index3 base;
  Vec3 s;
  for (int d = 0; d < 3; ++d) {
    const auto e = static_cast<std::size_t>(d);
    base[e] = std::clamp(static_cast<std::int32_t>(index[d]), 0, std::max(0, grid.extent()[e] - 2));
    s[d] = index[d] - base[e];
  }
  const NodeWeights weights = shape_functions(s);
  Vec3 sum = Vec3::Zero();
  for (int a = 0; a < num_cell_nodes; ++a) {
    if (weights[a] == 0) continue;
    Index3 v = base;
    for (int d = 0; d < 3; ++d) v[static_cast<std::size_t>(d)] += corner_bit(a, d);
    sum += weights[a] * values[grid.offset(v)].cast<double>();
  }
  return sum;
}

DisplacementField displacement_to_rest(const Result& result, const Grid& grid, double reach) {
  DisplacementField field = unknown_on(grid);
  const DeformedCells cells(result, grid, reach);
  const int axis = grid.extent()[2] >= grid.extent()[1] ? 2 : 1;
  const std::int32_t layers = grid.extent()[static_cast<std::size_t>(axis)];
  constexpr std::int32_t slab = 8;
#pragma omp parallel for schedule(dynamic, 1)
  for (std::int32_t first = 0; first < layers; first += slab)
    cells.sample(axis, first, std::min(first + slab, layers) - 1, field.values);
  return field;
}

DisplacementField displacement_from_rest(const Result& result, const Grid& grid, double reach) {
  DisplacementField field = unknown_on(grid);
  const Solid solid(result);
#pragma omp parallel for schedule(dynamic, 4096)
  for (std::size_t n = 0; n < grid.num_voxels(); ++n) {
    const Index3 v = grid.index(n);
    const Vec3 index = result.voxels.continuous_index(grid.position(Vec3(v[0], v[1], v[2])));
    if (!(solid.distance(index, reach) <= reach)) continue;
    const Embedding e = solid.locator().locate(index);
    if (e.cell < 0) continue;
    field.values[n] = embedded(result, e).cast<float>();
  }
  return field;
}

Bounds bounds_of(const Result& result) {
  Bounds b{Vec3::Constant(std::numeric_limits<double>::infinity()),
           Vec3::Constant(-std::numeric_limits<double>::infinity())};
  const Vec3 half = (result.voxels.direction() * result.voxels.spacing().asDiagonal()).cwiseAbs().rowwise().sum() / 2;
  // The voxels rather than the nodes: those of slivers move without meaning.
  for_each_voxel(result, [&](const Vec3& rest, const Vec3& u) {
    b.low = b.low.cwiseMin(rest - half).cwiseMin(rest + u - half);
    b.high = b.high.cwiseMax(rest + half).cwiseMax(rest + u + half);
  });
  return b;
}

Grid fitted_grid(const Result& result) { return continued(result.voxels, bounds_of(result)); }

Grid warp_grid(const Result& result) {
  double largest = 0;
  Vec3 low = Vec3::Constant(std::numeric_limits<double>::infinity()), high = -low;
  for_each_voxel(result, [&](const Vec3& rest, const Vec3& u) {
    largest = std::max(largest, u.norm());
    low = low.cwiseMin(rest);
    high = high.cwiseMax(rest);
  });
  const double size = (high - low).maxCoeff();
  const double margin = std::max(least_margin, std::min(margin_in_displacements * largest, size / 2));
  Bounds b = bounds_of(result);
  b.low.array() -= margin;
  b.high.array() += margin;
  Grid grid = continued(result.voxels, b);
  while (grid.num_voxels() > most_samples) {
    Eigen::Index finest = 0;
    grid.spacing().minCoeff(&finest);
    Index3 extent = grid.extent();
    Vec3 spacing = grid.spacing();
    extent[static_cast<std::size_t>(finest)] = (extent[static_cast<std::size_t>(finest)] + 2) / 2;
    spacing[finest] *= 2;
    grid = Grid(extent, spacing, grid.origin(), grid.direction());
  }
  return grid;
}

Warp make_warp(const Result& result) {
  const Grid grid = warp_grid(result);
  Warp warp{displacement_to_rest(result, grid, 1), displacement_from_rest(result, grid, 1)};
  continue_to_border(warp.to_rest);
  continue_to_border(warp.from_rest);
  return warp;
}

WarpCheck check_warp(const Result& result, const Warp& warp) {
  const Solid solid(result);
  WarpCheck check;
  for (std::size_t n = 0; n < result.labels.size(); ++n) {
    const Index3 v = result.voxels.index(n);
    if (!solid.at(v)) continue;
    const Vec3 rest = result.voxels.position(Vec3(v[0], v[1], v[2]));
    const Vec3 moved = rest + warp.from_rest.at(rest);
    const Vec3 back = moved + warp.to_rest.at(moved);
    const double miss =
        (result.voxels.continuous_index(back) - result.voxels.continuous_index(rest)).cwiseAbs().maxCoeff();
    ++check.voxels;
    check.over_a_tenth += miss > 0.1;
    check.mean += miss;
    check.largest = std::max(check.largest, miss);
  }
  check.mean /= static_cast<double>(std::max<std::size_t>(check.voxels, 1));
  const Grid& grid = warp.to_rest.grid;
  const DisplacementField exact = displacement_to_rest(result, grid);
  for (std::size_t n = 0; n < grid.num_voxels(); ++n) {
    if (!std::isnan(exact.values[n][0])) continue;
    const Index3 v = grid.index(n);
    const Vec3 rest = grid.position(Vec3(v[0], v[1], v[2])) + warp.to_rest.values[n].cast<double>();
    if (solid.at(nearest_voxel(result.voxels.continuous_index(rest)))) check.ghost_ml += grid.voxel_volume() / 1000;
  }
  return check;
}

IntensityVolume deform(const Result& result, const IntensityVolume& scan, const DisplacementField& to_rest,
                       const Grid& grid) {
  IntensityVolume out{grid, std::vector<float>(grid.num_voxels())};
  float lowest = std::numeric_limits<float>::infinity();
  for (const float value : scan.values)
    if (std::isfinite(value)) lowest = std::min(lowest, value);
  if (!std::isfinite(lowest)) lowest = 0;
  const DisplacementField exact = displacement_to_rest(result, grid);
  const Solid solid(result);
#pragma omp parallel for schedule(dynamic, 4096)
  for (std::size_t n = 0; n < out.values.size(); ++n) {
    const std::optional<Vec3> rest = solid.rest_of(grid, n, exact, to_rest);
    const double value = rest ? value_at(scan, *rest) : std::numeric_limits<double>::quiet_NaN();
    out.values[n] = std::isfinite(value) ? static_cast<float>(value) : lowest;
  }
  return out;
}

LabelVolume deformed_labels(const Result& result, const DisplacementField& to_rest, const Grid& grid) {
  LabelVolume out{grid, std::vector<std::uint16_t>(grid.num_voxels()), {}};
  for (const LatticeSegment& s : result.segments) out.segments.push_back(s.segment);
  const DisplacementField exact = displacement_to_rest(result, grid);
  const Solid solid(result);
#pragma omp parallel for schedule(dynamic, 4096)
  for (std::size_t n = 0; n < out.labels.size(); ++n)
    if (const std::optional<Vec3> rest = solid.rest_of(grid, n, exact, to_rest))
      out.labels[n] = label_at(result.voxels, result.labels, *rest);
  return out;
}

}  // namespace hexmesh
