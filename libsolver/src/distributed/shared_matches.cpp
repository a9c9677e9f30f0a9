// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <limits>

#include "distributed/shared_level.h"

namespace hexsolver::mpi {
namespace {

/// Of a point that no cell holds, from the one that it moves with [mm]; of one in none without end.
double distance_from_cell(const SurfacePoint& p, const Mat3& edges) {
  if (p.cell < 0) return std::numeric_limits<double>::infinity();
  const Vec3 local = hexmesh::local_position(p.weights);
  return (edges * (local - local.cwiseMax(0).cwiseMin(1))).norm();
}

/// A point of a matching that some process has in a cell.
struct MatchedPoint {
  std::size_t matching, number;
  SharedConstraints::Point at;
};

}  // namespace

void SharedLevel::add_matches() {
  matches_.clear();
  for (auto& match : make_match_terms(scene_, matchings_, mesh(), matched_, piece_->share())) {
    matches_.push_back(match.get());
    potential_->add(std::move(match));
  }
}

/// Points are embedded in the layers of the scan that each process has, and kept by the one in whose cells they are, or
/// which they are nearest to. They move with cells that some process, mostly another, has in its part.
std::vector<SharedConstraints::Point> SharedLevel::find_matched(Selector& selector) {
  std::vector<MatchedPoint> own;
  for (std::size_t m = 0; m < matchings_.size(); ++m) {
    const std::vector<SurfacePoint> found = selector.embed(matchings_[m]->points());
    std::vector<double> off, rank;
    for (const SurfacePoint& p : found) off.push_back(distance_from_cell(p, piece_->mesh().edges()));
    std::vector<double> least = off;
    all_.take_least(least);
    for (std::size_t n = 0; n < found.size(); ++n)
      rank.push_back(found[n].cell >= 0 && off[n] == least[n] ? all_.rank() : all_.count());
    std::vector<double> first = rank;
    all_.take_least(first);
    for (std::size_t n = 0; n < found.size(); ++n) {
      if (rank[n] != first[n] || found[n].cell < 0) continue;
      own.push_back({m, n, in_piece(found[n])});
    }
  }
  MatchedPoints anywhere;
  for (const auto& matching : matchings_) anywhere.emplace_back(matching->points().size());
  matched_ = anywhere;
  std::vector<SharedConstraints::Point> out;
  for (const MatchedPoint& p : all_.gather(own)) {
    anywhere[p.matching][p.number].cell = 0;
    matched_[p.matching][p.number] = {own_cell(p.at.cell), NodeWeights::Map(p.at.weights.data()), Vec3::Zero()};
    out.push_back(p.at);
    out.back().axes = {true, true, true};
  }
  expect_embedded(scene_, matchings_, anywhere);
  return out;
}

bool SharedLevel::attach_matches(Vec u, const PullMode& mode) {
  if (matches_.empty()) return false;
  copies_.get(u, x_);
  attach(matches_, *elastic_, x_, mode, [this](std::vector<bool>& nodes) {
    NodeVector flags = NodeVector::Zero(static_cast<Eigen::Index>(mesh().num_dofs()));
    for (std::size_t n = 0; n < mesh().num_nodes(); ++n) flags[3 * static_cast<Eigen::Index>(n)] = nodes[n];
    const OwnedVec shared = make_vector();
    copies_.raise_to(flags, shared);
    copies_.get(shared, flags);
    for (std::size_t n = 0; n < mesh().num_nodes(); ++n) nodes[n] = flags[3 * static_cast<Eigen::Index>(n)] > 0;
  });
  return true;
}

}  // namespace hexsolver::mpi
