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
  const BodyMap::Own own{p.cell, p.rest, other_->is_self};
  const BodyMap::Place there = other_->map.find(
      x, u, p.near, &own, [&](const BodyMap::Place& at) { return other_->distance->gap(at.rest).depth; });
  if (there.cell < 0)
    return {{{}, Mat3::Zero(), false}, {std::numeric_limits<double>::infinity(), Vec3::Zero(), Mat3::Zero()}};
  return located_at(p, there);
}

PenaltyContact::Located PenaltyContact::located_at(const Point& p, const BodyMap::Place& there) const {
  Located out{{there.rest, there.to_rest, true, there.cell, there.weights, there.local},
              other_->distance->gap(there.rest)};
  out.gap.depth += p.outside - p.begin;
  return out;
}

PenaltyContact::Located PenaltyContact::locate_held(const Point& p, const Located& pair, const NodeVector& u) const {
  if (!pair.at.is_there) return pair;
  if (!goes_straight())
    if (const BodyMap::Place there = other_->map.place_in(now(p, u), u, {pair.at.cell, pair.at.local}); there.cell >= 0)
      return located_at(p, there);
  Located out = pair;
  const Vec3 other = pair.at.place + mesh_.interpolate(pair.at.cell, pair.at.weights, u);
  out.at.place += pair.at.to_frame * (now(p, u) - other);
  out.gap = other_->distance->gap(out.at.place);
  out.gap.depth += p.outside - p.begin;
  return out;
}

const std::vector<PenaltyContact::Located>& PenaltyContact::find_all(const NodeVector& u) const {
  if (other_ && found_.is_of(u)) return found_.all;
  if (other_) other_->map.look_at(u);
  found_.all.resize(points_.size());
#pragma omp parallel for schedule(static) if (points_.size() >= worth_a_team)
  for (std::size_t p = 0; p < points_.size(); ++p) found_.all[p] = locate(points_[p], u);
  if (other_) found_.at = u;
  return found_.all;
}

const std::vector<PenaltyContact::Located>& PenaltyContact::locate_all(const NodeVector& u) const {
  if (!holds()) return find_all(u);
  if (held_.is_of(u)) return held_.all;
  held_.all.resize(points_.size());
#pragma omp parallel for schedule(static) if (points_.size() >= worth_a_team)
  for (std::size_t p = 0; p < points_.size(); ++p) held_.all[p] = locate_held(points_[p], pairs()[p], u);
  held_.at = u;
  return held_.all;
}

void PenaltyContact::hold_pairs() { holds_pairs_ = other_ != nullptr; }

bool PenaltyContact::settle(const NodeVector& u) {
  if (gradient_jump(u) == 0) return false;
  settled_ = find_all(u);
  held_.forget();
  return true;
}

void PenaltyContact::unsettle() {
  if (settled_.empty()) return;
  settled_.clear();
  held_.forget();
}

void PenaltyContact::remember_cells(const NodeVector& u) {
  if (!other_ || holds()) return;
  const std::vector<Located>& all = locate_all(u);
  for (std::size_t p = 0; p < points_.size(); ++p) points_[p].near = {all[p].at.cell, all[p].at.local};
}

double PenaltyContact::looks_along(const NodeVector& from, const NodeVector& to) const {
  Eigen::AlignedBox3d moves;
  const auto extend_by = [&](const auto& p) {
    moves.extend(Vec3(mesh_.interpolate(p.cell, p.weights, to) - mesh_.interpolate(p.cell, p.weights, from)));
  };
  std::for_each(points_.begin(), points_.end(), extend_by);
  std::for_each(other_->surface.begin(), other_->surface.end(), extend_by);
  return std::max(1.0, std::ceil(moves.diagonal().norm() / other_->deepest_at_once));
}

template <class F>
double PenaltyContact::look_ahead(const NodeVector& from, const NodeVector& to, const F& f) const {
  constexpr double most_looks = 256;
  const double looks = looks_along(from, to);
  bool goes_on = true;
  for (double look = 1; goes_on && look <= std::min(looks, most_looks); ++look) {
    const double part = look / looks;
    goes_on = f(part, find_all(part == 1 ? to : (1 - part) * from + part * to));
  }
  return std::min(1.0, most_looks / looks);
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
  return holds() ? part : part_before_touch(u, step, part);
}

double PenaltyContact::part_before_touch(const NodeVector& u, const NodeVector& step, double most) const {
  const NodeVector end = u + most * step;
  if (looks_along(u, end) <= 1) return most;  // what is nowhere near is farther off
  const std::vector<Located> before = locate_all(u);
  double until = 1;
  look_ahead(u, end, [&](double part, const std::vector<Located>& then) {
    for (std::size_t p = 0; p < points_.size(); ++p)
      if (!before[p].at.is_there && then[p].at.is_there && then[p].gap.depth < 0) until = part;
    return until == 1;
  });
  return most * until;  // of a way too long to look along passes_through() tells
}

double PenaltyContact::gradient_jump(const NodeVector& u) const {
  if (!other_ || holds()) return 0;
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

/// Along looks after each other.
class PenaltyContact::Way {
public:
  /// @param outside  see Point
  Way(const OtherSegment& other, double outside, const Located& begin) : other_(other), outside_(outside) {
    begin_at(begin);
  }

  /// Whether the point, which is in `then` now, went through: it is deep inside; or its nearest surface is another than
  /// where it entered, be it from one look to the next.
  bool goes_through(Located then) {
    constexpr double other_way = -0.5, another_way = 0.5;  // cosines
    if (!then.at.is_there) return false;
    then.gap.depth -= outside_;  // of the voxels themselves
    const double at_once = other_.deepest_at_once, deep = at_once / 2;
    if (then.gap.depth < -2 * at_once) return true;
    const bool goes_on = last_.at.is_there && (then.at.place - last_.at.place).norm() <= 4 * at_once;
    if (!goes_on) {
      begin_at(then);
      return false;
    }
    deepest_ = std::min(deepest_, then.gap.depth);
    const double turned = normal_.dot(then.gap.normal) / (normal_.norm() * then.gap.normal.norm());
    if (turned < another_way && deepest_ < -deep) return true;
    if (turned < other_way && other_.distance->gap((last_.at.place + then.at.place) / 2).depth < 0) return true;
    if (then.gap.depth >= -deep)
      begin_at(then);
    else
      last_ = then;
    return false;
  }

private:
  void begin_at(const Located& located) {
    last_ = located;
    normal_ = located.gap.normal;
    deepest_ = 0;
  }

  const OtherSegment& other_;
  double outside_;
  Located last_;
  Vec3 normal_;         ///< where it was less than half a step deep last
  double deepest_ = 0;  ///< since then [mm]
};

bool PenaltyContact::passes_through(const NodeVector& u) const {
  if (seen_.all.empty() || seen_.at == u) return false;
  std::vector<Way> ways;
  bool passes = false;
  for (std::size_t p = 0; p < points_.size(); ++p) {
    ways.emplace_back(*other_, points_[p].outside, seen_.all[p]);
    passes = passes || ways.back().goes_through(seen_.all[p]);
  }
  const double looked = look_ahead(seen_.at, u, [&](double /*part*/, const std::vector<Located>& then) {
    for (std::size_t p = 0; p < points_.size() && !passes; ++p) passes = ways[p].goes_through(then[p]);
    return !passes;
  });
  return passes || looked < 1;
}

}  // namespace hexsolver
