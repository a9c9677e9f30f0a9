// SPDX-License-Identifier: Apache-2.0
#include "level/grading.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>
#include <unordered_set>

#include "hexmesh/lattice/gap_ends.h"
#include "level/coarser_levels.h"
#include "level/make_contacts.h"
#include "selection/selection.h"
#include "terms/contact.h"

namespace hexsolver {
namespace {

using hexmesh::Lattice;

constexpr double growth = 4;  ///< of the size of cells with the distance

/// Places where the displacement is not smooth [mm].
std::vector<Vec3> find_rough_places(const Lattice& lattice, const Scene& asked) {
  const Scene scene = for_coarser_levels(asked);
  const MeshCells cells(lattice, lattice.num_levels() - 1);
  const Mesh mesh = cells.make_mesh();
  Selector selector(cells, mesh);
  std::vector<Vec3> places;
  const auto add_rim = [&](const Selection& selection, const std::string& what) {
    const std::vector<Vec3> rim = selector.rim(selection, what);
    places.insert(places.end(), rim.begin(), rim.end());
  };
  for (const Condition& c : scene.conditions) add_rim(c.selection, with_place("condition", c));
  for (const Force& f : scene.forces) add_rim(f.selection, with_place("force", f));
  if (scene.contacts.empty()) return places;
  const std::vector<SurfacePoint> surface = selector.whole_surface();
  for (const Contact& c : scene.contacts) {
    const std::vector<Vec3> touched = c.is_within_body()
                                          ? places_of_touch(c, lattice)
                                          : PenaltyContact(c, cells, mesh, surface).places_swept_at_rest();
    places.insert(places.end(), touched.begin(), touched.end());
  }
  return places;
}

/// How far places are from the boxes of cells, in the axes of the voxels.
class Distances {
public:
  Distances(const Lattice& lattice, const std::vector<Vec3>& places) : lattice_(lattice) {
    const Vec3 spacing = lattice.voxels.spacing();
    for (const Vec3& p : places) {
      const Vec3 place = (lattice.voxels.continuous_index(p).array() + 0.5).matrix().cwiseProduct(spacing);
      blocks_[hexmesh::sort_key(block_of(place))].push_back(place);
    }
  }

  bool is_any_within(double distance, int level, const Index3& cell) const {
    const Vec3 size = lattice_.cell_size(level);
    const Vec3 low = Vec3(cell[0], cell[1], cell[2]).cwiseProduct(size), high = low + size;
    const Index3 first = block_of(low - Vec3::Constant(distance)), last = block_of(high + Vec3::Constant(distance));
    const auto is_near = [&](const Vec3& p) {
      return (p - p.cwiseMax(low).cwiseMin(high)).squaredNorm() < distance * distance;
    };
    Index3 block;
    for (block[2] = first[2]; block[2] <= last[2]; ++block[2])
      for (block[1] = first[1]; block[1] <= last[1]; ++block[1])
        for (block[0] = first[0]; block[0] <= last[0]; ++block[0])
          if (const auto found = blocks_.find(hexmesh::sort_key(block));
              found != blocks_.end() && std::any_of(found->second.begin(), found->second.end(), is_near))
            return true;
    return false;
  }

private:
  /// Of a place, those beyond the lower sides of the box among those in it.
  Index3 block_of(const Vec3& place) const {
    const Vec3 edges = voxels_in_block * lattice_.voxels.spacing();
    Index3 out;
    for (std::size_t d = 0; d < 3; ++d)
      out[d] = std::max(
          0, static_cast<std::int32_t>(place[static_cast<Eigen::Index>(d)] / edges[static_cast<Eigen::Index>(d)]));
    return out;
  }

  static constexpr double voxels_in_block = 16;
  const Lattice& lattice_;
  std::unordered_map<std::uint64_t, std::vector<Vec3>> blocks_;  ///< places
};

/// Indices of cells by level, from the finest of graded cells on: those that close a gap which is open on the next
/// finer level or between voxels, or that hold one of these. Not what holds smaller ones: grooves less deep than a
/// quarter of a cell stay.
std::vector<std::unordered_set<std::uint64_t>> find_gap_ends(const Lattice& lattice, int finest, int coarsest) {
  std::vector<std::unordered_set<std::uint64_t>> out(lattice.levels.size());
  for (int l = finest + 1; l <= coarsest; ++l) {
    const hexmesh::Level& level = lattice.level(l);
    const std::vector<bool> is_end = hexmesh::cells_where_gaps_end(lattice, l);
    // Nodes on the two sides of a gap between voxels are at two places.
    const std::vector<bool> is_around =
        l == 1 ? hexmesh::cells_round_gap_ends(level) : std::vector<bool>(level.cells.size());
    for (std::size_t c = 0; c < is_end.size(); ++c) {
      if (!is_end[c] && !is_around[c]) continue;
      out[hexmesh::as_size(l)].insert(hexmesh::sort_key(level.cells[c]));
      if (l == coarsest) continue;
      const Index3 holder = hexmesh::coarser_index(level.cells[c], lattice.level(l + 1).merge);
      out[hexmesh::as_size(l) + 1].insert(hexmesh::sort_key(holder));
    }
  }
  return out;
}

MeshCells grade(const Lattice& lattice, int level, int coarser_by, const Distances& distances) {
  const int coarsest = std::min(level + coarser_by, lattice.num_levels() - 1);
  const auto size = [&](int l) { return std::cbrt(lattice.cell_size(l).prod()); };
  const auto gap_ends = find_gap_ends(lattice, level, coarsest);
  return {lattice, level, coarsest, [&](int l, const Index3& cell) {
            return distances.is_any_within((size(l) - size(level)) / growth, l, cell) ||
                   gap_ends[hexmesh::as_size(l)].contains(hexmesh::sort_key(cell));
          }};
}

}  // namespace

MeshCells cells_for(const Lattice& lattice, const Scene& scene, int level) {
  if (!scene.is_graded()) return {lattice, level};
  return grade(lattice, level, scene.coarser_by, Distances(lattice, find_rough_places(lattice, scene)));
}

std::vector<std::size_t> cells_of_levels(const Lattice& lattice, const Scene& scene) {
  std::vector<std::size_t> num_cells = cells_of_levels(lattice);
  if (!scene.is_graded()) return num_cells;
  const Distances distances(lattice, find_rough_places(lattice, scene));
  for (std::size_t l = 0; l < num_cells.size(); ++l)
    if (num_cells[l] > 0) num_cells[l] = grade(lattice, static_cast<int>(l), scene.coarser_by, distances).size();
  return num_cells;
}

std::size_t cells_beyond(const Lattice& lattice, const Scene& scene, int level) {
  if (!scene.is_graded() || scene.dynamics || scene.is_open_ended() || scene.error_estimation == ErrorEstimation::off)
    return 0;
  const MeshCells cells = cells_for(lattice, scene, level);
  const int finest = cells.levels().front().level, largest = cells.levels().back().level;
  if (largest == 0 || lattice.level(std::max(0, finest - 1)).cells.empty()) return 0;
  const std::size_t halved = cells.divided(std::vector<bool>(cells.size(), true)).size();
  return halved <= most_cells_looked_at || scene.error_estimation == ErrorEstimation::look ? halved : 0;
}

}  // namespace hexsolver
