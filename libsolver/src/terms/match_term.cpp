// SPDX-License-Identifier: Apache-2.0
#include "terms/match_term.h"

#include <fmt/format.h>

#include <algorithm>

#include "hexmesh/core/bytes.h"
#include "hexmesh/core/error.h"
#include "hexmesh/lattice/locator.h"

namespace hexsolver {

MatchTerm::MatchTerm(std::string name, std::shared_ptr<const Matching> matching, const Mesh& mesh,
                     const std::vector<SurfacePoint>& points, const Eigen::Isometry3d& pose)
    : name_(std::move(name)), matching_(std::move(matching)), mesh_(mesh), pose_(pose), hessians_(mesh) {
  for (std::size_t n = 0; n < points.size(); ++n) points_.push_back({points[n].cell, points[n].weights, n});
  std::stable_sort(points_.begin(), points_.end(), [](const Point& a, const Point& b) { return a.cell < b.cell; });
}

std::vector<Vec3> MatchTerm::places(const NodeVector& u) const {
  std::vector<Vec3> out(points_.size());
  for (const Point& p : points_)
    out[p.number] = matching_->points()[p.number] + mesh_.interpolate(p.cell, p.weights, u);
  return out;
}

void MatchTerm::attach(const NodeVector& u, double caution, const std::vector<bool>& folding) {
  attached_at_ = places(u);
  matching_->pull(attached_at_, pose_, pull_);
  part_of_.resize(points_.size(), 1);
  for (const Point& p : points_)
    if (!folding.empty() && folding[static_cast<std::size_t>(p.cell)]) part_of_[p.number] /= 2;
  for (std::size_t n = 0; n < pull_.hessian.size(); ++n) {
    pull_.hessian[n] += caution * (pull_.bound[n] * Mat3::Identity() - pull_.hessian[n]);
    pull_.hessian[n] *= part_of_[n];
    pull_.gradient[n] *= part_of_[n];
  }
  set_hessians();
}

void MatchTerm::set_progress(const Progress& progress) {
  part_ = progress.fraction;
  set_hessians();
}

void MatchTerm::set_hessians() {
  hessians_.clear();
  if (attached_at_.empty()) return;
  for (const Point& p : points_)
    if (pull_.hessian[p.number] != Mat3::Zero()) hessians_.add(p.cell, p.weights, part_ * pull_.hessian[p.number]);
}

double MatchTerm::energy(const NodeVector& u) const {
  if (attached_at_.empty()) return 0;
  const std::vector<Vec3> now = places(u);
  double sum = pull_.energy;
  for (std::size_t n = 0; n < now.size(); ++n) {
    const Vec3 moved = now[n] - attached_at_[n];
    sum += moved.dot(pull_.gradient[n] + pull_.hessian[n] * moved / 2);
  }
  return part_ * sum;
}

void MatchTerm::add_gradient(const NodeVector& u, NodeVector& gradient, NodeVector& magnitude) const {
  if (attached_at_.empty()) return;
  const std::vector<Vec3> now = places(u);
  for (const Point& p : points_) {
    const std::size_t n = p.number;
    if (pull_.gradient[n] == Vec3::Zero() && pull_.hessian[n] == Mat3::Zero()) continue;
    const Vec3 pulled = part_ * (pull_.gradient[n] + pull_.hessian[n] * (now[n] - attached_at_[n]));
    const CellVector force = spread_to_nodes(p.weights, pulled);
    mesh_.scatter_add(p.cell, force, gradient);
    mesh_.scatter_add(p.cell, force.cwiseAbs(), magnitude);
  }
}

std::size_t MatchTerm::bytes() const {
  return hexmesh::bytes_of(points_) + hessians_.bytes() + hexmesh::bytes_of(attached_at_) +
         hexmesh::bytes_of(pull_.bound) + hexmesh::bytes_of(part_of_) + hexmesh::bytes_of(pull_.gradient) +
         hexmesh::bytes_of(pull_.hessian);
}

MatchedPoints embed(const Matchings& matchings, Selector& selector) {
  MatchedPoints out;
  for (const auto& matching : matchings) out.push_back(selector.embed(matching->points()));
  return out;
}

std::vector<std::unique_ptr<MatchTerm>> make_match_terms(const Scene& scene, const Matchings& matchings,
                                                         const Mesh& mesh, const MatchedPoints& points) {
  std::vector<std::unique_ptr<MatchTerm>> out;
  for (std::size_t n = 0; n < matchings.size(); ++n) {
    const Match& match = scene.matches[n];
    for (std::size_t p = 0; p < points[n].size(); ++p)
      if (points[n][p].cell < 0) {
        const Vec3& at = matchings[n]->points()[p];
        throw hexmesh::Error(
            hexmesh::ErrorKind::geometry,
            fmt::format("{}: its point [{:.1f}, {:.1f}, {:.1f}] is in no cell, expected at most {:g} mm from the body",
                        with_place("match", match), at[0], at[1], at[2], hexmesh::embedding_reach));
      }
    out.push_back(std::make_unique<MatchTerm>(match_name(match), matchings[n], mesh, points[n],
                                              scene.pose.value_or(Eigen::Isometry3d::Identity())));
  }
  return out;
}

MatchReport MatchTerm::report(const NodeVector& u) const {
  MatchReport out = matching_->distances(places(u));
  out.eased_points =
      static_cast<std::size_t>(std::count_if(part_of_.begin(), part_of_.end(), [](double p) { return p < 1; }));
  return out;
}

}  // namespace hexsolver
