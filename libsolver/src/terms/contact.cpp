// SPDX-License-Identifier: Apache-2.0
#include "terms/contact.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "hexmesh/core/bytes.h"

namespace hexsolver {
namespace {

constexpr double part_of_thickness = 0.25;  // that an obstacle may move at a time
constexpr double part_with_friction = 0.1;  // of the load at a time
constexpr double touching = 1e-6;           // mm: what is so near is about to press

/// A tenth of what tissue gives way that is as thick as the point's face is long.
double stiffness_found(const MeshCells& cells, const SurfacePoint& p) {
  constexpr double times_softer = 10;
  const auto [level, cell] = cells.place(hexmesh::as_size(p.cell));
  const hexmesh::Lattice& lattice = cells.lattice();
  const std::uint16_t label = lattice.level(level).segment[hexmesh::as_size(cell)];
  double young = 0;
  for (const hexmesh::LatticeSegment& s : lattice.segments)
    if (s.segment.label == label && s.material) young = s.material->young;
  return times_softer * young * std::sqrt(p.area.norm());
}

bool is_half_space(const Contact& contact) { return std::holds_alternative<HalfSpace>(contact.obstacle); }

}  // namespace

PenaltyContact::PenaltyContact(const Contact& contact, const MeshCells& cells, const Mesh& mesh,
                               const std::vector<SurfacePoint>& points, bool is_hard)
    : contact_(contact), mesh_(mesh), active_(mesh) {
  for (const SurfacePoint& p : points)
    points_.push_back({p.cell, p.weights, mesh.rest_position(p.cell, p.weights), p.area,
                       contact.stiffness > 0 ? contact.stiffness : stiffness_found(cells, p)});
  active_.reserve(points_.size());
  if (is_hard) kept_held_off_.resize(points_.size());
  std::stable_sort(points_.begin(), points_.end(), [](const Point& a, const Point& b) { return a.cell < b.cell; });
  if (has_friction()) {
    frictions_.resize(points_.size());
    set_progress({0, 0});
    forget(NodeVector::Zero(3 * static_cast<Eigen::Index>(mesh.num_all_nodes())));
  }
  set_progress({1, 0});
}

void PenaltyContact::set_progress(const Progress& progress) {
  place_ = place_of(contact_, progress);
  strength_ = contact_.grows ? progress.fraction : 1;
  held_off_ = kept_held_off_;
  is_solved_ = false;
}

hexmesh::Gap PenaltyContact::gap(const Vec3& now, const Place& place) const {
  hexmesh::Gap g = hexmesh::gap_to(contact_.obstacle, place.inverse() * now);
  if (!contact_.turn) return g;
  g.normal = place.linear() * g.normal;
  g.bending = place.linear() * g.bending * place.linear().transpose();
  return g;
}

PenaltyContact::Drawn PenaltyContact::drawn(std::size_t p, const Vec3& now) const {
  const Friction& f = frictions_[p];
  if (f.most == 0) return {};
  Drawn out;
  out.by = f.spring + place_.inverse() * now - f.begin;
  out.by -= f.normal.dot(out.by) * f.normal;
  out.length = out.by.norm();
  out.slips = stiffness(p) * out.length > f.most;
  out.force = out.slips ? f.most : stiffness(p) * out.length;
  return out;
}

Vec3 PenaltyContact::force_of(const Drawn& drawn) const {
  return drawn.length == 0 ? Vec3(Vec3::Zero()) : Vec3(-drawn.force / drawn.length * (place_.linear() * drawn.by));
}

double PenaltyContact::energy_of(std::size_t p, double pressing) const {
  const double held_off = held_off_.empty() ? 0 : held_off_[p];
  if (pressing == held_off) return 0;  // where there is no stiffness too
  return (pressing * pressing - held_off * held_off) / (2 * stiffness(p));
}

double PenaltyContact::energy(const NodeVector& u) const {
  double sum = 0;
  for (std::size_t p = 0; p < points_.size(); ++p) {
    const Vec3 at = now(points_[p], u);
    const double pressing = press(p, gap(at, place_).depth), k = stiffness(p);
    sum += energy_of(p, pressing);
    if (!has_friction()) continue;
    const Drawn d = drawn(p, at);
    sum += d.slips ? d.force * (d.length - d.force / (2 * k)) : d.force * d.length / 2;
  }
  return sum;
}

double PenaltyContact::stored_energy(const NodeVector& u) const {
  double sum = 0;
  for (std::size_t p = 0; p < points_.size(); ++p) {
    const Vec3 at = now(points_[p], u);
    sum += energy_of(p, press(p, gap(at, place_).depth));
    if (has_friction()) sum += std::pow(drawn(p, at).force, 2) / (2 * stiffness(p));
  }
  return sum;
}

void PenaltyContact::add_gradient(const NodeVector& u, NodeVector& gradient, NodeVector& magnitude) const {
  const auto add = [&](const Point& p, const Vec3& by) {
    const CellVector force = spread_to_nodes(p.weights, by);
    mesh_.scatter_add(p.cell, force, gradient);
    mesh_.scatter_add(p.cell, force.cwiseAbs(), magnitude);
  };
  for (std::size_t p = 0; p < points_.size(); ++p) {
    const Vec3 at = now(points_[p], u);
    const hexmesh::Gap g = gap(at, place_);
    if (const double pressing = press(p, g.depth); pressing > 0) add(points_[p], -pressing * g.normal);
    if (!has_friction()) continue;
    if (const Drawn d = drawn(p, at); d.force > 0) add(points_[p], -force_of(d));
  }
}

void PenaltyContact::linearize(const NodeVector& u, double projection) {
  active_.clear();
  for (std::size_t p = 0; p < points_.size(); ++p) {
    const Vec3 at = now(points_[p], u);
    const double k = stiffness(p);
    Mat3 hessian = Mat3::Zero();
    bool is_active = false;
    const hexmesh::Gap g = gap(at, place_);
    if (const double pressing = press(p, g.depth); pressing > 0 || g.depth < touching) {
      // Across the normal of a ball the curvature is negative: a point deep inside slips off to any side.
      hessian =
          k * g.normal * g.normal.transpose() - (1 - std::min(projection, Hessian::projected)) * pressing * g.bending;
      is_active = true;
    }
    if (has_friction() && frictions_[p].most > 0) {
      const Drawn d = drawn(p, at);
      const Vec3 n = place_.linear() * frictions_[p].normal;
      Mat3 along = Mat3::Identity() - n * n.transpose();
      if (d.slips) {
        const Vec3 way = place_.linear() * d.by / d.length;
        along = d.force / (k * d.length) * (along - way * way.transpose()).eval();
      }
      hessian += k * along;
      is_active = true;
    }
    if (is_active) active_.add(points_[p].cell, points_[p].weights, hessian);
  }
}

std::size_t PenaltyContact::bytes() const {
  return hexmesh::bytes_of(points_) + hexmesh::bytes_of(held_off_) + hexmesh::bytes_of(kept_held_off_) +
         hexmesh::bytes_of(frictions_) + active_.bytes();
}

double PenaltyContact::attach(const NodeVector& u) {
  double changed = 0, all = 0;
  for (std::size_t p = 0; is_attached() && p < points_.size(); ++p) {
    const hexmesh::Gap g = hexmesh::gap_to(contact_.obstacle, place_.inverse() * now(points_[p], u));
    const double pressing = press(p, g.depth);
    if (is_solved_ && !held_off_.empty()) held_off_[p] = pressing;
    if (!has_friction()) continue;
    Friction& f = frictions_[p];
    const double most = contact_.friction * pressing;
    changed += std::abs(most - f.most);
    all += most;
    f.most = most;
    if (most > 0) f.normal = g.normal;
  }
  is_solved_ = true;
  return changed == 0 ? 0 : changed / all;
}

void PenaltyContact::forget(const NodeVector& u) {
  for (std::size_t p = 0; p < frictions_.size(); ++p)
    frictions_[p] = {place_.inverse() * now(points_[p], u), Vec3::Zero(), Vec3::Zero(), 0, false};
}

double PenaltyContact::keep(const NodeVector& u) {
  double work = 0;
  kept_held_off_ = held_off_;
  for (std::size_t p = 0; p < frictions_.size(); ++p) {
    const Vec3 at = now(points_[p], u);
    const Drawn d = drawn(p, at);
    Friction& f = frictions_[p];
    const double held = d.force / stiffness(p);
    if (d.slips) work += d.force * (d.length - held);
    f.spring = d.length == 0 ? Vec3(Vec3::Zero()) : Vec3(held / d.length * d.by);
    f.begin = place_.inverse() * at;
    f.slipped = d.slips;
  }
  return work;
}

/// Nanson's formula with F at the centre of the cell.
Vec3 PenaltyContact::outward(const Point& p, const NodeVector& u) const {
  const NodeGradients gradients =
      hexmesh::shape_gradients(Vec3::Constant(0.5)) * mesh_.edges(static_cast<std::size_t>(p.cell)).inverse();
  const CellVector v = mesh_.gather(p.cell, u);
  const Mat3 f = Mat3::Identity() + Eigen::Map<const Eigen::Matrix<double, 3, 8>>(v.data()) * gradients;
  return f.inverse().transpose() * p.area;
}

bool PenaltyContact::goes_too_far(const Progress& from, const Progress& to) const {
  if (is_half_space(contact_)) return false;
  const Place before = place_of(contact_, from), after = place_of(contact_, to);
  const Vec3 about = contact_.turn ? contact_.turn->about : Vec3(Vec3::Zero());
  const double turned = Eigen::AngleAxisd(after.linear() * before.linear().transpose()).angle();
  const double moved =
      (after * about - before * about).norm() + (turned > 0 ? turned * hexmesh::reach_of(contact_.obstacle, about) : 0);
  return moved > 1.000001 * part_of_thickness * hexmesh::thickness_of(contact_.obstacle);
}

double PenaltyContact::largest_load_step() const {
  const double most = has_friction() ? part_with_friction : 1;
  if (is_half_space(contact_)) return contact_.turn ? std::min(most, 1.0 / 8) : most;
  const double turned = contact_.turn ? std::abs(contact_.turn->radians) : 0;
  const double moved =
      contact_.by.norm() + (turned > 0 ? turned * hexmesh::reach_of(contact_.obstacle, contact_.turn->about) : 0);
  const double step = part_of_thickness * hexmesh::thickness_of(contact_.obstacle);
  return moved > step ? std::min(most, step / moved) : most;
}

void PenaltyContact::add_pressed(const NodeVector& u, std::vector<Pressed>& of_cells) const {
  for (std::size_t p = 0; p < points_.size(); ++p) {
    const double pressing = press(p, gap(now(points_[p], u), place_).depth);
    if (pressing == 0) continue;
    Pressed& cell = of_cells[hexmesh::as_size(points_[p].cell)];
    cell.force += pressing;
    cell.area += points_[p].area.norm();
  }
}

double PenaltyContact::work_of_motion(const NodeVector& u, const Progress& begin, const Progress& end) const {
  const bool is_still = !contact_.turn && !contact_.history && contact_.by.isZero(0);
  if (is_still) return 0;
  const Place from = place_of(contact_, begin), moved = place_of(contact_, end) * from.inverse();
  const bool is_at_begin = place_.isApprox(from, 0);
  double work = 0;
  for (std::size_t p = 0; p < points_.size(); ++p) {
    const Vec3 at = now(points_[p], u);
    const hexmesh::Gap g = gap(at, place_);
    Vec3 force = press(p, g.depth) * g.normal;
    if (has_friction()) force += force_of(drawn(p, at));
    if (!force.isZero(0)) work += force.dot(is_at_begin ? Vec3(moved * at - at) : Vec3(at - moved.inverse() * at));
  }
  return work;
}

PenaltyContact::State PenaltyContact::state(const NodeVector& u) const { return state(u, place_, has_friction()); }

void PenaltyContact::remember_force(const NodeVector& u) {
  if (!is_half_space(contact_)) kept_force_ = state(u).force;
}

bool PenaltyContact::went_through(const NodeVector& u) const {
  constexpr double other_way = -0.5;  // cosine
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
    if (std::any_of(stations.begin(), stations.end(), [&](const Place& place) { return gap(p.rest, place).depth < 0; }))
      out.push_back(p.rest);
  return out;
}

PenaltyContact::State PenaltyContact::state(const NodeVector& u, const Place& place, bool with_friction) const {
  State s;
  const Point* deepest = nullptr;
  hexmesh::Gap of_deepest;
  for (std::size_t n = 0; n < points_.size(); ++n) {
    const Point& p = points_[n];
    const Vec3 at = now(p, u);
    const hexmesh::Gap g = gap(at, place);
    if (!deepest || g.depth < of_deepest.depth) {
      deepest = &p;
      of_deepest = g;
    }
    if (with_friction) {
      const Drawn d = drawn(n, at);
      s.force += force_of(d);
      s.slipping += frictions_[n].slipped;
    }
    s.deepest = std::max(s.deepest, -g.depth);
    const double pressing = press(n, g.depth);
    s.points += pressing > 0;
    s.force += pressing * g.normal;
  }
  if (!deepest) return s;
  s.nearest = of_deepest.depth;
  // The surface point that is deepest faces the obstacle, unless that is behind the surface.
  if (!is_half_space(contact_)) s.is_inside = of_deepest.normal.dot(outward(*deepest, u)) > 0;
  return s;
}

}  // namespace hexsolver
