// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/lattice/segment_distance.h"

#include <algorithm>
#include <cmath>

namespace hexmesh {
namespace {

constexpr int voxels_beyond_rim = 9;  // farther than averages over next neighbours see, below the face too

/// f(first, stride) for each line of a box along an axis.
template <class F>
void for_each_line(const Index3& extent, std::size_t axis, const F& f) {
  const std::size_t u = (axis + 1) % 3, w = (axis + 2) % 3, stride = strides_in(extent)[axis];
  Index3 v = {0, 0, 0};
  for (v[w] = 0; v[w] < extent[w]; ++v[w])
    for (v[u] = 0; v[u] < extent[u]; ++v[u]) f(offset_in(extent, v), stride);
}

/// Squared distances from the middles of voxels to the nearest voxel of a set, axis by axis.
std::vector<float> squared_distances(const std::vector<char>& is_in_set, const Index3& extent, const Vec3& spacing,
                                     float most) {
  std::vector<float> out(is_in_set.size());
  for (std::size_t n = 0; n < out.size(); ++n) out[n] = is_in_set[n] ? 0 : most * most;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    std::vector<float> away = {0};  // of voxels 1, 2, ... steps along the axis
    for (const double step = spacing[static_cast<Eigen::Index>(axis)]; away.back() < most * most;)
      away.push_back(static_cast<float>(std::pow((static_cast<double>(away.size()) - 0.5) * step, 2)));
    const auto count = static_cast<std::ptrdiff_t>(extent[axis]);
    std::vector<float> line(as_size(count));
    for_each_line(extent, axis, [&](std::size_t first, std::size_t stride) {
      for (std::ptrdiff_t n = 0; n < count; ++n) line[as_size(n)] = out[first + as_size(n) * stride];
      for (std::ptrdiff_t n = 0; n < count; ++n) {
        float least = line[as_size(n)];
        for (std::ptrdiff_t k = 1; away[as_size(k)] < least; ++k) {
          if (n - k >= 0) least = std::min(least, line[as_size(n - k)] + away[as_size(k)]);
          if (n + k < count) least = std::min(least, line[as_size(n + k)] + away[as_size(k)]);
        }
        out[first + as_size(n) * stride] = least;
      }
    });
  }
  return out;
}

/// Means over 2 reach + 1 neighbours along an axis, of which those beyond the ends are as the ends are.
void average(std::vector<float>& values, const Index3& extent, std::size_t axis, int reach) {
  const auto count = static_cast<std::ptrdiff_t>(extent[axis]);
  std::vector<float> line(as_size(count));
  for_each_line(extent, axis, [&](std::size_t first, std::size_t stride) {
    const auto at = [&](std::ptrdiff_t n) -> double {
      return line[as_size(std::clamp<std::ptrdiff_t>(n, 0, count - 1))];
    };
    for (std::ptrdiff_t n = 0; n < count; ++n) line[as_size(n)] = values[first + as_size(n) * stride];
    double sum = 0;
    for (std::ptrdiff_t n = -reach - 1; n < reach; ++n) sum += at(n);
    for (std::ptrdiff_t n = 0; n < count; ++n) {
      sum += at(n + reach) - at(n - reach - 1);
      values[first + as_size(n) * stride] = static_cast<float>(sum / (2 * reach + 1));
    }
  });
}

/// Weights of the quadratic B-splines of three neighbours at `f` from the middle one, their slopes and curvatures.
struct Splines {
  std::array<double, 3> value, slope;
  static constexpr std::array<double, 3> curvature = {1, -2, 1};
  explicit Splines(double f)
      : value{0.5 * (0.5 - f) * (0.5 - f), 0.75 - f * f, 0.5 * (0.5 + f) * (0.5 + f)},
        slope{f - 0.5, -2 * f, f + 0.5} {}
};

}  // namespace

SegmentDistance::SegmentDistance(const Grid& voxels, std::span<const std::uint16_t> labels, std::uint16_t label,
                                 std::uint16_t beside)
    : voxels_(voxels), to_index_(voxels.spacing().cwiseInverse().asDiagonal() * voxels.direction().transpose()) {
  most_ = static_cast<float>(most_voxels * voxels.spacing().maxCoeff());
  Index3 low = voxels.extent(), high = {-1, -1, -1};
  for (std::size_t n = 0; n < labels.size(); ++n) {
    if (labels[n] != label) continue;
    const Index3 v = voxels.index(n);
    for (std::size_t d = 0; d < 3; ++d) {
      low[d] = std::min(low[d], v[d]);
      high[d] = std::max(high[d], v[d]);
    }
  }
  for (std::size_t d = 0; d < 3; ++d) {
    const auto margin = static_cast<std::int32_t>(std::ceil(most_ / voxels.spacing()[static_cast<Eigen::Index>(d)]));
    first_[d] = low[d] - margin;
    extent_[d] = std::max(high[d] - low[d] + 1 + 2 * margin, 0);
  }
  const std::vector<char> is_inside = voxels_of(labels, label);
  std::vector<char> is_extended = is_inside;
  const bool touches = extend(is_extended, voxels_of(labels, beside));
  values_ = measured(is_extended);
  if (touches) alone_ = measured(is_inside);
  for (const float value : touches ? alone_ : values_) thickness_ = std::max<double>(thickness_, -value);
  values_ = smoothed(values_);
  if (touches) alone_ = smoothed(alone_);
}

std::vector<char> SegmentDistance::voxels_of(std::span<const std::uint16_t> labels, std::uint16_t label) const {
  std::vector<char> out(count_in(extent_));
  for (std::size_t n = 0; n < out.size(); ++n) {
    Index3 v = index_in(extent_, n);
    for (std::size_t d = 0; d < 3; ++d) v[d] += first_[d];
    out[n] = voxels_.contains(v) && labels[voxels_.offset(v)] == label;
  }
  return out;
}

/// On its own side of the face: above a floor that goes on beyond what stands on it there is nothing of it.
bool SegmentDistance::extend(std::vector<char>& is_inside, const std::vector<char>& is_beside) const {
  const std::array<std::size_t, 3> stride = strides_in(extent_);
  std::vector<char> touches(is_inside.size()), is_touched(is_inside.size());
  bool is_any = false;
  for (std::size_t n = 0; n < touches.size(); ++n)
    for (std::size_t d = 0; is_inside[n] && d < 3; ++d)  // never at the border: there is a margin
      for (const std::size_t other : {n - stride[d], n + stride[d]})
        if (is_beside[other]) touches[n] = is_touched[other] = is_any = true;
  if (!is_any) return false;
  const Vec3& spacing = voxels_.spacing();
  const std::vector<float> to_face = squared_distances(touches, extent_, spacing, most_),
                           from_face = squared_distances(is_touched, extent_, spacing, most_),
                           to_this = squared_distances(is_inside, extent_, spacing, most_),
                           to_other = squared_distances(is_beside, extent_, spacing, most_);
  const auto near = static_cast<float>(std::pow(voxels_beyond_rim * spacing.maxCoeff(), 2));
  for (std::size_t n = 0; n < is_inside.size(); ++n)
    if (!is_beside[n] && to_face[n] <= std::min(near, from_face[n]) && to_this[n] < to_other[n]) is_inside[n] = 1;
  return true;
}

std::vector<float> SegmentDistance::measured(const std::vector<char>& is_inside) const {
  std::vector<char> is_outside(is_inside.size());
  for (std::size_t n = 0; n < is_inside.size(); ++n) is_outside[n] = !is_inside[n];
  std::vector<float> out = squared_distances(is_inside, extent_, voxels_.spacing(), most_);
  const std::vector<float> inside = squared_distances(is_outside, extent_, voxels_.spacing(), most_);
  for (std::size_t n = 0; n < out.size(); ++n) out[n] = is_inside[n] ? -std::sqrt(inside[n]) : std::sqrt(out[n]);
  return out;
}

std::vector<float> SegmentDistance::smoothed(const std::vector<float>& values) const {
  std::vector<float> narrow = values;
  smooth_narrowly(narrow);
  std::vector<float> out = narrow;
  for (const Means& means : {Means{3, 12, 8, 12}, Means{5, 18, 20, 26}}) smooth_widely(out, values, narrow, means);
  return out;
}

/// Where means of this reach are cut into the same voxels, near steps and far from features; from there on gradually.
void SegmentDistance::smooth_widely(std::vector<float>& out, const std::vector<float>& values,
                                    const std::vector<float>& narrow, const Means& means) const {
  constexpr double most_off = 0.7, step_from = 0.01, near = 3;  // [voxels]
  const std::vector<float> wide = mean_over(values, means);
  const Vec3& spacing = voxels_.spacing();
  const double voxel = spacing.maxCoeff();
  const std::array<std::size_t, 3> stride = strides_in(extent_);
  const auto is_near = [&](std::size_t n) { return std::abs(values[n]) <= near * voxel; };  // never at the border
  std::vector<char> is_feature(values.size()), is_step(values.size());
  for (std::size_t n = 0; n < values.size(); ++n) {
    if (!is_near(n)) continue;
    Vec3 slope;
    for (std::size_t d = 0; d < 3; ++d) {
      const auto axis = static_cast<Eigen::Index>(d);
      slope[axis] = (wide[n + stride[d]] - wide[n - stride[d]]) / spacing[axis];
    }
    const double height = slope.cwiseAbs2().dot(spacing) / slope.squaredNorm();  // of steps along the normal
    is_feature[n] = !(std::abs(wide[n] - values[n]) <= most_off * height);
  }
  const auto farthest = static_cast<float>(means.much * voxel);
  const std::vector<float> to_feature = squared_distances(is_feature, extent_, spacing, farthest);
  /// 0 where a squared distance is little, 1 where it is much.
  const auto far = [&](float squared) {
    const double part = std::clamp((std::sqrt(squared) / voxel - means.little) / (means.much - means.little), 0.0, 1.0);
    return part * part * (3 - 2 * part);
  };
  for (std::size_t n = 0; n < values.size(); ++n)
    is_step[n] = is_near(n) && far(to_feature[n]) > 0 && std::abs(narrow[n] - values[n]) > step_from * voxel;
  const std::vector<float> to_step = squared_distances(is_step, extent_, spacing, farthest);
  for (std::size_t n = 0; n < out.size(); ++n)
    out[n] += static_cast<float>(far(to_feature[n]) * (1 - far(to_step[n])) * (wide[n] - out[n]));
}

/// f + S (f - S f) of the mean S, f as far as these means see it: a mean alone would shrink what is round.
std::vector<float> SegmentDistance::mean_over(const std::vector<float>& values, const Means& means) const {
  constexpr int times = 3;
  const auto mean_of = [&](std::vector<float> of) {
    for (int time = 0; time < times; ++time)
      for (std::size_t axis = 0; axis < 3; ++axis) average(of, extent_, axis, means.reach);
    return of;
  };
  std::vector<float> rest = values;
  const auto most = static_cast<float>(means.most * voxels_.spacing().maxCoeff());
  for (float& value : rest) value = std::clamp(value, -most, most);
  std::vector<float> out = mean_of(rest);
  for (std::size_t n = 0; n < rest.size(); ++n) rest[n] -= out[n];
  rest = mean_of(std::move(rest));
  for (std::size_t n = 0; n < out.size(); ++n) out[n] += rest[n];
  return out;
}

void SegmentDistance::smooth_narrowly(std::vector<float>& values) const {
  constexpr int times = 2;
  for (int time = 0; time < times; ++time)
    for (std::size_t axis = 0; axis < 3; ++axis)
      for_each_line(extent_, axis, [&](std::size_t first, std::size_t stride) {
        float before = values[first];
        for (std::size_t n = 0; n < as_size(extent_[axis]); ++n) {
          float& here = values[first + n * stride];
          const float now = here, after = n + 1 < as_size(extent_[axis]) ? values[first + (n + 1) * stride] : now;
          here = (before + 2 * now + after) / 4;
          before = now;
        }
      });
}

Gap SegmentDistance::gap(const Vec3& place) const {
  Gap out = interpolate(values_, place);
  if (alone_.empty()) return out;
  const Gap alone = interpolate(alone_, place);
  const double voxel = voxels_.spacing().maxCoeff(), beyond = alone.depth - out.depth - 2 * voxel;
  if (beyond <= 0) return out;
  const Vec3 slope = alone.normal - out.normal;
  out.depth += beyond * beyond / (2 * voxel);
  out.normal += beyond / voxel * slope;
  out.bending += (slope * slope.transpose() + beyond * (alone.bending - out.bending)) / voxel;
  return out;
}

Gap SegmentDistance::interpolate(const std::vector<float>& values, const Vec3& place) const {
  const Vec3 index = voxels_.continuous_index(place);
  Index3 middle{};
  Vec3 from;
  for (std::size_t d = 0; d < 3; ++d) {
    const auto axis = static_cast<Eigen::Index>(d);
    const double nearest = std::round(index[axis]);
    if (!(nearest - 1 >= first_[d] && nearest + 1 < first_[d] + extent_[d])) return {most_, Vec3::Zero(), Mat3::Zero()};
    middle[d] = static_cast<std::int32_t>(nearest) - first_[d];
    from[axis] = index[axis] - nearest;
  }
  const std::array<Splines, 3> of = {Splines(from[0]), Splines(from[1]), Splines(from[2])};
  // Axis by axis: sums with the values, slopes and curvatures of x, then of y, then of z.
  double depth = 0;
  Vec3 slope = Vec3::Zero();
  Mat3 bending = Mat3::Zero();
  const Splines &x = of[0], &y = of[1], &z = of[2];
  for (std::size_t k = 0; k < 3; ++k) {
    double plane = 0, plane_x = 0, plane_y = 0, plane_xx = 0, plane_xy = 0, plane_yy = 0;
    for (std::size_t j = 0; j < 3; ++j) {
      const float* row = &values[offset(
          {middle[0] - 1, middle[1] + static_cast<std::int32_t>(j) - 1, middle[2] + static_cast<std::int32_t>(k) - 1})];
      double line = 0, line_x = 0, line_xx = 0;
      for (std::size_t i = 0; i < 3; ++i) {
        line += x.value[i] * row[i];
        line_x += x.slope[i] * row[i];
        line_xx += Splines::curvature[i] * row[i];
      }
      plane += y.value[j] * line;
      plane_x += y.value[j] * line_x;
      plane_y += y.slope[j] * line;
      plane_xx += y.value[j] * line_xx;
      plane_xy += y.slope[j] * line_x;
      plane_yy += Splines::curvature[j] * line;
    }
    depth += z.value[k] * plane;
    slope += Vec3(z.value[k] * plane_x, z.value[k] * plane_y, z.slope[k] * plane);
    bending(0, 0) += z.value[k] * plane_xx;
    bending(1, 0) += z.value[k] * plane_xy;
    bending(1, 1) += z.value[k] * plane_yy;
    bending(2, 0) += z.slope[k] * plane_x;
    bending(2, 1) += z.slope[k] * plane_y;
    bending(2, 2) += Splines::curvature[k] * plane;
  }
  bending = Mat3(bending.selfadjointView<Eigen::Lower>());
  return {depth, to_index_.transpose() * slope, to_index_.transpose() * bending * to_index_};
}

}  // namespace hexmesh
