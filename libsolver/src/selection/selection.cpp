// SPDX-License-Identifier: Apache-2.0
#include "selection/selection.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <optional>

#include "hexmesh/core/error.h"

namespace hexsolver {

using hexmesh::Embedding;
using hexmesh::Error;
using hexmesh::ErrorKind;

/// A point of the embedded surface that may be selected.
struct Selector::Candidate {
  Vec3 position;
  Embedding embedding;
  std::vector<std::uint16_t> neighbours;  ///< labels behind the exposed faces it stands for
  Vec3 area = Vec3::Zero();
  bool is_node = false;
};

namespace {

/// Outward area vector of a voxel's face [mm^2]; see hexmesh::ExposedFace::side.
Vec3 area_vector(const hexmesh::Grid& voxels, std::uint8_t side) {
  const int axis = side / 2;
  const double area = voxels.voxel_volume() / voxels.spacing()[axis];
  return (side % 2 ? area : -area) * voxels.direction().col(axis);
}

/// The axis of the voxels across a face of them.
int axis_of(const Vec3& area, const hexmesh::Grid& voxels) {
  int across = 0;
  (voxels.direction().transpose() * area).cwiseAbs().maxCoeff(&across);
  return across;
}

/// @param embed  (voxel, continuous index in it) -> its Embedding
template <class Candidate, class Embed>
std::vector<Candidate> face_candidates(const std::vector<hexmesh::ExposedFace>& faces, const hexmesh::Grid& voxels,
                                       const Embed& embed, bool whole_voxels, const SurfaceShare& share) {
  std::vector<Candidate> out;
  const hexmesh::ExposedFace* last = nullptr;
  for (const hexmesh::ExposedFace& face : faces) {
    if (!share.has_voxel(face.voxel)) continue;
    const bool same_voxel = last && last->voxel == face.voxel;
    last = &face;
    if (whole_voxels && same_voxel) {
      out.back().neighbours.push_back(face.neighbour);
      continue;
    }
    const Vec3 index = whole_voxels ? Vec3(face.voxel[0], face.voxel[1], face.voxel[2]) : hexmesh::face_index(face);
    out.push_back({voxels.position(index), embed(face.voxel, index), {face.neighbour}});
    if (!whole_voxels) out.back().area = area_vector(voxels, face.side);
  }
  return out;
}

/// Whether a selection may have points in a ball. One that takes all has; so has one by a segment.
bool may_select(const Selection& s, const hexmesh::SurfaceFaces::Ball& within) {
  if (!s.segment.empty()) return true;
  if (s.box) {
    const Vec3 reach = s.box->to_box.rowwise().norm() * within.radius;  // of the ball, in the box's own measure
    const Vec3 center = (s.box->to_box * (within.center - s.box->center)).cwiseAbs();
    if (((center - reach).array() <= 1 + 1e-9).all()) return true;
  }
  if (s.halfspace && (within.center - s.halfspace->point).dot(s.halfspace->normal) >=
                         -within.radius * s.halfspace->normal.norm() - 1e-9)
    return true;
  return std::any_of(s.balls.begin(), s.balls.end(), [&](const Ball& ball) {
    return (within.center - ball.center).norm() <= std::max(ball.radius, s.max_distance) + within.radius;
  });
}

/// Nodes that touch a missing cell or one that is not full.
template <class Candidate>
std::vector<Candidate> node_candidates(const MeshCells& cells, const Mesh& mesh, const SurfaceShare& share) {
  std::vector<int> full_cells(mesh.num_all_nodes());
  std::vector<Candidate> of_node(mesh.num_all_nodes());
  for (std::size_t c = 0; c < mesh.num_cells(); ++c)
    for (int a = 0; a < 8; ++a) {
      const auto node = mesh.node(c, a);
      full_cells[node] += !cells.lattice_level(c).is_boundary(hexmesh::as_size(cells.place(c).cell));
      Embedding& e = of_node[node].embedding;
      e.cell = static_cast<std::int32_t>(c);
      for (int d = 0; d < 3; ++d) e.local[d] = hexmesh::corner_bit(a, d);
    }
  std::vector<Candidate> out;
  for (std::size_t n = 0; n < mesh.num_nodes(); ++n)
    if (full_cells[n] < 8 && share.has_node(mesh.nodes()[n])) {
      of_node[n].position = mesh.position(n);
      of_node[n].is_node = true;
      out.push_back(of_node[n]);
    }
  return out;
}

struct Nearest {
  std::size_t candidate = 0;
  double distance = std::numeric_limits<double>::infinity();  ///< [mm]
};

template <class Candidate>
Nearest nearest(const std::vector<Candidate>& candidates, const Vec3& point) {
  Nearest best;
  for (std::size_t n = 0; n < candidates.size(); ++n)
    if (const double distance = (candidates[n].position - point).norm(); distance < best.distance) best = {n, distance};
  return best;
}

/// Whether each ball's centre is near enough to the surface.
template <class Candidate>
bool all_near(const Selection& selection, const std::vector<Candidate>& candidates, const SurfaceShare& share) {
  bool near = true;
  for (const Ball& ball : selection.balls)
    near &= share.least(nearest(candidates, ball.center).distance) <= selection.max_distance;
  return near;
}

template <class Candidate>
void select_ball(const Ball& ball, const Selection& selection, const std::string& what,
                 const std::vector<Candidate>& candidates, const SurfaceShare& share, std::vector<char>& chosen) {
  const Nearest closest = nearest(candidates, ball.center);
  const double distance = share.least(closest.distance);
  if (distance > selection.max_distance)
    throw Error(ErrorKind::geometry,
                fmt::format("{}: its point [{:g}, {:g}, {:g}] is {:.1f} mm from the nearest surface point, expected at "
                            "most max_distance_mm = {:g}",
                            what, ball.center[0], ball.center[1], ball.center[2], distance, selection.max_distance));
  if (ball.radius == 0) {
    if (share.is_first(!candidates.empty() && closest.distance == distance)) chosen[closest.candidate] = 1;
    return;
  }
  for (std::size_t n = 0; n < candidates.size(); ++n)
    if ((candidates[n].position - ball.center).norm() <= ball.radius) chosen[n] = 1;
}

std::uint16_t label_of(const std::string& segment, const std::string& what, const hexmesh::Lattice& lattice) {
  std::vector<std::string> names;
  for (const hexmesh::LatticeSegment& s : lattice.segments) {
    if (s.segment.name == segment) return s.segment.label;
    names.push_back(s.segment.name);
  }
  throw Error(ErrorKind::input,
              fmt::format("{}: unknown segment '{}', expected one of: {}", what, segment, fmt::join(names, ", ")));
}

template <class Candidate>
std::vector<char> choose(const Selection& s, const std::string& what, const hexmesh::Lattice& lattice,
                         const std::vector<Candidate>& candidates, const SurfaceShare& share) {
  std::vector<char> chosen(candidates.size());
  for (const Ball& ball : s.balls) select_ball(ball, s, what, candidates, share, chosen);
  const std::uint16_t label = s.segment.empty() ? std::uint16_t{0} : label_of(s.segment, what, lattice);
  for (std::size_t n = 0; n < candidates.size(); ++n) {
    const Vec3& p = candidates[n].position;
    if (s.box && s.box->contains(p)) chosen[n] = 1;
    if (s.halfspace && (p - s.halfspace->point).dot(s.halfspace->normal) >= -1e-9) chosen[n] = 1;
    if (!s.segment.empty() && std::count(candidates[n].neighbours.begin(), candidates[n].neighbours.end(), label))
      chosen[n] = 1;
  }
  return chosen;
}

template <class Candidate>
std::string nothing_selected(const Selection& s, const std::string& what, const hexmesh::Lattice& lattice,
                             const std::vector<Candidate>& candidates, const SurfaceShare& share) {
  std::string detail = "expected at least one point of the surface";
  if (s.balls.size() == 1) {
    const Vec3& center = s.balls[0].center;
    detail = fmt::format("the nearest is {:.1f} mm from its point, expected radius_mm of at least that",
                         share.least(nearest(candidates, center).distance));
  } else if (s.box || s.halfspace) {
    double least = std::numeric_limits<double>::infinity();
    for (const Candidate& c : candidates)
      least = std::min(least, s.halfspace ? -(c.position - s.halfspace->point).dot(s.halfspace->normal)
                                          : (c.position - s.box->center).norm());
    detail = fmt::format("the nearest is {:.1f} mm from {}", share.least(least),
                         s.box ? "the box's centre, expected one inside" : "the half-space, expected one inside");
  } else if (!s.segment.empty() && lattice.segments.size() > 1) {
    detail = fmt::format("no material touches segment '{}' (one with a material of its own?)", s.segment);
  }
  return fmt::format("{} selects no point: {}", what, detail);
}

}  // namespace

Selector::Selector(MeshCells cells, const Mesh& mesh, const SurfaceShare& share)
    : cells_(std::move(cells)), mesh_(mesh), share_(share) {}

Selector::~Selector() = default;

const hexmesh::CellLocator& Selector::locator() {
  if (!locator_)
    locator_ = std::make_unique<const hexmesh::CellLocator>(lattice().voxels, cells_.unit(), mesh_.cells(),
                                                            cells_.lattice_level(0).split.owners);
  return *locator_;
}

Embedding Selector::embed(const Index3& voxel, const Vec3& voxel_index) const {
  if (locator_) return locator_->in_cell_of_voxel(voxel, voxel_index);
  return in_cell(cells_.cell_of_voxel(voxel), voxel_index);
}

/// Where a place is in a cell.
Embedding Selector::in_cell(std::int32_t cell, const Vec3& voxel_index) const {
  const auto c = hexmesh::as_size(cell);
  return {cell, hexmesh::local_in_cell(voxel_index, mesh_.cells()[c], cells_.lattice_level(c).voxels_per_cell)};
}

template <class MayCount>
std::vector<Selector::Candidate> Selector::candidates(SurfacePoints on, const MayCount& may_count) {
  if (on == SurfacePoints::nodes) return node_candidates<Candidate>(cells_, mesh_, share_);
  if (!faces_) {
    faces_ = hexmesh::faces_of(lattice());
    if (!mesh_.is_graded()) locator();
  }
  return face_candidates<Candidate>(
      faces_->find(lattice().voxels, may_count), lattice().voxels,
      [this](const Index3& voxel, const Vec3& index) { return embed(voxel, index); }, on == SurfacePoints::voxels,
      share_);
}

std::vector<Selector::Candidate> Selector::choose_candidates(const Selection& selection, const std::string& what) {
  std::vector<Candidate> list = candidates(selection.on, [&](const auto& ball) { return may_select(selection, ball); });
  std::vector<char> chosen;
  const auto is_any_chosen = [&] {
    return share_.sum(static_cast<double>(std::count(chosen.begin(), chosen.end(), 1))) > 0;
  };
  if (all_near(selection, list, share_)) chosen = choose(selection, what, lattice(), list, share_);
  if (!is_any_chosen()) {  // the message names what is nearest of all
    list = candidates(selection.on, [](const auto&) { return true; });
    chosen = choose(selection, what, lattice(), list, share_);
  }
  if (!is_any_chosen()) throw Error(ErrorKind::geometry, nothing_selected(selection, what, lattice(), list, share_));
  std::vector<Candidate> out;
  for (std::size_t n = 0; n < list.size(); ++n)
    if (chosen[n]) out.push_back(std::move(list[n]));
  return out;
}

SurfacePoint Selector::found(const Candidate& candidate) {
  if (candidate.is_node)
    note_acting_around(candidate);
  else if (candidate.area == Vec3::Zero())
    note_acting(candidate.position, 0.6);  // a voxel
  else
    note_acting(candidate.position, 0.1, lattice().voxels.direction().transpose() * candidate.area.stableNormalized());
  return {candidate.embedding.cell, hexmesh::shape_functions(candidate.embedding.local), candidate.area};
}

void Selector::note_acting(const Vec3& position, double reach, const Vec3& out) {
  if (!notes_acting_) return;
  const Vec3 index = lattice().voxels.continuous_index(position);
  acting_.push_back({index, index - out / 2, reach});
}

void Selector::note_acting_around(const Candidate& node) {
  if (!notes_acting_) return;
  const Index3& cell = cells_.lattice_level(hexmesh::as_size(node.embedding.cell)).voxels_per_cell;
  const Vec3 index = lattice().voxels.continuous_index(node.position);
  acting_.push_back({index, index, static_cast<double>(*std::max_element(cell.begin(), cell.end())), true});
}

std::vector<hexmesh::ActingPoint> acting_points(const std::vector<Index3>& voxels, const std::vector<Acting>& acting) {
  std::vector<hexmesh::ActingPoint> out;
  for (const Acting& a : acting) {
    Index3 first, last, v;
    for (std::size_t d = 0; d < 3; ++d) {
      first[d] = static_cast<std::int32_t>(std::ceil(a.center[static_cast<Eigen::Index>(d)] - a.reach));
      last[d] = static_cast<std::int32_t>(std::floor(a.center[static_cast<Eigen::Index>(d)] + a.reach));
    }
    for (v[2] = first[2]; v[2] <= last[2]; ++v[2])
      for (v[1] = first[1]; v[1] <= last[1]; ++v[1])
        for (v[0] = first[0]; v[0] <= last[0]; ++v[0]) {
          const auto [begin, end] = hexmesh::cells_at(voxels, v);
          for (std::int32_t c = begin; c < end; ++c) out.push_back({c, a.in_all ? Vec3(v[0], v[1], v[2]) : a.index});
        }
  }
  return out;
}

std::vector<SurfacePoint> Selector::select(const Selection& selection, const std::string& what) {
  std::vector<SurfacePoint> points;
  for (const Candidate& c : choose_candidates(selection, what)) points.push_back(found(c));
  return points;
}

std::vector<Vec3> Selector::rim(const Selection& selection, const std::string& what) {
  const std::vector<Candidate> chosen = choose_candidates(selection, what);
  using Edge = std::array<std::int64_t, 3>;  // twice the continuous voxel index of its middle
  const auto edges_of = [&](const Candidate& face) {
    const int across = axis_of(face.area, lattice().voxels);
    const Vec3 twice = 2 * lattice().voxels.continuous_index(face.position);
    std::array<Edge, 4> edges;
    for (std::size_t n = 0; n < 4; ++n) {
      for (int d = 0; d < 3; ++d) edges[n][static_cast<std::size_t>(d)] = std::llround(twice[d]);
      edges[n][(static_cast<std::size_t>(across) + 1 + n / 2) % 3] += n % 2 == 0 ? -1 : 1;
    }
    return edges;
  };
  std::map<Edge, int> faces_of_edge;
  for (const Candidate& c : chosen)
    if (c.area != Vec3::Zero())
      for (const Edge& e : edges_of(c)) ++faces_of_edge[e];
  std::vector<Vec3> out;
  for (const Candidate& c : chosen)
    if (c.area == Vec3::Zero()) out.push_back(c.position);
  for (const auto& [edge, faces] : faces_of_edge)
    if (faces == 1) {
      Vec3 twice;
      for (int d = 0; d < 3; ++d) twice[d] = static_cast<double>(edge[static_cast<std::size_t>(d)]);
      out.push_back(lattice().voxels.position(twice / 2));
    }
  return out;
}

bool Selector::has_small_faces() const {
  constexpr std::int32_t many = 8;
  const hexmesh::Index3& per_cell = cells_.unit();
  return *std::min_element(per_cell.begin(), per_cell.end()) >= many;
}

std::array<NodeWeights, 4> Selector::gauss_points(const SurfacePoint& face) const {
  const Vec3 center = hexmesh::local_position(face.weights);
  const int across = axis_of(face.area, lattice().voxels);
  const hexmesh::Index3& per_cell = cells_.lattice_level(hexmesh::as_size(face.cell)).voxels_per_cell;
  std::array<NodeWeights, 4> out;
  for (int n = 0; n < 4; ++n) {
    Vec3 local = center;
    for (int along = 0; along < 2; ++along) {
      const int d = (across + 1 + along) % 3;
      local[d] += (n >> along & 1 ? 0.5 : -0.5) / std::numbers::sqrt3 /
                  static_cast<double>(per_cell[static_cast<std::size_t>(d)]);
    }
    out[static_cast<std::size_t>(n)] = hexmesh::shape_functions(local);
  }
  return out;
}

std::vector<SurfacePoint> Selector::embed(const std::vector<Vec3>& places) {
  // Graded cells hold whole cells of their finest level.
  const hexmesh::Level& finest = lattice().level(cells_.level());
  std::optional<const hexmesh::CellLocator> of_finest;
  if (mesh_.is_graded()) of_finest.emplace(lattice().voxels, finest.voxels_per_cell, finest.cells, finest.split.owners);
  std::vector<SurfacePoint> out;
  for (const Vec3& place : places) {
    note_acting(place, 1);
    Embedding e = (of_finest ? *of_finest : locator()).locate_position(place);
    if (of_finest && e.cell >= 0)
      e = in_cell(cells_.holder(cells_.level(), e.cell), lattice().voxels.continuous_index(place));
    out.emplace_back();
    if (e.cell >= 0) out.back() = {e.cell, hexmesh::shape_functions(e.local), Vec3::Zero()};
  }
  return out;
}

std::vector<SurfacePoint> Selector::centers_of(const std::vector<hexmesh::ExposedFace>& faces) {
  if (!mesh_.is_graded()) locator();
  std::vector<SurfacePoint> points;
  for (const Candidate& c : face_candidates<Candidate>(
           faces, lattice().voxels, [this](const Index3&voxel, const Vec3&index) { return embed(voxel, index); }, false,
           share_))
    points.push_back(found(c));
  return points;
}

std::vector<SurfacePoint> Selector::whole_surface() {
  std::vector<SurfacePoint> points;
  for (const Candidate& c : candidates(SurfacePoints::faces, [](const auto&) { return true; }))
    points.push_back(found(c));
  return points;
}

}  // namespace hexsolver
