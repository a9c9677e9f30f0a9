// SPDX-License-Identifier: Apache-2.0
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "terms/contact.h"

// Where points are in an obstacle's frame, or in another segment, and how far they may come.

namespace hexsolver {
namespace {

constexpr std::size_t worth_a_team = 500;  // points

}  // namespace

PenaltyContact::Located PenaltyContact::locate(const Point& p, const NodeVector& u, const Place& place) const {
  const Vec3 x = now(p, u);
  if (!other_) {
    const Vec3 in_frame = place.inverse() * x;
    return {{in_frame, place.linear().transpose()}, hexmesh::gap_to(contact_.obstacle, in_frame)};
  }
  const BodyMap::Place there =
      other_->is_self ? other_->map.find_elsewhere(x, u, p.near, {p.cell, p.rest}) : other_->map.find(x, u, p.near);
  if (there.cell < 0)
    return {{{}, Mat3::Zero(), false}, {std::numeric_limits<double>::infinity(), Vec3::Zero(), Mat3::Zero()}};
  Located out{{there.rest, there.to_rest, true, there.cell, there.weights, there.local},
              other_->distance.gap(there.rest)};
  out.gap.depth -= p.begin;
  return out;
}

PenaltyContact::Located PenaltyContact::locate_held(const Point& p, const Located& pair, const NodeVector& u) const {
  if (!pair.at.is_there) return pair;
  Located out = pair;
  const Vec3 other = pair.at.place + mesh_.interpolate(pair.at.cell, pair.at.weights, u);
  out.at.place += pair.at.to_frame * (now(p, u) - other);
  out.gap = other_->distance.gap(out.at.place);
  out.gap.depth -= p.begin;
  return out;
}

void PenaltyContact::find_all(const NodeVector& u, std::vector<Located>& all) const {
  all.resize(points_.size());
  if (other_ && other_->is_self) other_->map.look_at(u);
#pragma omp parallel for schedule(static) if (points_.size() >= worth_a_team)
  for (std::size_t p = 0; p < points_.size(); ++p) all[p] = locate(points_[p], u);
}

const std::vector<PenaltyContact::Located>& PenaltyContact::locate_all(const NodeVector& u) const {
  if (other_ && located_at_.size() == u.size() && located_at_ == u) return located_;
  if (pairs_.empty()) {
    find_all(u, located_);
  } else {
    located_.resize(points_.size());
#pragma omp parallel for schedule(static) if (points_.size() >= worth_a_team)
    for (std::size_t p = 0; p < points_.size(); ++p) located_[p] = locate_held(points_[p], pairs_[p], u);
  }
  if (other_) located_at_ = u;
  return located_;
}

void PenaltyContact::hold_pairs() { holds_pairs_ = other_ != nullptr; }

void PenaltyContact::remember_cells(const NodeVector& u) {
  if (!other_ || !pairs_.empty()) return;
  const auto remember = [&] {
    const std::vector<Located>& all = locate_all(u);
    for (std::size_t p = 0; p < points_.size(); ++p) points_[p].near = {all[p].at.cell, all[p].at.local};
  };
  remember();
  if (other_->is_self || std::none_of(points_.begin(), points_.end(), [](const Point& p) { return p.near.cell < 0; }))
    return;
  other_->map.look_at(u);
  located_at_.resize(0);
  remember();
}

template <class F>
void PenaltyContact::look_ahead(const NodeVector& u, const NodeVector& step, double most, const F& f) const {
  constexpr int most_looks = 256;
  Eigen::AlignedBox3d moves;
  for (const Point& p : points_) moves.extend(mesh_.interpolate(p.cell, p.weights, step));
  const double apart = most * moves.diagonal().norm();
  const int looks =
      std::max(1, static_cast<int>(std::min(std::ceil(apart / other_->deepest_at_once), double(most_looks))));
  std::vector<Located> then;
  bool goes_on = true;
  for (int look = 1; goes_on && look <= looks; ++look) {
    const double part = most * look / looks;
    find_all(u + part * step, then);
    goes_on = f(part, then);
  }
}

/// Of points near another segment: they come no deeper into it, at a time, than a quarter of its thickness and two
/// voxels.
double PenaltyContact::longest_step(const NodeVector& u, const NodeVector& step) const {
  if (!other_) return 1;
  const std::vector<Located>& all = locate_all(u);
  double part = 1;
  for (std::size_t p = 0; p < points_.size(); ++p) {
    const auto& [at, gap] = all[p];
    if (!at.is_there) continue;
    const Vec3 by = at.to_frame * (mesh_.interpolate(points_[p].cell, points_[p].weights, step) -
                                   mesh_.interpolate(at.cell, at.weights, step));
    if (const double approach = -gap.normal.dot(by); approach > 0)
      part = std::min(part, (std::max(gap.depth, 0.0) + other_->deepest_at_once) / approach);
  }
  return other_->is_self && pairs_.empty() ? part_before_touch(u, step, part) : part;
}

double PenaltyContact::part_before_touch(const NodeVector& u, const NodeVector& step, double most) const {
  const std::vector<Located> before = locate_all(u);
  double until = most;
  look_ahead(u, step, most, [&](double part, const std::vector<Located>& then) {
    for (std::size_t p = 0; p < points_.size(); ++p)
      if (!before[p].at.is_there && then[p].at.is_there && then[p].gap.depth < 0) until = part;
    return until == most;
  });
  return until;
}

double PenaltyContact::gradient_jump(const NodeVector& u) const {
  if (!other_ || !pairs_.empty()) return 0;
  const std::vector<Located>& all = locate_all(u);
  constexpr double most_part = 1e-3;  // of the forces: what jumps by more is no solution
  double sum = 0, forces = 0;
  for (std::size_t p = 0; p < points_.size(); ++p) {
    const At& at = all[p].at;
    const Vec3 force = force_at(p, all[p]);
    if (force.isZero(0)) continue;
    forces += (at.to_frame.transpose() * force).norm();
    double most = 0;
    for (const Mat3& to_rest : other_->map.to_rest_beside(at.cell, at.local, u))
      most = std::max(most, ((to_rest - at.to_frame).transpose() * force).norm());
    sum += most * std::sqrt(points_[p].weights.squaredNorm() + at.weights.squaredNorm());
  }
  return std::min(sum, most_part * forces);
}

bool PenaltyContact::passes_through(const NodeVector& u) const {
  constexpr double other_way = -0.5;  // cosine
  const auto turns = [&](const Located& one, const Located& other) {
    return one.gap.normal.dot(other.gap.normal) < other_way * one.gap.normal.norm() * other.gap.normal.norm();
  };
  std::vector<Located> seen = pairs_;  // of each point, where it was there last
  bool passes = false;
  if (seen.empty()) return false;
  look_ahead(attached_at_, u - attached_at_, 1, [&](double /*part*/, const std::vector<Located>& then) {
    for (std::size_t p = 0; p < points_.size(); ++p) {
      if (!then[p].at.is_there) continue;
      if (seen[p].at.is_there)
        passes = passes || turns(seen[p], then[p]);
      else
        passes = passes || then[p].gap.depth < -2 * other_->deepest_at_once;
      seen[p] = then[p];
    }
    return !passes;
  });
  return passes;
}

}  // namespace hexsolver
