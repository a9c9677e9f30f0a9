// SPDX-License-Identifier: Apache-2.0
#include "terms/contact.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "hexmesh/core/bytes.h"

namespace hexsolver {
namespace {

constexpr double touching = 1e-6;  // mm: what is so near is about to press

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
    : contact_(contact), mesh_(mesh), active_(mesh), other_(std::move(other)) {
  for (std::size_t n = 0; n < points.size(); ++n) {
    const SurfacePoint& p = points[n];
    points_.push_back({p.cell, p.weights, mesh.rest_position(p.cell, p.weights), p.area,
                       contact.stiffness > 0 ? contact.stiffness : stiffness_found(cells, p, other_.get())});
    if (!other_) continue;
    points_.back().outside = other_->outside[n];
    if (other_->is_self) continue;
    const double depth = other_->distance->gap(points_.back().rest).depth;
    points_.back().begin = other_->touching[n] ? depth : std::min(0.0, depth + other_->outside[n]);
    points_.back().is_bonded = other_->touching[n] && contact.adhesion;
  }
  if (is_hard) kept_held_off_.resize(points_.size());
  std::stable_sort(points_.begin(), points_.end(), [](const Point& a, const Point& b) { return a.cell < b.cell; });
  std::size_t num_cells = 0;
  for (std::size_t n = 0; n < points_.size(); ++n) num_cells += n == 0 || points_[n].cell != points_[n - 1].cell;
  active_.reserve(num_cells);
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
  stiffer_ = 1;
  is_solved_ = false;
  unsettle();
}

bool PenaltyContact::is_boundless() const { return other_ || std::holds_alternative<HalfSpace>(contact_.obstacle); }

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
  return (pressing * pressing - held_off * held_off) / (2 * stiffness_across(p));
}

double PenaltyContact::energy(const NodeVector& u) const {
  const std::vector<Located>& all = locate_all(u);
  double sum = 0;
  for (std::size_t p = 0; p < points_.size(); ++p) {
    const auto& [at, gap] = all[p];
    const double pressing = press(p, gap.depth), k = stiffness(p);
    sum += energy_of(p, pressing);
    if (!has_friction()) continue;
    const Drawn d = drawn(p, at);
    sum += d.slips ? d.force * (d.length - d.force / (2 * k)) : d.force * d.length / 2;
  }
  return sum;
}

double PenaltyContact::stored_energy(const NodeVector& u) const {
  const std::vector<Located>& all = locate_all(u);
  double sum = 0;
  for (std::size_t p = 0; p < points_.size(); ++p) {
    const auto& [at, gap] = all[p];
    sum += energy_of(p, press(p, gap.depth));
    if (has_friction()) sum += std::pow(drawn(p, at).force, 2) / (2 * stiffness(p));
  }
  return sum;
}

Vec3 PenaltyContact::force_at(std::size_t p, const Located& located) const {
  const auto& [at, gap] = located;
  const double pressing = press(p, gap.depth);
  Vec3 force = pressing == 0 ? Vec3(Vec3::Zero()) : Vec3(pressing * gap.normal);
  if (has_friction()) force += force_of(drawn(p, at));
  return force;
}

void PenaltyContact::add_gradient(const NodeVector& u, NodeVector& gradient, NodeVector& magnitude) const {
  const auto scatter = [&](std::int32_t cell, const NodeWeights& weights, const Vec3& force) {
    const CellVector by = spread_to_nodes(weights, force);
    mesh_.scatter_add(static_cast<std::size_t>(cell), by, gradient);
    mesh_.scatter_add(static_cast<std::size_t>(cell), by.cwiseAbs(), magnitude);
  };
  const std::vector<Located>& all = locate_all(u);
  for (std::size_t n = 0; n < points_.size(); ++n) {
    const Point& p = points_[n];
    const At& at = all[n].at;
    Vec3 force = force_at(n, all[n]);
    if (force.isZero(0)) continue;
    force = at.to_frame.transpose() * force;
    scatter(p.cell, p.weights, -force);
    if (at.cell >= 0) scatter(at.cell, at.weights, force);
  }
}

void PenaltyContact::linearize(const NodeVector& u, double projection) {
  active_.clear();
  couplings_.clear();
  turnings_.clear();
  remember_cells(u);
  const std::vector<Located>& all = locate_all(u);
  for (std::size_t n = 0; n < points_.size(); ++n) {
    const Point& p = points_[n];
    const auto& [at, g] = all[n];
    const double k = stiffness(n);
    Mat3 hessian = Mat3::Zero();  // in the frame
    bool is_active = false;
    if (const double pressing = press(n, g.depth); pressing != 0 || g.depth < touching) {
      // Across the normal of a ball the curvature is negative: a point deep inside slips off to any side.
      hessian = stiffness_across(n) * g.normal * g.normal.transpose() -
                (1 - std::min(projection, Hessian::projected)) * pressing * g.bending;
      is_active = true;
    }
    if (has_friction() && frictions_[n].most > 0 && frictions_[n].began) {
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
    if (const double part = 1 - std::min(projection, Hessian::projected); other_ && !goes_straight() && part > 0) {
      const Vec3 slope = -part * (at.to_frame.transpose() * force_at(n, all[n]));
      if (!slope.isZero(0)) {
        const BodyMap::Bending bending = other_->map.bending(at.cell, at.local, u, slope);
        hessian -= bending.second;
        turnings_.push_back({p.cell, at.cell, p.weights, at.weights, slope, bending.gradients});
      }
    }
    hessian = at.to_frame.transpose() * hessian * at.to_frame;
    active_.add(p.cell, p.weights, hessian);
    if (at.cell < 0) continue;
    active_.add(at.cell, at.weights, hessian);
    couplings_.add(p.cell, at.cell, p.weights, at.weights, hessian);
  }
}

template <class Vector>
void PenaltyContact::add_turning_product(const Vector& x, Vector& y) const {
  using Real = typename Vector::Scalar;
  for (const Turning& t : turnings_) {
    const auto cell = static_cast<std::size_t>(t.cell), other = static_cast<std::size_t>(t.of_other);
    const Vec3 r = mesh_.interpolate(t.cell, t.weights, x) - mesh_.interpolate(t.of_other, t.other_weights, x);
    const CellVector of_other = mesh_.gather(other, x).template cast<double>();
    Vec3 turned = Vec3::Zero();
    for (int b = 0; b < 8; ++b) turned += t.m.dot(of_other.segment<3>(3 * b)) * t.g.row(b).transpose();
    CellVector back = spread_to_nodes(t.other_weights, turned);
    for (int b = 0; b < 8; ++b) back.segment<3>(3 * b) -= t.g.row(b).dot(r) * t.m;
    mesh_.scatter_add(cell, (-spread_to_nodes(t.weights, turned)).template cast<Real>().eval(), y);
    mesh_.scatter_add(other, back.template cast<Real>().eval(), y);
  }
}
template void PenaltyContact::add_turning_product(const NodeVector&, NodeVector&) const;
template void PenaltyContact::add_turning_product(const FloatNodeVector&, FloatNodeVector&) const;

void PenaltyContact::add_cell_hessian(std::size_t cell, CellMatrix& h) const { active_.add_cell_hessian(cell, h); }

std::int32_t PenaltyContact::shared_hessian(std::size_t cell) const { return active_.shared_hessian(cell); }

std::size_t PenaltyContact::bytes() const {
  std::size_t sum = hexmesh::bytes_of(points_) + hexmesh::bytes_of(held_off_) + hexmesh::bytes_of(kept_held_off_) +
                    hexmesh::bytes_of(frictions_) + hexmesh::bytes_of(kept_frictions_) + active_.bytes() +
                    couplings_.bytes() + hexmesh::bytes_of(turnings_);
  for (const Places* places : std::initializer_list<const Places*>{&seen_, &held_, &found_})
    sum += hexmesh::bytes_of(places->all) + static_cast<std::size_t>(places->at.size()) * sizeof(double);
  return sum + (other_ ? other_->map.bytes() + other_->distance->bytes() + hexmesh::bytes_of(other_->surface) : 0);
}

double PenaltyContact::attach(const NodeVector& u, double learns, double stiffer) {
  double changed = 0, in_all = 0;
  if (!is_attached() && !other_) return 0;
  unsettle();
  const bool is_begin = !std::exchange(is_solved_, true);
  if (is_begin && holds_pairs_ && has_friction()) frictions_ = kept_frictions_;  // of a step that failed
  std::vector<Located> held;
  if (holds()) {
    held = locate_all(u);
    seen_.forget();
  }
  remember_cells(u);
  const std::vector<Located>& all = locate_all(u);
  if (other_ && (holds_pairs_ || is_begin)) {
    seen_ = {all, u};
    held_.forget();
  }
  for (std::size_t p = 0; p < points_.size(); ++p) {
    const hexmesh::Gap& g = all[p].gap;
    const double pressing = press(p, g.depth);
    if (holds_pairs_) {
      in_all += std::abs(pressing);
      if (!held.empty()) changed += std::abs(pressing - press(p, held[p].gap.depth));
    }
    if (!is_begin && !held_off_.empty()) held_off_[p] += learns * (pressing - held_off_[p]);
    if (!has_friction()) continue;
    if (holds_pairs_) hold_friction(p, all[p], is_begin || held.empty() ? nullptr : &held[p]);
    Friction& f = frictions_[p];
    const double most = contact_.friction * std::max(pressing, 0.0);
    changed += std::abs(most - f.most);
    in_all += most;
    f.most = most;
    if (most > 0) f.normal = g.normal.normalized();
  }
  stiffer_ = held_off_.empty() ? 1 : stiffer;
  return changed == 0 ? 0 : changed / in_all;
}

/// Of a point whose place in another segment is found anew, at a step's begin or where one was held: its spring goes on
/// unless that is another part of the segment.
void PenaltyContact::hold_friction(std::size_t p, const Located& found, const Located* held) {
  Friction& f = frictions_[p];
  const Vec3& before = held ? held->at.place : f.begin;
  const bool goes_on = f.began && found.at.is_there && (!held || held->at.is_there) &&
                       (found.at.place - before).norm() <= other_->deepest_at_once;
  if (!goes_on) f.spring.setZero();
  f.began = held ? goes_on : found.at.is_there;
  if (!held) f.begin = found.at.place;
}

void PenaltyContact::forget(const NodeVector& u) {
  seen_.forget();
  if (!has_friction()) return;
  const std::vector<Located>& all = locate_all(u);
  for (std::size_t p = 0; p < frictions_.size(); ++p) {
    const At& at = all[p].at;
    frictions_[p] = {at.place, Vec3::Zero(), Vec3::Zero(), 0, false, at.is_there};
  }
  if (holds_pairs_) kept_frictions_ = frictions_;
}

double PenaltyContact::keep(const NodeVector& u) {
  double work = 0;
  kept_held_off_ = held_off_;
  if (!has_friction()) return 0;
  const std::vector<Located>& all = locate_all(u);
  for (std::size_t p = 0; p < frictions_.size(); ++p) {
    const At& at = all[p].at;
    const Drawn d = drawn(p, at);
    Friction& f = frictions_[p];
    const double held = d.force / stiffness(p);
    if (d.slips) work += d.force * (d.length - held);
    f.spring = d.length == 0 ? Vec3(Vec3::Zero()) : Vec3(held / d.length * d.by);
    f.begin = at.place;
    f.began = at.is_there;
    f.slipped = d.slips;
  }
  if (holds_pairs_) kept_frictions_ = frictions_;
  return work;
}

}  // namespace hexsolver
