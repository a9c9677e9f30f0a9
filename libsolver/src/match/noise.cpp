// SPDX-License-Identifier: Apache-2.0
#include "match/noise.h"

#include <algorithm>
#include <cmath>

namespace hexsolver {
namespace {

using hexmesh::as_size;
using hexmesh::Vec3;

/// Of each point the mean of its neighbours, which come once for each triangle that they share with it.
template <class Value>
std::vector<Value> means_around(const hexmesh::TriangleSurface& surface, const std::vector<Value>& values,
                                const Value& zero) {
  std::vector<Value> out(values.size(), zero);
  std::vector<int> count(values.size());
  for (const auto& t : surface.triangles)
    for (std::size_t n = 0; n < 3; ++n) {
      const std::size_t at = as_size(t[n]);
      out[at] += values[as_size(t[(n + 1) % 3])] + values[as_size(t[(n + 2) % 3])];
      count[at] += 2;
    }
  for (std::size_t n = 0; n < out.size(); ++n)
    if (count[n] > 0) out[n] /= count[n];
  return out;
}

}  // namespace

double noise_of(const hexmesh::TriangleSurface& surface) {
  // Of a point with six neighbours and independent errors of 1: their part in its distance beside the distances of its
  // neighbours. The median of what is normally distributed is 0.6745.
  constexpr double of_six_neighbours = 1.27, of_median = 0.6745;
  const std::vector<Vec3>& points = surface.points;
  std::vector<Vec3> normals(points.size(), Vec3::Zero());
  for (const auto& t : surface.triangles) {
    const Vec3& a = points[as_size(t[0])];
    const Vec3 normal = (points[as_size(t[1])] - a).cross(points[as_size(t[2])] - a);
    for (const std::int32_t corner : t) normals[as_size(corner)] += normal;
  }
  const std::vector<Vec3> around = means_around<Vec3>(surface, points, Vec3::Zero());
  std::vector<double> beside(points.size());
  for (std::size_t n = 0; n < points.size(); ++n) beside[n] = normals[n].normalized().dot(points[n] - around[n]);
  const std::vector<double> beside_around = means_around(surface, beside, 0.0);
  std::vector<double> all;
  for (std::size_t n = 0; n < points.size(); ++n)
    if (normals[n] != Vec3::Zero()) all.push_back(std::abs(beside[n] - beside_around[n]));
  if (all.empty()) return 0;
  const auto middle = all.begin() + static_cast<std::ptrdiff_t>(all.size() / 2);
  std::nth_element(all.begin(), middle, all.end());
  return *middle / (of_median * of_six_neighbours);
}

}  // namespace hexsolver
