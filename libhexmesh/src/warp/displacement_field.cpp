// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/warp/displacement_field.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "hexmesh/core/memory.h"
#include "solid.h"

namespace hexmesh {
namespace {

const Eigen::Vector3f unknown = Eigen::Vector3f::Constant(std::numeric_limits<float>::quiet_NaN());

/// A cell's node positions and their inverse trilinear map.
struct DeformedCell {
  Eigen::Matrix<double, 3, 8> corners;

  /// Local coordinates of x within [-margin, 1 + margin], if there are any;
  /// Newton's method from the centre.
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
      // Rounding, unless the cell's map is continued; that only where no other
      // cell follows.
      margins_[c] = Vec3::Constant(1e-4);
      if (reach > 0 && !solid_.is_interior(result.cells[c]))
        for (int d = 0; d < 3; ++d) margins_[c][d] = std::max(1e-4, reach / result.voxels_per_cell[d]);
      boxes_[c] = box(c);
    }
  }

  /// The layers [first, last] along axis d: values that have material, by cells in their order.
  FieldSlab sample(int d, std::int32_t first, std::int32_t last) const {
    FieldSlab slab{{0, 0, 0}, grid_.extent(), {}};
    slab.first[d] = first;
    slab.extent[d] = last - first + 1;
    slab.values.assign(count_in(slab.extent), unknown);
    Index3 v;
    // In voxels, of what the values are from the material.
    std::vector<float> distances(slab.values.size(), std::numeric_limits<float>::infinity());
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
            const std::size_t n = offset_in(slab.extent, local);
            float& nearest = distances[n];
            if (nearest == 0) continue;
            const Vec3 x = grid_.center(v);
            const std::optional<Vec3> s = cell.locate(x, margins_[c]);
            if (!s) continue;
            const Vec3 index = rest_index(c, *s);
            const auto distance =
                static_cast<float>(std::max({solid_.distance(index, reach_), beyond(*s), of_another(c, index)}));
            if (!(distance < nearest)) continue;
            nearest = distance;
            slab.values[n] = (result_.voxels.position(index) - x).cast<float>();
          }
    }
    return slab;
  }

private:
  DeformedCell cell_at(std::size_t c) const {
    DeformedCell cell;
    for (int a = 0; a < num_cell_nodes; ++a) {
      const std::int32_t node = result_.cell_nodes[c][a];
      cell.corners.col(a) = result_.nodes[node] + displacement_of(result_, node);
    }
    return cell;
  }

  /// Cells are boxes of voxels at rest, along the voxels' axes.
  Vec3 rest_index(std::size_t c, const Vec3& s) const {
    Vec3 index;
    for (int d = 0; d < 3; ++d) index[d] = (result_.cells[c][d] + s[d]) * result_.voxels_per_cell[d] - 0.5;
    return index;
  }

  /// How far local coordinates are outside the cell, in voxels along the axis
  /// where that is most.
  double beyond(const Vec3& s) const {
    double most = 0;
    for (int d = 0; d < 3; ++d) most = std::max(most, (std::abs(s[d] - 0.5) - 0.5) * result_.voxels_per_cell[d]);
    return most < 1e-3 ? 0 : most;
  }

  /// Material of another cell at its index is nothing that a cell knows.
  double of_another(std::size_t c, const Vec3& index) const {
    if (result_.owners.empty()) return 0;
    const std::int32_t owner = solid_.locator().cell_of_voxel(nearest_voxel(index));
    const bool is_another = owner >= 0 && as_size(owner) != c && result_.cells[as_size(owner)] == result_.cells[c];
    return is_another ? std::numeric_limits<double>::infinity() : 0;
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
      const double end = grid_.extent()[d];
      // Past the end where the box is empty or not finite.
      out.first[d] = static_cast<std::int32_t>(low[d] > -1 ? std::min(std::ceil(low[d]), end) : 0.0);
      out.last[d] = static_cast<std::int32_t>(high[d] < end - 1 ? std::max(std::floor(high[d]), -1.0) : end - 1);
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

DisplacementField unknown_on(const Grid& grid) {
  expect_memory(grid.num_voxels() * sizeof(Eigen::Vector3f), "a displacement field on the grid");
  return {grid, std::vector<Eigen::Vector3f>(grid.num_voxels(), unknown)};
}

}  // namespace

Vec3 DisplacementField::at(const Vec3& position) const {
  const Vec3 index = grid.continuous_index(position);
  const Vec3 last = grid.corner(7);
  if (!((index.array() >= 0).all() && (index.array() <= last.array()).all())) return Vec3::Zero();
  Index3 base;
  Vec3 s;
  for (int d = 0; d < 3; ++d) {
    base[d] = std::clamp(static_cast<std::int32_t>(index[d]), 0, std::max(0, grid.extent()[d] - 2));
    s[d] = index[d] - base[d];
  }
  const NodeWeights weights = shape_functions(s);
  Vec3 sum = Vec3::Zero();
  for (int a = 0; a < num_cell_nodes; ++a) {
    if (weights[a] == 0) continue;
    Index3 v = base;
    for (int d = 0; d < 3; ++d) v[d] += corner_bit(a, d);
    sum += weights[a] * values[grid.offset(v)].cast<double>();
  }
  return sum;
}

void for_each_slab_to_rest(const Result& result, const Grid& grid, double reach,
                           const std::function<void(const FieldSlab&)>& f) {
  const DeformedCells cells(result, grid, reach);
  const int axis = grid.extent()[2] >= grid.extent()[1] ? 2 : 1;
  const std::int32_t layers = grid.extent()[axis];
  constexpr std::int32_t slab = 8;
#pragma omp parallel for schedule(dynamic, 1)
  for (std::int32_t first = 0; first < layers; first += slab)
    f(cells.sample(axis, first, std::min(first + slab, layers) - 1));
}

DisplacementField displacement_to_rest(const Result& result, const Grid& grid, double reach) {
  DisplacementField field = unknown_on(grid);
  for_each_slab_to_rest(result, grid, reach, [&](const FieldSlab& slab) {
    for_each_sample(slab, [&](const Index3& v, const Eigen::Vector3f& value) { field.values[grid.offset(v)] = value; });
  });
  return field;
}

DisplacementField displacement_from_rest(const Result& result, const Grid& grid, double reach) {
  DisplacementField field = unknown_on(grid);
  const Solid solid(result);
#pragma omp parallel for schedule(dynamic, 4096)
  for (std::size_t n = 0; n < grid.num_voxels(); ++n) {
    const Index3 v = grid.index(n);
    const Vec3 index = result.voxels.continuous_index(grid.center(v));
    if (!(solid.distance(index, reach) <= reach)) continue;
    const Embedding e = solid.locator().locate(index);
    if (e.cell < 0) continue;
    field.values[n] = embedded(result, e).cast<float>();
  }
  return field;
}

}  // namespace hexmesh
