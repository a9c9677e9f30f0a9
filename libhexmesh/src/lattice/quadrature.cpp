// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/lattice/quadrature.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <limits>

namespace hexmesh {
namespace {

using Points = std::vector<MaterialPoint>;

/// Products of Legendre polynomials of degree 0 to 2 along each axis.
Eigen::Matrix<double, num_rule_points, 1> legendre(const Vec3& local) {
  std::array<Vec3, 3> along;
  for (int d = 0; d < 3; ++d) {
    const double t = 2 * local[d] - 1;
    along[d] = {1, std::sqrt(3.0) * t, std::sqrt(5.0) * (1.5 * t * t - 0.5)};
  }
  Eigen::Matrix<double, num_rule_points, 1> m;
  for (int q = 0; q < num_rule_points; ++q) m[q] = along[0][q % 3] * along[1][q / 3 % 3] * along[2][q / 9];
  return m;
}

/// Moments per volume of the points, one row each: of 1, and of mu and kappa where these are not in proportion to it.
Eigen::MatrixXd moments(const Points& points) {
  MaterialPoint sum;
  for (const MaterialPoint& p : points) {
    sum.volume += p.volume;
    sum.shear += p.shear;
    sum.bulk += p.bulk;
  }
  const auto excess = [&](const MaterialPoint& p) {
    const double volume = p.volume / sum.volume;
    return std::array<double, 2>{p.shear / sum.shear / volume - 1, p.bulk / sum.bulk / volume - 1};
  };
  constexpr double rounding = 1e-12;
  const bool is_even = std::all_of(points.begin(), points.end(), [&](const MaterialPoint& p) {
    return std::abs(excess(p)[0]) < rounding && std::abs(excess(p)[1]) < rounding;
  });
  Eigen::MatrixXd out(points.size(), is_even ? num_rule_points : 3 * num_rule_points);
  for (std::size_t p = 0; p < points.size(); ++p) {
    const Eigen::Matrix<double, 1, num_rule_points> m = legendre(points[p].local).transpose();
    auto row = out.row(static_cast<Eigen::Index>(p));
    row.head<num_rule_points>() = m;
    if (!is_even) row.tail<2 * num_rule_points>() << excess(points[p])[0] * m, excess(points[p])[1] * m;
  }
  return out;
}

/// Take points away while the others can take over their moments.
Points eliminated(const Points& points) {
  const auto count = static_cast<Eigen::Index>(points.size());
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(moments(points));
  qr.setThreshold(1e-14);
  // Changes of the weights that no moment notices, orthonormal columns.
  Eigen::MatrixXd free = Eigen::MatrixXd(qr.householderQ()).rightCols(count - qr.rank());
  Eigen::VectorXd weights(count);
  for (Eigen::Index p = 0; p < count; ++p) weights[p] = points[p].volume;
  while (free.cols() > 0) {
    Eigen::VectorXd change = free.col(0);
    if (change.minCoeff() >= 0) change = -change;
    double length = std::numeric_limits<double>::infinity();
    Eigen::Index used_up = 0;
    for (Eigen::Index p = 0; p < count; ++p)
      if (change[p] < 0 && weights[p] < length * -change[p]) {
        length = weights[p] / -change[p];
        used_up = p;
      }
    weights = (weights + length * change).cwiseMax(0);
    weights[used_up] = 0;
    // Of the remaining changes keep those that leave this point alone: all but one, after a reflection.
    Eigen::VectorXd reflection = free.row(used_up).transpose();
    reflection[0] += reflection[0] < 0 ? -reflection.norm() : reflection.norm();
    const Eigen::VectorXd along = free * reflection;
    free -= (2 / reflection.squaredNorm()) * along * reflection.transpose();
    free = Eigen::MatrixXd(free.rightCols(free.cols() - 1));
    free.row(used_up).setZero();
  }
  Points few;
  for (Eigen::Index p = 0; p < count; ++p) {
    const MaterialPoint& point = points[p];
    const double ratio = weights[p] / point.volume;
    if (weights[p] > 0) few.push_back({point.local, weights[p], ratio * point.shear, ratio * point.bulk});
  }
  return few;
}

}  // namespace

std::vector<MaterialPoint> gauss_points(double volume, double shear, double bulk) {
  Points points;
  for (int p = 0; p < 8; ++p) {
    Vec3 local;
    for (int d = 0; d < 3; ++d) local[d] = 0.5 + (corner_bit(p, d) - 0.5) / std::sqrt(3.0);
    points.push_back({local, volume / 8, shear / 8, bulk / 8});
  }
  return points;
}

std::vector<MaterialPoint> thinned(const std::vector<MaterialPoint>& points) {
  constexpr std::size_t at_once = 64;
  if (points.size() <= num_rule_points) return points;
  Points few;
  for (std::size_t begin = 0; begin < points.size(); begin += at_once) {
    const std::size_t end = std::min(points.size(), begin + at_once);
    few.insert(few.end(), points.begin() + static_cast<std::ptrdiff_t>(begin),
               points.begin() + static_cast<std::ptrdiff_t>(end));
    few = eliminated(few);
  }
  return few;
}

std::vector<MaterialPoint> QuadratureTree::form(int level, std::int32_t element) {
  const double voxel = lattice_.voxels.voxel_volume();
  if (const std::optional<std::int32_t> m = only_material(level, element)) {
    const Level& of = lattice_.level(level);
    const Material& material = lattice_.materials[*m].material;
    const double volume =
        voxel * static_cast<double>(of.voxels_per_cell[0] * of.voxels_per_cell[1] * of.voxels_per_cell[2]);
    return gauss_points(volume, volume * material.shear_modulus(), volume * material.bulk_modulus());
  }
  auto& known = known_[level];
  if (const auto found = known.find(element); found != known.end()) return found->second;
  const Level& of = lattice_.level(level);
  const Children& children = of.children[element];
  Points all;
  for (int slot = 0; slot < 8; ++slot) {
    const std::int32_t child = children[slot];
    if (child < 0) continue;
    for (MaterialPoint p : form(level - 1, child)) {
      for (int d = 0; d < 3; ++d)
        if (of.merge[d] == 2) p.local[d] = (p.local[d] + corner_bit(slot, d)) / 2;
      all.push_back(p);
    }
  }
  Points few = thinned(all);
  // Elements that few cells have in common are not worth their memory.
  if (2 * of.filled.size() < of.cells.size()) known.emplace(element, few);
  return few;
}

std::optional<std::int32_t> QuadratureTree::only_material(int level, std::int32_t element) const {
  if (level == 0) return element;
  const Level& of = lattice_.level(level);
  const Children& children = of.children[element];
  std::optional<std::int32_t> material;
  for (int slot = 0; slot < 8; ++slot) {
    bool exists = true;
    for (int d = 0; d < 3; ++d) exists = exists && (of.merge[d] == 2 || corner_bit(slot, d) == 0);
    if (!exists) continue;
    const std::int32_t child = children[slot];
    if (child < 0) return {};
    const std::optional<std::int32_t> of_child = only_material(level - 1, child);
    if (!of_child || (material && *material != *of_child)) return {};
    material = of_child;
  }
  return material;
}

}  // namespace hexmesh
