// SPDX-License-Identifier: Apache-2.0
#include "terms/contact.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "hexmesh/core/bytes.h"

namespace hexsolver {
namespace {

constexpr double part_of_thickness = 0.25;  // that an obstacle may move at a time
constexpr double part_with_friction = 0.1;  // of the load at a time
constexpr double touching = 1e-6;           // mm: what is so near is about to press

/// A tenth of what tissue gives way that is as thick as the point's face is long, the softer where two touch.
double stiffness_found(const MeshCells& cells, const SurfacePoint& p, const OtherSegment* other) {
  constexpr double times_softer = 10;
  const auto [level, cell] = cells.place(hexmesh::as_size(p.cell));
  const hexmesh::Lattice& lattice = cells.lattice();
  const std::uint16_t label = lattice.level(level).segment[hexmesh::as_size(cell)];
  double young = 0;
  for (const hexmesh::LatticeSegment& s : lattice.segments)
    if (s.segment.label == label && s.material) young = s.material->young;
  if (other) young = std::min(young, other->young);
  return times_softer * young * std::sqrt(p.area.norm());
}

}  // namespace

PenaltyContact::PenaltyContact(const Contact& contact, const MeshCells& cells, const Mesh& mesh,
                               const std::vector<SurfacePoint>& points, bool is_hard,
                               std::unique_ptr<OtherSegment> other)
    : contact_(contact), mesh_(mesh), active_(mesh), other_active_(mesh), other_(std::move(other)) {
  for (std::size_t n = 0; n < points.size(); ++n) {
    const SurfacePoint& p = points[n];
    points_.push_back({p.cell, p.weights, mesh.rest_position(p.cell, p.weights), p.area,
                       contact.stiffness > 0 ? contact.stiffness : stiffness_found(cells, p, other_.get())});
    if (!other_ || !other_->touching[n]) continue;
    points_.back().begin = other_->distance.gap(points_.back().rest).depth;
    points_.back().is_bonded = contact.adhesion;
  }
  active_.reserve(points_.size());
  if (is_hard) kept_held_off_.resize(points_.size());
  std::stable_sort(points_.begin(), points_.end(), [](const Point& a, const Point& b) { return a.cell < b.cell; });
  const NodeVector at_rest = NodeVector::Zero(3 * static_cast<Eigen::Index>(mesh.num_all_nodes()));
  remember_cells(at_rest);
  if (has_friction()) {
    frictions_.resize(points_.size());
    set_progress({0, 0});
    forget(at_rest);
  }
  set_progress({1, 0});
}

void PenaltyContact::set_progress(const Progress& progress) {
  place_ = place_of(contact_, progress);
  strength_ = contact_.grows ? progress.fraction : 1;
  held_off_ = kept_held_off_;
  is_solved_ = false;
}

PenaltyContact::At PenaltyContact::locate(const Point& p, const NodeVector& u, const Place& place) const {
  const Vec3 x = now(p, u);
  if (!other_) return {place.inverse() * x, place.linear().transpose()};
  const BodyMap::Place there = other_->map.find(x, u, p.near);
  return {there.rest, there.to_rest, there.cell >= 0, there.cell, there.weights};
}

void PenaltyContact::remember_cells(const NodeVector& u) {
  if (!other_) return;
  other_->map.look_at(u);
  for (Point& p : points_) {
    const BodyMap::Place there = other_->map.find(now(p, u), u, p.near);
    p.near = {there.cell, there.local};
  }
}

bool PenaltyContact::is_boundless() const { return other_ || std::holds_alternative<HalfSpace>(contact_.obstacle); }

hexmesh::Gap PenaltyContact::gap(const Point& p, const At& at) const {
  if (!other_) return hexmesh::gap_to(contact_.obstacle, at.place);
  if (!at.is_there) return {std::numeric_limits<double>::infinity(), Vec3::Zero(), Mat3::Zero()};
  hexmesh::Gap g = other_->distance.gap(at.place);
  g.depth -= p.begin;
  return g;
}

PenaltyContact::Drawn PenaltyContact::drawn(std::size_t p, const At& at) const {
  const Friction& f = frictions_[p];
  if (f.most == 0 || !at.is_there || !f.began) return {};
  Drawn out;
  out.by = f.spring + at.place - f.begin;
  out.by -= f.normal.dot(out.by) * f.normal;
  out.length = out.by.norm();
  out.slips = stiffness(p) * out.length > f.most;
  out.force = out.slips ? f.most : stiffness(p) * out.length;
  return out;
}

Vec3 PenaltyContact::force_of(const Drawn& drawn) {
  return drawn.length == 0 ? Vec3(Vec3::Zero()) : Vec3(-drawn.force / drawn.length * drawn.by);
}

double PenaltyContact::energy_of(std::size_t p, double pressing) const {
  const double held_off = held_off_.empty() ? 0 : held_off_[p];
  if (pressing == held_off) return 0;  // where there is no stiffness too
  return (pressing * pressing - held_off * held_off) / (2 * stiffness(p));
}

double PenaltyContact::energy(const NodeVector& u) const {
  double sum = 0;
  for (std::size_t p = 0; p < points_.size(); ++p) {
    const At at = locate(points_[p], u);
    const double pressing = press(p, gap(points_[p], at).depth), k = stiffness(p);
    sum += energy_of(p, pressing);
    if (!has_friction()) continue;
    const Drawn d = drawn(p, at);
    sum += d.slips ? d.force * (d.length - d.force / (2 * k)) : d.force * d.length / 2;
  }
  return sum;
}

/// Of points near another segment: they come no deeper into it, at a time, than a quarter of its thickness and two
/// voxels.
double PenaltyContact::longest_step(const NodeVector& u, const NodeVector& step) const {
  double part = 1;
  for (std::size_t p = 0; other_ && p < points_.size(); ++p) {
    const At at = locate(points_[p], u);
    if (!at.is_there) continue;
    const Vec3 by = at.to_frame * (mesh_.interpolate(points_[p].cell, points_[p].weights, step) -
                                   mesh_.interpolate(at.cell, at.weights, step));
    const hexmesh::Gap g = gap(points_[p], at);
    if (const double approach = -g.normal.dot(by); approach > 0)
      part = std::min(part, (std::max(g.depth, 0.0) + other_->deepest_at_once) / approach);
  }
  return part;
}

double PenaltyContact::stored_energy(const NodeVector& u) const {
  double sum = 0;
  for (std::size_t p = 0; p < points_.size(); ++p) {
    const At at = locate(points_[p], u);
    sum += energy_of(p, press(p, gap(points_[p], at).depth));
    if (has_friction()) sum += std::pow(drawn(p, at).force, 2) / (2 * stiffness(p));
  }
  return sum;
}

Vec3 PenaltyContact::force_at(std::size_t p, const At& at) const {
  const hexmesh::Gap g = gap(points_[p], at);
  const double pressing = press(p, g.depth);
  Vec3 force = pressing == 0 ? Vec3(Vec3::Zero()) : Vec3(pressing * g.normal);
  if (has_friction()) force += force_of(drawn(p, at));
  return force;
}

double PenaltyContact::gradient_jump(const NodeVector& u) const {
  double sum = 0;
  for (std::size_t p = 0; other_ && p < points_.size(); ++p) {
    const BodyMap::Place there = other_->map.find(now(points_[p], u), u, points_[p].near);
    const Vec3 force = force_at(p, {there.rest, there.to_rest, there.cell >= 0, there.cell, there.weights});
    if (force.isZero(0)) continue;
    double most = 0;
    for (const Mat3& to_rest : other_->map.to_rest_beside(there, u))
      most = std::max(most, ((to_rest - there.to_rest).transpose() * force).norm());
    sum += most * std::sqrt(points_[p].weights.squaredNorm() + there.weights.squaredNorm());
  }
  return sum;
}

void PenaltyContact::add_gradient(const NodeVector& u, NodeVector& gradient, NodeVector& magnitude) const {
  const auto scatter = [&](std::int32_t cell, const NodeWeights& weights, const Vec3& force) {
    const CellVector by = spread_to_nodes(weights, force);
    mesh_.scatter_add(static_cast<std::size_t>(cell), by, gradient);
    mesh_.scatter_add(static_cast<std::size_t>(cell), by.cwiseAbs(), magnitude);
  };
  for (std::size_t n = 0; n < points_.size(); ++n) {
    const Point& p = points_[n];
    const At at = locate(p, u);
    Vec3 force = force_at(n, at);
    if (force.isZero(0)) continue;
    force = at.to_frame.transpose() * force;
    scatter(p.cell, p.weights, -force);
    if (at.cell >= 0) scatter(at.cell, at.weights, force);
  }
}

void PenaltyContact::linearize(const NodeVector& u, double projection) {
  active_.clear();
  other_active_.clear();
  couplings_.clear();
  remember_cells(u);
  for (std::size_t n = 0; n < points_.size(); ++n) {
    const Point& p = points_[n];
    const At at = locate(p, u);
    const double k = stiffness(n);
    Mat3 hessian = Mat3::Zero();  // in the frame
    bool is_active = false;
    const hexmesh::Gap g = gap(p, at);
    if (const double pressing = press(n, g.depth); pressing != 0 || g.depth < touching) {
      // Across the normal of a ball the curvature is negative: a point deep inside slips off to any side.
      hessian =
          k * g.normal * g.normal.transpose() - (1 - std::min(projection, Hessian::projected)) * pressing * g.bending;
      is_active = true;
    }
    if (has_friction() && frictions_[n].most > 0) {
      const Drawn d = drawn(n, at);
      const Vec3& normal = frictions_[n].normal;
      Mat3 along = Mat3::Identity() - normal * normal.transpose();
      if (d.slips) {
        const Vec3 way = d.by / d.length;
        along = d.force / (k * d.length) * (along - way * way.transpose()).eval();
      }
      hessian += k * along;
      is_active = true;
    }
    if (!is_active || !at.is_there) continue;
    hessian = at.to_frame.transpose() * hessian * at.to_frame;
    active_.add(p.cell, p.weights, hessian);
    if (at.cell >= 0) couplings_.push_back({p.cell, at.cell, p.weights, at.weights, hessian});
  }
  std::vector<const Coupling*> by_other;
  for (const Coupling& c : couplings_) by_other.push_back(&c);
  std::stable_sort(by_other.begin(), by_other.end(), [](const Coupling* a, const Coupling* b) { return a->b < b->b; });
  for (const Coupling* c : by_other) other_active_.add(c->b, c->of_b, c->hessian);
}

void PenaltyContact::add_cell_hessian(std::size_t cell, CellMatrix& h) const {
  active_.add_cell_hessian(cell, h);
  other_active_.add_cell_hessian(cell, h);
}

std::int32_t PenaltyContact::shared_hessian(std::size_t cell) const {
  const std::int32_t of_points = active_.shared_hessian(cell);
  return of_points == Term::no_hessian ? other_active_.shared_hessian(cell) : of_points;
}

std::size_t PenaltyContact::bytes() const {
  return hexmesh::bytes_of(points_) + hexmesh::bytes_of(held_off_) + hexmesh::bytes_of(kept_held_off_) +
         hexmesh::bytes_of(frictions_) + active_.bytes() + other_active_.bytes() + hexmesh::bytes_of(couplings_) +
         (other_ ? other_->map.bytes() + other_->distance.bytes() : 0);
}

double PenaltyContact::attach(const NodeVector& u) {
  double changed = 0, all = 0;
  if (is_attached()) remember_cells(u);
  for (std::size_t p = 0; is_attached() && p < points_.size(); ++p) {
    const At at = locate(points_[p], u);
    const hexmesh::Gap g = gap(points_[p], at);
    const double pressing = press(p, g.depth);
    if (is_solved_ && !held_off_.empty()) held_off_[p] = pressing;
    if (!has_friction()) continue;
    Friction& f = frictions_[p];
    const double most = contact_.friction * std::max(pressing, 0.0);
    changed += std::abs(most - f.most);
    all += most;
    f.most = most;
    if (most > 0) f.normal = g.normal.normalized();
  }
  is_solved_ = true;
  return changed == 0 ? 0 : changed / all;
}

void PenaltyContact::forget(const NodeVector& u) {
  for (std::size_t p = 0; p < frictions_.size(); ++p) {
    const At at = locate(points_[p], u);
    frictions_[p] = {at.place, Vec3::Zero(), Vec3::Zero(), 0, false, at.is_there};
  }
}

double PenaltyContact::keep(const NodeVector& u) {
  double work = 0;
  kept_held_off_ = held_off_;
  for (std::size_t p = 0; p < frictions_.size(); ++p) {
    const At at = locate(points_[p], u);
    const Drawn d = drawn(p, at);
    Friction& f = frictions_[p];
    const double held = d.force / stiffness(p);
    if (d.slips) work += d.force * (d.length - held);
    f.spring = d.length == 0 ? Vec3(Vec3::Zero()) : Vec3(held / d.length * d.by);
    f.begin = at.place;
    f.began = at.is_there;
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
  if (other_) return std::min(most, part_of_thickness * other_->distance.thickness() / std::max(displaced, 1e-9));
  if (is_boundless()) return contact_.turn ? std::min(most, 1.0 / 8) : most;
  const double turned = contact_.turn ? std::abs(contact_.turn->radians) : 0;
  const double moved =
      contact_.by.norm() + (turned > 0 ? turned * hexmesh::reach_of(contact_.obstacle, contact_.turn->about) : 0);
  const double step = part_of_thickness * hexmesh::thickness_of(contact_.obstacle);
  return moved > step ? std::min(most, step / moved) : most;
}

void PenaltyContact::add_pressed(const NodeVector& u, std::vector<Pressed>& of_cells) const {
  const auto add = [&](std::int32_t cell, double force, const Point& p) {
    Pressed& pressed = of_cells[hexmesh::as_size(cell)];
    pressed.force += force;
    pressed.area += p.area.norm();
  };
  for (std::size_t n = 0; n < points_.size(); ++n) {
    const Point& p = points_[n];
    const At at = locate(p, u);
    const hexmesh::Gap g = gap(p, at);
    const double pressing = press(n, g.depth);
    if (pressing == 0) continue;
    const double force = pressing * (at.to_frame.transpose() * g.normal).norm();
    add(p.cell, force, p);
    if (at.cell >= 0) add(at.cell, force, p);
  }
}

double PenaltyContact::work_of_motion(const NodeVector& u, const Progress& begin, const Progress& end) const {
  const bool is_still = !contact_.turn && !contact_.history && contact_.by.isZero(0);
  if (is_still) return 0;
  const Place from = place_of(contact_, begin), moved = place_of(contact_, end) * from.inverse();
  const bool is_at_begin = place_.isApprox(from, 0);
  double work = 0;
  for (std::size_t p = 0; p < points_.size(); ++p) {
    const At at = locate(points_[p], u);
    const Vec3 x = now(points_[p], u);
    const Vec3 force = at.to_frame.transpose() * force_at(p, at);
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
  if (other_) return {};
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
  for (std::size_t n = 0; n < points_.size(); ++n) {
    const Point& p = points_[n];
    const At at = locate(p, u, place);
    if (!at.is_there) continue;
    const hexmesh::Gap g = gap(p, at);
    const Vec3 across = at.to_frame.transpose() * g.normal;
    const double depth = other_ && g.depth != 0 ? g.depth / std::max(across.norm(), 1e-9) : g.depth;  // in space
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
  if (!deepest) return s;
  s.nearest = least;
  // The surface point that is deepest faces the obstacle, unless that is behind the surface.
  if (!is_boundless()) s.is_inside = normal.dot(outward(*deepest, u)) > 0;
  return s;
}

}  // namespace hexsolver
