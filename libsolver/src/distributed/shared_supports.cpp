// SPDX-License-Identifier: Apache-2.0
#include "distributed/shared_supports.h"

#include <algorithm>
#include <map>
#include <numeric>

#include "constraints/supports.h"

namespace hexsolver::mpi {
namespace {

/// The parts of the whole body, of cells joined through faces, as all processes know them: each by a name, a number
/// above zero.
class SharedParts {
public:
  explicit SharedParts(const SharedLevel& level);

  const std::vector<BodyPart>& parts() const noexcept { return parts_; }
  std::vector<Joint> joints() const;
  std::vector<HeldPoint> held(const std::vector<SharedConstraints::Point>& points) const;

private:
  /// What a process has to tell of a part.
  struct Share {
    double name = 0, value = 0;
    std::array<double, 3> sum{};
  };
  double& name_of(std::size_t cell) { return names_[static_cast<std::size_t>(part_of_cell_[cell])]; }
  double name_of(std::size_t cell) const { return names_[static_cast<std::size_t>(part_of_cell_[cell])]; }
  Vec3 center_of(std::size_t cell) const { return mesh_.position(mesh_.node(cell, 0)) + half_; }
  void tell_names();
  void find_joints();
  void measure();
  template <class Add>
  std::vector<Share> gather(const Add& add) const;
  bool is_joint(std::size_t node) const { return is_joint_[node]; }

  const SharedLevel& level_;
  const Processes& all_;
  const Mesh& mesh_;
  Vec3 half_;  ///< of a cell's diagonal [mm]
  std::vector<std::int32_t> part_of_cell_;
  std::vector<double> names_;  ///< of this process's parts
  std::vector<BodyPart> parts_;
  std::map<double, std::size_t> number_of_;  ///< name -> of the part
  std::vector<bool> is_joint_;               ///< of each node of this process
};

SharedParts::SharedParts(const SharedLevel& level)
    : level_(level), all_(level.all()), mesh_(level.mesh()), half_(mesh_.edges() * Vec3::Constant(0.5)) {
  std::size_t num_parts = 0;
  part_of_cell_ = parts_of(mesh_, num_parts);
  names_.resize(num_parts);
  std::iota(names_.begin(), names_.end(), 1.0 + static_cast<double>(all_.sum_before(num_parts)));
  tell_names();
  measure();
  find_joints();
}

/// The highest name of those that a part's own parts have, told from face to face.
void SharedParts::tell_names() {
  // A face is kept with each of its corners, as the component of its axis: what all four say is said at the face.
  constexpr std::array<std::array<std::size_t, 4>, 3> corners_of_lower = {{{0, 2, 4, 6}, {0, 1, 4, 5}, {0, 1, 2, 3}}};
  const auto for_each_face = [&](auto&& f) {
    for (std::size_t c = 0; c < mesh_.num_cells(); ++c)
      for (std::size_t axis = 0; axis < 3; ++axis)
        for (const std::size_t side : {std::size_t{0}, std::size_t{1} << axis}) {
          std::array<Eigen::Index, 4> at{};
          for (std::size_t n = 0; n < 4; ++n)
            at[n] = static_cast<Eigen::Index>(3 * mesh_.node(c, corners_of_lower[axis][n] + side) + axis);
          f(at, name_of(c));
        }
  };
  constexpr std::size_t num_corners = 4;
  std::array<OwnedVec, num_corners> shared;
  for (OwnedVec& of_corner : shared) of_corner = level_.make_vector();
  for (bool changes = true; changes;) {
    std::array<NodeVector, num_corners> told;
    for (NodeVector& of_corner : told) of_corner.setZero(static_cast<Eigen::Index>(mesh_.num_dofs()));
    for_each_face([&](const auto& at, double& name) {
      for (std::size_t n = 0; n < num_corners; ++n) told[n][at[n]] = std::max(told[n][at[n]], name);
    });
    for (std::size_t n = 0; n < num_corners; ++n) {
      level_.copies().raise_to(told[n], shared[n]);
      level_.copies().get(shared[n], told[n]);
    }
    std::size_t count = 0;
    for_each_face([&](const auto& at, double& name) {
      double said = told[0][at[0]];
      for (std::size_t n = 1; n < num_corners; ++n) said = std::min(said, told[n][at[n]]);
      count += said > name;
      name = std::max(said, name);
    });
    changes = all_.sum(count) > 0;
  }
}

/// What all processes have to tell of their parts.
/// @param add  (share, cell)
template <class Add>
std::vector<SharedParts::Share> SharedParts::gather(const Add& add) const {
  std::map<double, Share> own;
  for (std::size_t c = 0; c < mesh_.num_cells(); ++c) {
    Share& share = own[name_of(c)];
    share.name = name_of(c);
    add(share, c);
  }
  std::vector<Share> shares;
  for (const auto& [name, share] : own) shares.push_back(share);
  return all_.gather(shares);
}

void SharedParts::measure() {
  const std::vector<Share> sums = gather([&](Share& share, std::size_t c) {
    share.value += 1;
    Vec3::Map(share.sum.data()) += center_of(c);
  });
  for (const Share& s : sums) {
    const auto [entry, is_new] = number_of_.try_emplace(s.name, parts_.size());
    if (is_new) parts_.emplace_back();
    parts_[entry->second].num_cells += static_cast<std::size_t>(s.value);
    parts_[entry->second].center += Vec3::Map(s.sum.data());
  }
  for (BodyPart& part : parts_) part.center /= static_cast<double>(part.num_cells);
  const std::vector<Share> sizes = gather([&](Share& share, std::size_t c) {
    const Vec3& center = parts_[number_of_.at(share.name)].center;
    share.value = std::max(share.value, (center_of(c) - center).norm() + half_.norm());
  });
  for (const Share& s : sizes) {
    double& size = parts_[number_of_.at(s.name)].size;
    size = std::max(size, s.value);
  }
}

/// Nodes where the least and the highest name around differ.
void SharedParts::find_joints() {
  const double beyond = 1 + all_.largest(names_.empty() ? 0 : *std::max_element(names_.begin(), names_.end()));
  NodeVector extremes = NodeVector::Zero(static_cast<Eigen::Index>(mesh_.num_dofs()));
  for (std::size_t c = 0; c < mesh_.num_cells(); ++c)
    for (const std::int32_t n : mesh_.cell_nodes()[c]) {
      const Eigen::Index at = 3 * Eigen::Index{n};
      extremes[at] = std::max(extremes[at], name_of(c));
      extremes[at + 1] = std::max(extremes[at + 1], beyond - name_of(c));
    }
  const OwnedVec shared = level_.make_vector();
  level_.copies().raise_to(extremes, shared);
  level_.copies().get(shared, extremes);
  for (Eigen::Index at = 0; at < extremes.size(); at += 3)
    is_joint_.push_back(extremes[at] != beyond - extremes[at + 1]);
}

std::vector<Joint> SharedParts::joints() const {
  struct Meeting {
    PetscInt node;
    double part;
    std::array<double, 3> position;
  };
  std::vector<Meeting> meetings;
  for (std::size_t c = 0; c < mesh_.num_cells(); ++c)
    for (std::size_t a = 0; a < 8; ++a)
      if (const std::size_t n = mesh_.node(c, a); is_joint(n)) {
        const Vec3 p = mesh_.position(n);
        meetings.push_back({level_.nodes().numbers()[n], name_of(c), {p[0], p[1], p[2]}});
      }
  std::map<PetscInt, Joint> of_node;
  for (const Meeting& m : all_.gather(meetings)) {
    Joint& joint = of_node[m.node];
    joint.position = Vec3::Map(m.position.data());
    const std::size_t part = number_of_.at(m.part);
    if (std::find(joint.parts.begin(), joint.parts.end(), part) == joint.parts.end()) joint.parts.push_back(part);
  }
  std::vector<Joint> out;
  for (auto& [node, joint] : of_node) out.push_back(std::move(joint));
  return out;
}

std::vector<HeldPoint> SharedParts::held(const std::vector<SharedConstraints::Point>& points) const {
  std::vector<ConstraintPoint> own;
  for (const SharedConstraints::Point& p : points)
    if (const std::int32_t cell = level_.own_cell(p.cell); cell >= 0)
      own.push_back(
          {p.condition, cell, NodeWeights::Map(p.weights.data()), Vec3::Zero(), p.axes, p.area, p.is_quarter});
  struct Found {
    std::array<bool, 3> axes;
    double part;
    bool at_joint;
    std::array<double, 3> position;
  };
  std::vector<Found> found;
  for (const ConstraintPoint& p : with_face_centers(own)) {
    const auto c = static_cast<std::size_t>(p.cell);
    Eigen::Index corner = 0;
    const bool at_node = p.weights.maxCoeff(&corner) >= 1;
    const Vec3 at = mesh_.rest_position(p.cell, p.weights);
    found.push_back({p.axes,
                     name_of(c),
                     at_node && is_joint(mesh_.node(c, static_cast<std::size_t>(corner))),
                     {at[0], at[1], at[2]}});
  }
  std::vector<HeldPoint> out;
  for (const Found& f : all_.gather(found))
    out.push_back({number_of_.at(f.part), Vec3::Map(f.position.data()), f.axes, f.at_joint});
  return out;
}

}  // namespace

void check_supports(const SharedLevel& level, const std::vector<SharedConstraints::Point>& points) {
  const SharedParts parts(level);
  std::vector<std::string> motions;
  for (const FreeMotions& free : free_motions(parts.parts(), parts.joints(), parts.held(points)))
    motions.insert(motions.end(), free.words.begin(), free.words.end());
  if (!motions.empty()) throw SharedError(hexmesh::ErrorKind::geometry, missing_supports(motions, level.level()));
}

}  // namespace hexsolver::mpi
