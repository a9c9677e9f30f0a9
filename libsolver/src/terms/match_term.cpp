// SPDX-License-Identifier: Apache-2.0
#include "terms/match_term.h"

#include <fmt/format.h>

#include <algorithm>

#include "hexmesh/core/bytes.h"
#include "hexmesh/core/error.h"
#include "hexmesh/lattice/locator.h"
#include "terms/cell_measures.h"

namespace hexsolver {

MatchTerm::MatchTerm(std::string name, std::shared_ptr<const Matching> matching, const Mesh& mesh,
                     const std::vector<SurfacePoint>& points, const Eigen::Isometry3d& pose, const SurfaceShare& share)
    : name_(std::move(name)),
      matching_(std::move(matching)),
      mesh_(mesh),
      pose_(pose),
      share_(share),
      is_first_(share.is_first(true)),
      hessians_(mesh) {
  for (std::size_t n = 0; n < points.size(); ++n)
    if (points[n].cell >= 0) points_.push_back({points[n].cell, points[n].weights, n});
  std::stable_sort(points_.begin(), points_.end(), [](const Point& a, const Point& b) { return a.cell < b.cell; });
}

std::vector<Vec3> MatchTerm::places(const NodeVector& u) const {
  std::vector<Vec3> out(matching_->points().size(), Vec3::Zero());
  for (const Point& p : points_)
    out[p.number] = matching_->points()[p.number] + mesh_.interpolate(p.cell, p.weights, u);
  share_.add_up(out);
  return out;
}

Vec3 MatchTerm::move_of(std::size_t point, const NodeVector& u) const {
  const Point& p = points_[point];
  return matching_->points()[p.number] + mesh_.interpolate(p.cell, p.weights, u) - attached_at_[p.number];
}

void MatchTerm::attach(const NodeVector& u, const PullMode& mode, const std::vector<bool>& folding) {
  attached_at_ = places(u);
  matching_->pull(attached_at_, pose_, mode.lets_go, pull_);
  part_of_.resize(attached_at_.size(), 1);
  for (const Point& p : points_)
    if (!folding.empty() && folding[static_cast<std::size_t>(p.cell)]) part_of_[p.number] /= 2;
  for (std::size_t n = 0; n < pull_.hessian.size(); ++n) {
    pull_.hessian[n] += mode.caution * (pull_.bound[n] * Mat3::Identity() - pull_.hessian[n]);
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
  double sum = is_first_ ? pull_.energy : 0;
  for (std::size_t p = 0; p < points_.size(); ++p) {
    const std::size_t n = points_[p].number;
    const Vec3 moved = move_of(p, u);
    sum += moved.dot(pull_.gradient[n] + pull_.hessian[n] * moved / 2);
  }
  return part_ * sum;
}

void MatchTerm::add_gradient(const NodeVector& u, NodeVector& gradient, NodeVector& magnitude) const {
  if (attached_at_.empty()) return;
  for (std::size_t at = 0; at < points_.size(); ++at) {
    const Point& p = points_[at];
    const std::size_t n = p.number;
    if (pull_.gradient[n] == Vec3::Zero() && pull_.hessian[n] == Mat3::Zero()) continue;
    const Vec3 pulled = part_ * (pull_.gradient[n] + pull_.hessian[n] * move_of(at, u));
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

void expect_embedded(const Scene& scene, const Matchings& matchings, const MatchedPoints& points) {
  for (std::size_t n = 0; n < matchings.size(); ++n)
    for (std::size_t p = 0; p < points[n].size(); ++p)
      if (points[n][p].cell < 0) {
        const Vec3& at = matchings[n]->points()[p];
        throw hexmesh::Error(
            hexmesh::ErrorKind::geometry,
            fmt::format("{}: its point [{:.1f}, {:.1f}, {:.1f}] is in no cell, expected at most {:g} mm from the body",
                        with_place("match", scene.matches[n]), at[0], at[1], at[2], hexmesh::embedding_reach));
      }
}

std::vector<std::unique_ptr<MatchTerm>> make_match_terms(const Scene& scene, const Matchings& matchings,
                                                         const Mesh& mesh, const MatchedPoints& points,
                                                         const SurfaceShare& share) {
  std::vector<std::unique_ptr<MatchTerm>> out;
  for (std::size_t n = 0; n < matchings.size(); ++n)
    out.push_back(std::make_unique<MatchTerm>(match_name(scene.matches[n]), matchings[n], mesh, points[n],
                                              scene.pose.value_or(Eigen::Isometry3d::Identity()), share));
  return out;
}

void attach(const std::vector<MatchTerm*>& matches, const ElasticCells& elastic, const NodeVector& u,
            const PullMode& mode, const std::function<void(std::vector<bool>&)>& share_nodes) {
  constexpr double nearly_flat = 0.1;
  const std::vector<bool> folding = cells_near_folds(elastic, u, nearly_flat, share_nodes);
  for (MatchTerm* m : matches) m->attach(u, mode, folding);
}

std::optional<std::string> why_missed(const std::vector<MatchTerm*>& matches, const NodeVector& u) {
  for (const MatchTerm* match : matches)
    if (auto why = match->why_missed(u)) return why;
  return {};
}

void report_matches(const std::vector<MatchTerm*>& matches, const NodeVector& start, const NodeVector& u,
                    SolveReport& report) {
  constexpr double little = 1e-3;
  report.matches.clear();
  for (const MatchTerm* match : matches) {
    MatchReport m = match->report(u);
    m.at_start = match->report(start).distance;
    if (m.left_out > little)
      report.warnings.push_back(
          fmt::format("match '{}': {:.2g} % of the surfaces stay far from each other beside the rest and are left out; "
                      "outliers_mm (--outliers) says what is far, 0: nothing",
                      m.name, 100 * m.left_out));
    report.matches.push_back(std::move(m));
  }
}

MatchReport MatchTerm::report(const NodeVector& u) const {
  MatchReport out = matching_->distances(places(u));
  const auto own = std::count_if(part_of_.begin(), part_of_.end(), [](double p) { return p < 1; });
  out.eased_points = static_cast<std::size_t>(share_.sum(static_cast<double>(own)));
  return out;
}

}  // namespace hexsolver
