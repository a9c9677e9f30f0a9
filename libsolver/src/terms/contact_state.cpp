// SPDX-License-Identifier: Apache-2.0
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/rotation.h"
#include "terms/contact.h"

// What is told of a contact, and how far an obstacle may move at a time.

namespace hexsolver {
namespace {

constexpr double part_of_thickness = 0.25;  // that an obstacle may move at a time
constexpr double part_with_friction = 0.1;  // of the load at a time

/// @param across  by how much more the depth changes than the place in space, 1 of an obstacle
double depth_in_space(const hexmesh::Gap& gap, double across) {
  return gap.depth == 0 ? 0 : gap.depth / std::max(across, 1e-9);
}

}  // namespace

/// F at the centre of its cell.
Mat3 PenaltyContact::deformation(const Point& p, const NodeVector& u) const {
  const NodeGradients gradients =
      hexmesh::shape_gradients(Vec3::Constant(0.5)) * mesh_.edges(static_cast<std::size_t>(p.cell)).inverse();
  const CellVector v = mesh_.gather(p.cell, u);
  return Mat3::Identity() + Eigen::Map<const Eigen::Matrix<double, 3, 8>>(v.data()) * gradients;
}

bool PenaltyContact::goes_too_far(const Progress& from, const Progress& to) const {
  if (is_boundless()) return false;
  const Place before = place_of(contact_, from), after = place_of(contact_, to);
  const Vec3 about = contact_.turn ? contact_.turn->about : Vec3(Vec3::Zero());
  const double turned = Eigen::AngleAxisd(after.linear() * before.linear().transpose()).angle();
  const double moved =
      (after * about - before * about).norm() + (turned > 0 ? turned * hexmesh::reach_of(contact_.obstacle, about) : 0);
  return moved > 1.000001 * part_of_thickness * hexmesh::thickness_of(contact_.obstacle);
}

double PenaltyContact::largest_load_step(double displaced) const {
  const double most = has_friction() ? part_with_friction : 1;
  if (other_) return std::min(most, part_of_thickness * other_->distance->thickness() / std::max(displaced, 1e-9));
  if (is_boundless()) return contact_.turn ? std::min(most, 1.0 / 8) : most;
  const double turned = contact_.turn ? std::abs(contact_.turn->radians) : 0;
  const double moved =
      contact_.by.norm() + (turned > 0 ? turned * hexmesh::reach_of(contact_.obstacle, contact_.turn->about) : 0);
  const double step = part_of_thickness * hexmesh::thickness_of(contact_.obstacle);
  return moved > step ? std::min(most, step / moved) : most;
}

std::vector<TouchPoint> PenaltyContact::touch_points(const NodeVector& u) const {
  constexpr double of_face = 0.3, of_cell = 0.1;  // of their lengths
  constexpr double least_part = 0.1;              // of a face that presses, which may look aside
  std::vector<TouchPoint> out;
  const std::vector<Located>& all = locate_all(u);
  for (std::size_t n = 0; n < points_.size(); ++n) {
    const Point& p = points_[n];
    const auto& [at, gap] = all[n];
    if (!at.is_there) continue;
    const double pressing = press(n, gap.depth);
    const double cell = mesh_.edges(hexmesh::as_size(p.cell)).colwise().norm().minCoeff();
    const Vec3 normal = at.to_frame.transpose() * gap.normal;
    const double across = normal.norm();
    const double nearly = std::max(of_face * std::sqrt(p.area.norm()), of_cell * cell);
    const bool touches = pressing != 0 || gap.depth <= nearly;
    TouchPoint point{p.cell,     p.weights, depth_in_space(gap, other_ ? across : 1), pressing * across,
                     /*area=*/0, touches};
    if (touches) {
      const Vec3 face = polar_decomposition(deformation(p, u)).rotation * p.area;
      point.area = std::max(std::abs(normal.dot(face)) / across, pressing != 0 ? least_part * face.norm() : 0);
    }
    out.push_back(point);
    if (at.cell < 0) continue;
    point.cell = at.cell;
    point.weights = hexmesh::shape_functions(at.local.cwiseMax(0).cwiseMin(1));  // places may be beyond their cell
    out.push_back(point);
  }
  return out;
}

double PenaltyContact::work_of_motion(const NodeVector& u, const Progress& begin, const Progress& end) const {
  const bool is_still = !contact_.turn && !contact_.history && contact_.by.isZero(0);
  if (is_still) return 0;
  const Place from = place_of(contact_, begin), moved = place_of(contact_, end) * from.inverse();
  const bool is_at_begin = place_.isApprox(from, 0);
  const std::vector<Located>& all = locate_all(u);
  double work = 0;
  for (std::size_t p = 0; p < points_.size(); ++p) {
    const Vec3 x = now(points_[p], u);
    const Vec3 force = all[p].at.to_frame.transpose() * force_at(p, all[p]);
    if (!force.isZero(0)) work += force.dot(is_at_begin ? Vec3(moved * x - x) : Vec3(x - moved.inverse() * x));
  }
  return work;
}

PenaltyContact::State PenaltyContact::state(const NodeVector& u) const { return state(u, place_, has_friction()); }

void PenaltyContact::remember_force(const NodeVector& u) {
  if (!is_boundless()) kept_force_ = state(u).force;
}

bool PenaltyContact::went_through(const NodeVector& u) const {
  constexpr double other_way = -0.5;  // cosine
  if (is_boundless()) return false;
  const State now = state(u);
  return now.is_inside || now.force.dot(kept_force_) < other_way * now.force.norm() * kept_force_.norm();
}

PenaltyContact::State PenaltyContact::state_before(const NodeVector& u) const {
  return state(u, place_of(contact_, {0, 0}), false);
}

std::vector<Vec3> PenaltyContact::places_swept_at_rest() const {
  constexpr int parts = 8;  // of each straight piece of the way
  std::vector<Progress> corners = {{0, 0}, {1, 0}};
  if (contact_.history) {
    corners.clear();
    for (const History::Row& row : contact_.history->rows) corners.push_back({1, row.time});
  }
  std::vector<Place> stations = {place_of(contact_, corners.front())};
  for (std::size_t n = 1; n < corners.size(); ++n)
    for (int part = 1; part <= parts; ++part) {
      const double way = double(part) / parts;
      stations.push_back(
          place_of(contact_, {corners[n - 1].fraction + way * (corners[n].fraction - corners[n - 1].fraction),
                              corners[n - 1].time + way * (corners[n].time - corners[n - 1].time)}));
    }
  std::vector<Vec3> out;
  for (const Point& p : points_)
    if (std::any_of(stations.begin(), stations.end(), [&](const Place& place) {
          return hexmesh::gap_to(contact_.obstacle, place.inverse() * p.rest).depth < 0;
        }))
      out.push_back(p.rest);
  return out;
}

PenaltyContact::State PenaltyContact::state(const NodeVector& u, const Place& place, bool with_friction) const {
  State s;
  const Point* deepest = nullptr;
  double least = std::numeric_limits<double>::infinity();
  Vec3 normal = Vec3::Zero();
  const std::vector<Located>* found = other_ ? &(settled_.empty() ? find_all(u) : locate_all(u)) : nullptr;
  for (std::size_t n = 0; n < points_.size(); ++n) {
    const Point& p = points_[n];
    const auto [at, g] = found ? (*found)[n] : locate(p, u, place);
    if (!at.is_there) continue;
    const Vec3 across = at.to_frame.transpose() * g.normal;
    const double depth = depth_in_space(g, other_ ? across.norm() : 1);
    if (!deepest || depth < least) {
      deepest = &p;
      least = depth;
      normal = across;
    }
    if (with_friction) {
      s.force += at.to_frame.transpose() * force_of(drawn(n, at));
      s.slipping += frictions_[n].slipped;
    }
    s.deepest = std::max(s.deepest, -depth);
    const double pressing = press(n, g.depth);
    s.points += pressing > 0;
    s.force += pressing * across;
  }
  if (other_ && other_->is_self) s.force.setZero();  // what one part bears the other exerts
  if (!deepest) return s;
  s.nearest = least;
  // The surface point that is deepest faces the obstacle, unless that is behind the surface.
  if (!is_boundless())
    s.is_inside = normal.dot(deformation(*deepest, u).inverse().transpose() * deepest->area) > 0;  // Nanson's formula
  return s;
}

std::vector<double> pressure_of_cells(const Mesh& mesh, const std::vector<TouchPoint>& points) {
  const auto num_nodes = static_cast<Eigen::Index>(mesh.num_all_nodes());
  Eigen::ArrayXd force = Eigen::ArrayXd::Zero(num_nodes), area = force;
  const auto nodes = [&](const TouchPoint& p) {
    const CellNodes& of_cell = mesh.cell_nodes()[hexmesh::as_size(p.cell)];
    return Eigen::Map<const Eigen::Array<std::int32_t, 8, 1>>(of_cell.data());
  };
  for (const TouchPoint& p : points) {
    if (!p.touches) continue;
    force(nodes(p)) += p.force * p.weights.array();
    area(nodes(p)) += p.area * p.weights.array();
  }
  const Eigen::ArrayXd of_nodes = (area > 0).select(force / area, 0);
  std::vector<double> out(mesh.num_cells()), areas(out.size());
  for (const TouchPoint& p : points) {
    if (!p.touches) continue;
    out[hexmesh::as_size(p.cell)] += p.area * (p.weights.array() * of_nodes(nodes(p))).sum();
    areas[hexmesh::as_size(p.cell)] += p.area;
  }
  for (std::size_t c = 0; c < out.size(); ++c)
    if (areas[c] > 0) out[c] /= areas[c];
  return out;
}

std::vector<double> gap_of_cells(const Mesh& mesh, const std::vector<TouchPoint>& points, double farthest) {
  std::vector<double> out(mesh.num_cells(), farthest);
  for (const TouchPoint& p : points) {
    double& least = out[hexmesh::as_size(p.cell)];
    least = std::min(least, p.gap);
  }
  return out;
}

}  // namespace hexsolver
