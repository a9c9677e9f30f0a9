// SPDX-License-Identifier: Apache-2.0
#include "constraints/supports.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>

#include "core/symmetric_eigen.h"
#include "hexmesh/core/partition.h"
#include "mesh/face_neighbours.h"

namespace hexsolver {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

/// More parts than this are not searched for common motions; each must be held by itself or by a joint.
constexpr std::size_t most_parts = 300;

/// Velocity at p for each of the six rigid motions v(p) = t + w x (p - center) / size of a part; shape (3, 6).
Eigen::Matrix<double, 3, 6> motion(const BodyPart& part, const Vec3& p) {
  Eigen::Matrix<double, 3, 6> m = Eigen::Matrix<double, 3, 6>::Zero();
  m.leftCols<3>().setIdentity();
  const Vec3 arm = (p - part.center) / part.size;
  for (int d = 0; d < 3; ++d) m.col(3 + d) = Vec3::Unit(d).cross(arm);
  return m;
}

/// A direction without a sense of its own: its largest component is positive.
Vec3 undirected(const Vec3& v) {
  Eigen::Index largest = 0;
  v.cwiseAbs().maxCoeff(&largest);
  return v.normalized() * (v[largest] < 0 ? -1 : 1);
}

std::string axis_words(const Vec3& v) {
  const auto rounded = [](double x) { return std::round(100 * x) / 100 + 0.0; };  // no -0.00
  return fmt::format("[{:.2f}, {:.2f}, {:.2f}]", rounded(v[0]), rounded(v[1]), rounded(v[2]));
}

/// Words for the motions of one part: as many rotations as there are independent ones, the rest translations.
std::vector<std::string> describe(const BodyPart& part, const MatrixXd& motions) {
  std::vector<std::string> words;
  const std::string which = fmt::format("the part of {} cells around {} mm", part.num_cells, axis_words(part.center));
  const Index num_motions = motions.cols();
  if (num_motions == 6) {
    words.push_back(fmt::format("{} is held by nothing (3 translations, 3 rotations)", which));
    return words;
  }
  // Those that turn most come first, those that do not turn last.
  const MatrixXd turns = motions.bottomRows(3);
  const SymmetricEigen by_turn = symmetric_eigen(turns.transpose() * turns);
  const MatrixXd rotated = motions * by_turn.vectors.rowwise().reverse();
  for (Index m = 0; m < num_motions; ++m) {
    const Vec3 t = rotated.block<3, 1>(0, m), w = rotated.block<3, 1>(3, m) / part.size;
    if (w.norm() * part.size < 1e-6 * std::max(t.norm(), 1e-30) || m >= 3) {
      words.push_back(fmt::format("{} is free to move along {}", which, axis_words(undirected(t))));
    } else {
      const Vec3 through = part.center + w.cross(t) / w.squaredNorm();
      words.push_back(fmt::format("{} is free to turn about the axis {} through {} mm", which,
                                  axis_words(undirected(w)), axis_words(through)));
    }
  }
  return words;
}

}  // namespace

std::vector<std::int32_t> parts_of(const Mesh& mesh, std::size_t& num_parts) {
  hexmesh::Partition partition(mesh.num_cells());
  for_each_shared_face(mesh, [&](const SharedFace& face) { partition.join(face.cell, face.other); });
  std::vector<std::int32_t> part(mesh.num_cells(), -1);
  num_parts = 0;
  for (std::size_t c = 0; c < part.size(); ++c) {
    auto& of_root = part[partition.root(static_cast<std::int32_t>(c))];
    if (of_root < 0) of_root = static_cast<std::int32_t>(num_parts++);
    part[c] = of_root;
  }
  return part;
}

std::string missing_supports(const std::vector<std::string>& motions, int level) {
  const std::size_t shown = std::min<std::size_t>(motions.size(), 3);
  return fmt::format("missing supports at level {}: {}{}, expected every part held", level,
                     fmt::join(motions.begin(), motions.begin() + static_cast<std::ptrdiff_t>(shown), "; "),
                     motions.size() > shown ? fmt::format("; and {} more", motions.size() - shown) : "");
}

std::vector<FreeMotions> free_motions(const std::vector<BodyPart>& parts, const std::vector<Joint>& joints,
                                      const std::vector<HeldPoint>& points) {
  const std::size_t num_parts = parts.size();
  std::vector<char> touched(num_parts), is_held(num_parts), meets(num_parts);
  for (const Joint& j : joints)
    for (const std::size_t p : j.parts) touched[p] = meets[p] = true;
  for (const HeldPoint& p : points) {
    touched[p.part] = true;
    // A node that parts share is held for the one that is held otherwise.
    is_held[p.part] = is_held[p.part] || !p.at_joint;
  }

  std::vector<FreeMotions> found;
  const auto add = [&](std::size_t p, const MatrixXd& motions) {
    found.push_back({p, describe(parts[p], motions), !is_held[p], meets[p] != 0});
  };
  std::vector<Index> first_row(num_parts, -1);
  Index size = 0;
  for (std::size_t p = 0; p < num_parts; ++p) {
    if (!touched[p]) {
      add(p, MatrixXd::Identity(6, 6));
    } else {
      first_row[p] = size;
      size += 6;
    }
  }
  if (size == 0 || size > static_cast<Index>(6 * most_parts)) return found;

  MatrixXd gram = MatrixXd::Zero(size, size);
  for (const HeldPoint& p : points) {
    const auto m = motion(parts[p.part], p.position);
    for (int d = 0; d < 3; ++d)
      if (p.axes[d]) gram.block<6, 6>(first_row[p.part], first_row[p.part]) += m.row(d).transpose() * m.row(d);
  }
  for (const Joint& joint : joints)
    for (std::size_t k = 1; k < joint.parts.size(); ++k) {
      const std::size_t a = joint.parts[0], b = joint.parts[k];
      const auto ma = motion(parts[a], joint.position), mb = motion(parts[b], joint.position);
      gram.block<6, 6>(first_row[a], first_row[a]) += ma.transpose() * ma;
      gram.block<6, 6>(first_row[b], first_row[b]) += mb.transpose() * mb;
      gram.block<6, 6>(first_row[a], first_row[b]) -= ma.transpose() * mb;
      gram.block<6, 6>(first_row[b], first_row[a]) -= mb.transpose() * ma;
    }
  const SymmetricEigen eigen = symmetric_eigen(gram);
  Index num_free = 0;
  while (num_free < size && eigen.values[num_free] < 1e-10 * std::max(1.0, eigen.values[size - 1])) ++num_free;
  if (num_free == 0) return found;
  // Each free motion is told for the parts that take part in it.
  for (std::size_t p = 0; p < num_parts; ++p) {
    if (first_row[p] < 0) continue;
    const MatrixXd own = eigen.vectors.block(first_row[p], 0, 6, num_free);
    const SymmetricEigen of_part = symmetric_eigen(own * own.transpose());
    const Index rank = (of_part.values.array() > 1e-3 * 1e-3).count();
    if (rank > 0) add(p, of_part.vectors.rightCols(rank));
  }
  std::sort(found.begin(), found.end(), [](const FreeMotions& a, const FreeMotions& b) { return a.part < b.part; });
  return found;
}

std::vector<FreePart> free_parts(const Mesh& mesh, const std::vector<ConstraintPoint>& points) {
  std::size_t num_parts = 0;
  const std::vector<std::int32_t> part_of_cell = parts_of(mesh, num_parts);
  std::vector<BodyPart> parts(num_parts);
  const auto half = [&](std::size_t c) -> Vec3 { return mesh.edges(c) * Vec3::Constant(0.5); };
  const auto center_of = [&](std::size_t c) -> Vec3 { return mesh.position(mesh.node(c, 0)) + half(c); };
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
    BodyPart& p = parts[part_of_cell[c]];
    ++p.num_cells;
    p.center += center_of(c);
  }
  for (BodyPart& p : parts) p.center /= static_cast<double>(p.num_cells);
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
    BodyPart& p = parts[part_of_cell[c]];
    p.size = std::max(p.size, (center_of(c) - p.center).norm() + half(c).norm());
  }

  // Nodes where parts meet.
  std::vector<std::vector<std::size_t>> meeting(num_parts > 1 ? mesh.num_all_nodes() : 0);
  const auto meet = [&](std::size_t node, std::size_t cell) {
    auto& list = meeting[node];
    const auto part = static_cast<std::size_t>(part_of_cell[cell]);
    if (std::find(list.begin(), list.end(), part) == list.end()) list.push_back(part);
  };
  if (num_parts > 1)
    for (std::size_t c = 0; c < mesh.num_cells(); ++c)
      for (const std::int32_t n : mesh.cell_nodes()[c]) meet(static_cast<std::size_t>(n), c);
  for (std::size_t n = mesh.num_nodes(); n < meeting.size(); ++n)  // those that hang on edges and faces of a cell
    for (int a = 0; a < 8; ++a) {
      Index3 place = mesh.nodes()[n];
      for (int d = 0; d < 3; ++d) place[static_cast<std::size_t>(d)] -= hexmesh::corner_bit(a, d);
      const auto [first, end] = cells_at(place, mesh.cells(), mesh.sizes());
      for (std::int32_t c = first; c < end; ++c)
        if (!mesh.is_graded_and_split() || holds_node(mesh, hexmesh::as_size(c), n)) meet(n, hexmesh::as_size(c));
    }
  std::vector<Joint> joints;
  for (std::size_t n = 0; n < meeting.size(); ++n)
    if (meeting[n].size() > 1) joints.push_back({mesh.position(n), meeting[n]});
  std::vector<HeldPoint> held;
  for (const ConstraintPoint& p : with_face_centers(points)) {
    Index corner = 0;
    const bool at_node = p.weights.maxCoeff(&corner) >= 1;
    const std::size_t node = mesh.node(p.cell, corner);
    held.push_back({static_cast<std::size_t>(part_of_cell[p.cell]), mesh.rest_position(p.cell, p.weights), p.axes,
                    at_node && !meeting.empty() && meeting[node].size() > 1});
  }

  std::map<std::size_t, FreePart> found;
  for (FreeMotions& free : free_motions(parts, joints, held))
    found[free.part] = {std::move(free.words), {}, free.is_island, free.hangs};
  std::vector<FreePart> out;
  if (found.empty()) return out;
  for (std::size_t c = 0; c < mesh.num_cells(); ++c)
    if (const auto free = found.find(static_cast<std::size_t>(part_of_cell[c])); free != found.end())
      free->second.cells.push_back(static_cast<std::int32_t>(c));
  for (auto& [number, part] : found) out.push_back(std::move(part));
  return out;
}

}  // namespace hexsolver
