// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>

#include "hexmesh/warp/displacement_field.h"

namespace hexmesh {
namespace {

using Vector = Eigen::Vector3f;

constexpr int sweeps = 12;
constexpr float relaxation = 1.6F;
constexpr int sweeps_on_coarsest = 200;
constexpr std::size_t coarsest_samples = 500;

/// Laplace's equation on one grid of the cascade.
struct Stage {
  Index3 extent;
  std::array<float, 3> weight;  ///< of the neighbours along each axis, 1 / spacing^2
  std::vector<Vector> values;
  std::vector<char> known;

  /// One sweep of successive over-relaxation over the samples that are not known, first one colour of a chessboard,
  /// then the other, so that the order of the rows does not matter. Outside the grid it is zero.
  void sweep() {
    const float diagonal = 2 * (weight[0] + weight[1] + weight[2]);
    const std::size_t row = strides_in(extent)[1], layer = strides_in(extent)[2];
    for (int color = 0; color < 2; ++color) {
#pragma omp parallel for schedule(static)
      for (std::int32_t k = 0; k < extent[2]; ++k)
        for (std::int32_t j = 0; j < extent[1]; ++j) {
          std::int32_t i = (j + k + color) % 2;
          for (std::size_t n = offset_in(extent, {i, j, k}); i < extent[0]; i += 2, n += 2) {
            if (known[n]) continue;
            Vector sum = Vector::Zero();
            const auto add = [&](std::size_t d, bool there, std::size_t neighbour) {
              if (there) sum += weight[d] * values[neighbour];
            };
            add(0, i > 0, n - 1);
            add(0, i + 1 < extent[0], n + 1);
            add(1, j > 0, n - row);
            add(1, j + 1 < extent[1], n + row);
            add(2, k > 0, n - layer);
            add(2, k + 1 < extent[2], n + layer);
            values[n] += relaxation * (sum / diagonal - values[n]);
          }
        }
    }
  }
};

/// Half as many samples along the axes with spacings below twice the smallest; each is the mean of the known ones that
/// it stands for.
Stage coarsen(const Stage& fine, Index3& factor) {
  float finest = 0;
  for (std::size_t d = 0; d < 3; ++d)
    if (fine.extent[d] > 1) finest = std::max(finest, fine.weight[d]);
  Stage coarse;
  for (std::size_t d = 0; d < 3; ++d) {
    factor[d] = fine.weight[d] > finest / 4 && fine.extent[d] > 1 ? 2 : 1;
    coarse.weight[d] = fine.weight[d] / static_cast<float>(factor[d] * factor[d]);
  }
  coarse.extent = coarser_extent(fine.extent, factor);
  const std::size_t count = count_in(coarse.extent);
  coarse.values.assign(count, Vector::Zero());
  coarse.known.assign(count, 0);
  std::vector<float> members(count);
  std::size_t n = 0;
  for (std::int32_t k = 0; k < fine.extent[2]; ++k)
    for (std::int32_t j = 0; j < fine.extent[1]; ++j)
      for (std::int32_t i = 0; i < fine.extent[0]; ++i, ++n) {
        if (!fine.known[n]) continue;
        const std::size_t m = offset_in(coarse.extent, coarser_index({i, j, k}, factor));
        coarse.values[m] += fine.values[n];
        members[m] += 1;
        coarse.known[m] = 1;
      }
  for (std::size_t m = 0; m < count; ++m)
    if (coarse.known[m]) coarse.values[m] /= members[m];
  return coarse;
}

/// Start values of what is not known: linear between the coarser grid's samples, constant beyond them.
void interpolate(const Stage& coarse, const Index3& factor, Stage& fine) {
  struct Pair {
    std::size_t first, second;
    float share;  ///< of the second
  };
  const std::array<std::size_t, 3> stride = strides_in(coarse.extent);
  std::array<std::vector<Pair>, 3> pairs;  // along each axis, as offsets
  for (std::size_t d = 0; d < 3; ++d)
    for (std::int32_t i = 0; i < fine.extent[d]; ++i) {
      const float at = factor[d] == 2 ? (static_cast<float>(i) - 0.5F) / 2 : static_cast<float>(i);
      const float last = static_cast<float>(coarse.extent[d] - 1);
      const float clamped = std::clamp(at, 0.0F, last);
      const auto low = static_cast<std::size_t>(clamped);
      const std::size_t high = std::min(low + 1, as_size(coarse.extent[d] - 1));
      pairs[d].push_back({low * stride[d], high * stride[d], clamped - static_cast<float>(low)});
    }
#pragma omp parallel for schedule(static)
  for (std::int32_t k = 0; k < fine.extent[2]; ++k)
    for (std::int32_t j = 0; j < fine.extent[1]; ++j)
      for (std::int32_t i = 0; i < fine.extent[0]; ++i) {
        const std::size_t n = offset_in(fine.extent, {i, j, k});
        if (fine.known[n]) continue;
        const Pair& x = pairs[0][i];
        const Pair& y = pairs[1][j];
        const Pair& z = pairs[2][k];
        const auto along_x = [&](std::size_t base) -> Vector {
          return (1 - x.share) * coarse.values[base + x.first] + x.share * coarse.values[base + x.second];
        };
        const auto along_y = [&](std::size_t base) -> Vector {
          return (1 - y.share) * along_x(base + y.first) + y.share * along_x(base + y.second);
        };
        fine.values[n] = (1 - z.share) * along_y(z.first) + z.share * along_y(z.second);
      }
}

void solve(Stage& stage) {
  if (count_in(stage.extent) <= coarsest_samples) {
    for (int n = 0; n < sweeps_on_coarsest; ++n) stage.sweep();
    return;
  }
  Index3 factor{};
  Stage coarse = coarsen(stage, factor);
  solve(coarse);
  interpolate(coarse, factor, stage);
  for (int n = 0; n < sweeps; ++n) stage.sweep();
}

}  // namespace

void continue_to_border(DisplacementField& field) {
  Stage stage;
  stage.extent = field.grid.extent();
  for (std::size_t d = 0; d < 3; ++d) {
    const double h = field.grid.spacing()[d];
    stage.weight[d] = static_cast<float>(1 / (h * h));
  }
  stage.values = std::move(field.values);
  stage.known.resize(stage.values.size());
  for (std::size_t n = 0; n < stage.values.size(); ++n) {
    stage.known[n] = !std::isnan(stage.values[n][0]);
    if (!stage.known[n]) stage.values[n].setZero();
  }
  solve(stage);
  field.values = std::move(stage.values);
}

}  // namespace hexmesh
