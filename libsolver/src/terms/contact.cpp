// SPDX-License-Identifier: Apache-2.0
#include "terms/contact.h"

#include <Eigen/LU>
#include <algorithm>

#include "hexmesh/core/bytes.h"

namespace hexsolver {
namespace {

constexpr double part_of_radius = 0.25;  // that a ball may move at a time

}  // namespace

PenaltyContact::PenaltyContact(const Contact& contact, const Mesh& mesh, const std::vector<SurfacePoint>& points)
    : contact_(contact), mesh_(mesh), moved_(contact.by), active_(mesh) {
  for (const SurfacePoint& p : points) {
    points_.push_back({p.cell, p.weights, mesh.rest_position(p.cell, p.weights), p.area});
  }
  active_.reserve(points_.size());
  std::stable_sort(points_.begin(), points_.end(), [](const Point& a, const Point& b) { return a.cell < b.cell; });
}

Vec3 PenaltyContact::moved_at(const Progress& progress) const {
  return contact_.history ? contact_.history->at(progress.time) : Vec3(progress.fraction * contact_.by);
}

void PenaltyContact::set_progress(const Progress& progress) { moved_ = moved_at(progress); }

PenaltyContact::Gap PenaltyContact::gap(const Point& p, const NodeVector& u, const Vec3& moved) const {
  const Vec3 x = p.rest + mesh_.interpolate(p.cell, p.weights, u) - moved;
  if (const auto* plane = std::get_if<HalfSpace>(&contact_.obstacle))
    return {(x - plane->point).dot(plane->normal), plane->normal, 0};
  const Ball& ball = std::get<Ball>(contact_.obstacle);
  const Vec3 from_center = x - ball.center;
  const double distance = from_center.norm();
  if (distance == 0) return {-ball.radius, Vec3::UnitX(), 0};
  return {distance - ball.radius, from_center / distance, 1 / distance};
}

double PenaltyContact::energy(const NodeVector& u) const {
  double sum = 0;
  for (const Point& p : points_) {
    const double depth = std::min(gap(p, u).depth, 0.0);
    sum += contact_.stiffness / 2 * depth * depth;
  }
  return sum;
}

void PenaltyContact::add_gradient(const NodeVector& u, NodeVector& gradient, NodeVector& magnitude) const {
  for (const Point& p : points_) {
    const Gap g = gap(p, u);
    if (g.depth >= 0) continue;
    const CellVector force = spread_to_nodes(p.weights, contact_.stiffness * g.depth * g.normal);
    mesh_.scatter_add(p.cell, force, gradient);
    mesh_.scatter_add(p.cell, force.cwiseAbs(), magnitude);
  }
}

void PenaltyContact::linearize(const NodeVector& u, double projection) {
  active_.clear();
  for (const Point& p : points_) {
    const Gap g = gap(p, u);
    if (g.depth >= 0) continue;
    // Across the normal of a ball the curvature is negative: a point deep inside slips off to any side.
    const double across = (1 - std::min(projection, Hessian::projected)) * g.depth * g.bending;
    active_.add(p.cell, p.weights,
                contact_.stiffness * (across * Mat3::Identity() + (1 - across) * g.normal * g.normal.transpose()));
  }
}

std::size_t PenaltyContact::bytes() const { return hexmesh::bytes_of(points_) + active_.bytes(); }

/// Nanson's formula with F at the centre of the cell.
Vec3 PenaltyContact::outward(const Point& p, const NodeVector& u) const {
  const NodeGradients gradients =
      hexmesh::shape_gradients(Vec3::Constant(0.5)) * mesh_.edges(static_cast<std::size_t>(p.cell)).inverse();
  const CellVector v = mesh_.gather(p.cell, u);
  const Mat3 f = Mat3::Identity() + Eigen::Map<const Eigen::Matrix<double, 3, 8>>(v.data()) * gradients;
  return f.inverse().transpose() * p.area;
}

bool PenaltyContact::goes_too_far(const Progress& from, const Progress& to) const {
  const Ball* ball = std::get_if<Ball>(&contact_.obstacle);
  return ball && (moved_at(to) - moved_at(from)).norm() > 1.000001 * part_of_radius * ball->radius;
}

double PenaltyContact::largest_load_step() const {
  const Ball* ball = std::get_if<Ball>(&contact_.obstacle);
  return ball && contact_.by.norm() > 0 ? std::min(1.0, part_of_radius * ball->radius / contact_.by.norm()) : 1;
}

PenaltyContact::State PenaltyContact::state(const NodeVector& u) const { return state(u, moved_); }

PenaltyContact::State PenaltyContact::state_before(const NodeVector& u) const {
  return state(u, contact_.history ? contact_.history->at(0) : Vec3::Zero());
}

std::vector<Vec3> PenaltyContact::places_swept_at_rest() const {
  constexpr int parts = 8;  // of each straight piece of the way
  std::vector<Vec3> corners = {Vec3::Zero(), contact_.by}, stations;
  if (contact_.history) {
    corners.clear();
    for (const History::Row& row : contact_.history->rows) corners.push_back(row.value);
  }
  stations.push_back(corners.front());
  for (std::size_t n = 1; n < corners.size(); ++n)
    for (int part = 1; part <= parts; ++part)
      stations.emplace_back(corners[n - 1] + part * (corners[n] - corners[n - 1]) / parts);
  const NodeVector rest = NodeVector::Zero(static_cast<Eigen::Index>(mesh_.num_dofs()));
  std::vector<Vec3> out;
  for (const Point& p : points_)
    if (std::any_of(stations.begin(), stations.end(), [&](const Vec3& moved) { return gap(p, rest, moved).depth < 0; }))
      out.push_back(p.rest);
  return out;
}

PenaltyContact::State PenaltyContact::state(const NodeVector& u, const Vec3& moved) const {
  State s;
  const Point* deepest = nullptr;
  double least_depth = 0;
  for (const Point& p : points_) {
    const Gap g = gap(p, u, moved);
    if (!deepest || g.depth < least_depth) {
      deepest = &p;
      least_depth = g.depth;
    }
    if (g.depth >= 0) continue;
    ++s.points;
    s.deepest = std::max(s.deepest, -g.depth);
    s.force -= contact_.stiffness * g.depth * g.normal;
  }
  s.nearest = least_depth;
  // The surface point nearest to the centre of a ball faces it, unless the centre is behind the surface.
  if (deepest && std::holds_alternative<Ball>(contact_.obstacle))
    s.is_inside = gap(*deepest, u, moved).normal.dot(outward(*deepest, u)) > 0;
  return s;
}

}  // namespace hexsolver
