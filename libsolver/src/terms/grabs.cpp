// SPDX-License-Identifier: Apache-2.0
#include "terms/grabs.h"

#include <algorithm>

#include "hexmesh/core/bytes.h"

namespace hexsolver {

void Grabs::grasp(std::size_t hand, const std::vector<SurfacePoint>& points, double stiffness, const NodeVector& u) {
  Hand& of = hands_[hand];
  for (const SurfacePoint& p : points)
    of.points.push_back(
        {p.cell, p.weights, stiffness / static_cast<double>(points.size()), mesh_.interpolate(p.cell, p.weights, u)});
  set_hessians();
}

void Grabs::let_go(std::size_t hand) {
  hands_.erase(hand);
  set_hessians();
}

void Grabs::let_go() {
  hands_.clear();
  set_hessians();
}

void Grabs::set_hessians() {
  hessians_.clear();
  for (const auto& [number, hand] : hands_)
    for (const Point& p : hand.points) hessians_.add(p.cell, p.weights, p.stiffness * Mat3::Identity());
}

void Grabs::begin_step(double begin, double end) {
  for (auto& [number, hand] : hands_) {
    hand.from = hand.to;
    const Vec3 way = hand.asked - hand.from;
    hand.to += way * std::min(1.0, most_per_step_ / std::max(way.norm(), most_per_step_));
  }
  begin_ = begin;
  end_ = end;
  time_ = begin;
}

void Grabs::set_time(double time) { time_ = time; }

Vec3 Grabs::shift(const Hand& hand, double time) const {
  const double part = end_ > begin_ ? std::clamp((time - begin_) / (end_ - begin_), 0.0, 1.0) : 1;
  return hand.from + part * (hand.to - hand.from);
}

double Grabs::energy(const NodeVector& u) const {
  double sum = 0;
  for (const auto& [number, hand] : hands_)
    for (const Point& p : hand.points) sum += p.stiffness / 2 * stretch(p, shift(hand, time_), u).squaredNorm();
  return sum;
}

double Grabs::work_of_motion(const NodeVector& u, double begin, double end) const {
  double work = 0;
  for (const auto& [number, hand] : hands_) {
    const Vec3 way = shift(hand, end) - shift(hand, begin);
    for (const Point& p : hand.points) work -= p.stiffness * stretch(p, shift(hand, time_), u).dot(way);
  }
  return work;
}

void Grabs::add_gradient(const NodeVector& u, NodeVector& gradient, NodeVector& magnitude) const {
  for (const auto& [number, hand] : hands_) {
    for (const Point& p : hand.points) {
      const CellVector force = spread_to_nodes(p.weights, p.stiffness * stretch(p, shift(hand, time_), u));
      mesh_.scatter_add(static_cast<std::size_t>(p.cell), force, gradient);
      mesh_.scatter_add(static_cast<std::size_t>(p.cell), force.cwiseAbs(), magnitude);
    }
  }
}

std::size_t Grabs::bytes() const {
  std::size_t sum = hessians_.bytes();
  for (const auto& [number, hand] : hands_) sum += hexmesh::bytes_of(hand.points);
  return sum;
}

}  // namespace hexsolver
