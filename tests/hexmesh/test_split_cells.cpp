// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <random>
#include <set>

#include "hexmesh/core/partition.h"
#include "hexmesh/file/lattice_file.h"
#include "hexmesh/file/result_file.h"
#include "hexmesh/lattice/check.h"
#include "hexmesh/lattice/embedded_points.h"
#include "hexmesh/lattice/gap_ends.h"
#include "hexmesh/lattice/locator.h"
#include "hexmesh/result/result.h"
#include "hexmesh/warp/displacement_field.h"
#include "support/bodies.h"
#include "support/files.h"

namespace test_split_cells {

using namespace hexmesh;
using namespace testing_support;

/// @param label_of  of each voxel; 0 = none
Lattice make(const Index3& extent, const std::function<std::uint16_t(const Index3&)>& label_of, const Parting& parting,
             const Index3& offset = {0, 0, 0}, const Vec3& spacing = {1, 1.25, 1.5}) {
  LabelVolume volume = make_volume(extent, spacing, label_of);
  std::vector<LatticeSegment> segments;
  std::uint16_t most = 0;
  for (const std::uint16_t label : volume.labels) most = std::max(most, label);
  volume.segments.clear();
  for (std::uint16_t label = 1; label <= most; ++label) {
    volume.segments.push_back({label, "s" + std::to_string(label)});
    segments.push_back({volume.segments.back(), material_from_units(10.0 * label, 0.3, 1000), 0, ""});
  }
  return build_lattice(volume, segments, {0, offset, parting});
}

const Parting gaps{true, {}}, slide{false, {{1, 2}}};

/// A block with a fissure one voxel wide in x, open above j = 5.
std::uint16_t fissured(const Index3& v) { return v[0] == 13 && v[1] > 5 ? 0 : 1; }
const Index3 block = {27, 19, 11};

/// Two blocks that touch at i = 13, and a third below both.
std::uint16_t touching(const Index3& v) { return v[1] < 4 ? 3 : v[0] < 13 ? 1 : 2; }

/// A ball in a shell, with specks, seeds and voxels that touch at edges only.
std::uint16_t ragged(const Index3& v) {
  static std::mt19937 dice(5);
  static std::map<Index3, int> noise;
  const auto [entry, is_new] = noise.try_emplace(v, 0);
  if (is_new) entry->second = static_cast<int>(dice() % 100);
  const double r = (Vec3(v[0], v[1], v[2]) - Vec3(10, 10, 10)).norm();
  if (entry->second < 8) return 0;
  if (r > 6 && r < 7) return entry->second < 20 ? 1 : 0;
  return r < 6 ? 1 : r < 9.5 ? 2 : 0;
}

/// How many bodies the cells of a level are that share nodes, through any others.
std::size_t count_bodies(const Lattice& lattice, int level) {
  const NodeNumbering numbering = nodes_of(lattice.level(level));
  Partition bodies(numbering.nodes.size());
  std::size_t count = numbering.nodes.size();
  for (const CellNodes& nodes : numbering.cell_nodes)
    for (const std::int32_t n : nodes) count -= bodies.join(nodes[0], n);
  return count;
}

/// At each node of a level a field of the next coarser one that is random at its nodes: cells that share a node agree
/// on it.
std::vector<double> random_field_of_coarser(const Lattice& lattice, int l) {
  std::mt19937 dice(3);
  std::uniform_real_distribution<double> any(-1, 1);
  const Level &fine = lattice.level(l), &coarse = lattice.level(l + 1);
  const NodeNumbering of_fine = nodes_of(fine), of_coarse = nodes_of(coarse);
  std::vector<double> value(of_coarse.nodes.size()), found(of_fine.nodes.size(), 9);
  for (double& v : value) v = any(dice);
  const std::vector<std::int32_t> parent = coarser_cells_of(lattice, l, l + 1);
  for (std::size_t c = 0; c < fine.cells.size(); ++c) {
    int slot = 0;
    for (int d = 0; d < 3; ++d) slot |= fine.cells[c][as_size(d)] % coarse.merge[as_size(d)] << d;
    for (int a = 0; a < 8; ++a) {
      const NodeWeights weights = weights_in_parent(slot, a, coarse.merge);
      double here = 0;
      for (int b = 0; b < 8; ++b) here += weights[b] * value[of_coarse.cell_nodes[parent[c]][b]];
      double& there = found[of_fine.cell_nodes[c][a]];
      if (there < 9) {
        EXPECT_NEAR(there, here, 1e-14) << "level " << l << ", cell " << c;
      }
      there = here;
    }
  }
  return found;
}

/// Any field of a coarser level is one of the finer level.
void expect_nested(const Lattice& lattice) {
  for (int l = 0; l + 1 < lattice.num_levels(); ++l) random_field_of_coarser(lattice, l);
}

/// Which cells of a level move two nodes of the next finer one alike that are at one place: as a random field tells.
std::vector<bool> cells_that_close(const Lattice& lattice, int level) {
  const std::vector<double> field = random_field_of_coarser(lattice, level - 1);
  const NodeNumbering fine = nodes_of(lattice.level(level - 1));
  std::vector<bool> is_closed(fine.nodes.size()), out(lattice.level(level).cells.size());
  for (std::size_t n = 0; n < fine.nodes.size(); ++n)
    for (std::size_t m = n + 1; m < fine.nodes.size() && fine.nodes[m] == fine.nodes[n]; ++m)
      if (std::abs(field[n] - field[m]) < 1e-13) is_closed[n] = is_closed[m] = true;
  const std::vector<std::int32_t> parent = coarser_cells_of(lattice, level - 1, level);
  for (std::size_t c = 0; c < parent.size(); ++c)
    for (const std::int32_t n : fine.cell_nodes[c])
      if (is_closed[as_size(n)]) out[as_size(parent[c])] = true;
  return out;
}

/// Which cells of a level have a node that two cells share which have another, at one place, each for itself.
std::vector<bool> cells_with_ends(const Level& level) {
  const NodeNumbering numbering = nodes_of(level);
  std::vector<bool> is_end(numbering.nodes.size()), out(level.cells.size());
  for (const CellNodes& one : numbering.cell_nodes)
    for (const CellNodes& other : numbering.cell_nodes) {
      if (std::abs(numbering.nodes[as_size(one[0])][2] - numbering.nodes[as_size(other[0])][2]) > 1 ||
          std::abs(numbering.nodes[as_size(one[0])][1] - numbering.nodes[as_size(other[0])][1]) > 1)
        continue;
      std::vector<std::int32_t> shared;
      bool is_apart = false;
      for (const std::int32_t n : one)
        for (const std::int32_t m : other) {
          if (n == m) shared.push_back(n);
          is_apart = is_apart || (n != m && numbering.nodes[as_size(n)] == numbering.nodes[as_size(m)]);
        }
      if (is_apart)
        for (const std::int32_t n : shared) is_end[as_size(n)] = true;
    }
  for (std::size_t c = 0; c < out.size(); ++c)
    for (const std::int32_t n : numbering.cell_nodes[c]) out[c] = out[c] || is_end[as_size(n)];
  return out;
}

void expect_checked(const Lattice& lattice) {
  for (const Finding& finding : check_lattice(lattice))
    EXPECT_LE(finding.error, finding.limit) << finding.property << " at level " << finding.level;
}

TEST(SplitCells, AWholeBodyHasNone) {
  const auto whole = [](const Index3&) -> std::uint16_t { return 1; };
  const Lattice tied = make(block, whole, {}), split = make(block, whole, gaps);
  for (int l = 0; l < tied.num_levels(); ++l) {
    EXPECT_TRUE(split.level(l).split.empty());
    EXPECT_EQ(split.level(l).cells, tied.level(l).cells);
    EXPECT_EQ(split.level(l).element, tied.level(l).element);
    EXPECT_EQ(split.level(l).children, tied.level(l).children);
  }
  EXPECT_FALSE(split.parting.any());  // the file is that of tied cells
}

/// A block with a fissure of one voxel's width along its diagonal, open above j = 5: its sides touch at edges.
TEST(SplitCells, AnObliqueFissureIsOpenAtEveryLevel) {
  const auto oblique = [](const Index3& v) -> std::uint16_t { return v[0] + v[1] == 26 && v[1] > 5 ? 0 : 1; };
  for (const Index3& offset : {Index3{0, 0, 0}, Index3{1, 2, 3}}) {
    const Lattice lattice = make({27, 27, 11}, oblique, gaps, offset);
    expect_checked(lattice);
    expect_nested(lattice);
    for (int l = 0; l < lattice.num_levels(); ++l) {
      EXPECT_EQ(count_bodies(lattice, l), 1U);
      const Level& level = lattice.level(l);
      // Two voxels from its end on, where the way around is short, and what lies in cells with that.
      if (std::max(level.voxels_per_cell[0], level.voxels_per_cell[1]) > 4) continue;
      const CellLocator locator(lattice.voxels, level.voxels_per_cell, level.cells, level.split.owners);
      const NodeNumbering numbering = nodes_of(level);
      for (const std::int32_t j : {14, 17, 20}) {
        const Index3 one = {25 - j + offset[0], j + offset[1], 5 + offset[2]},
                     other = {27 - j + offset[0], j + offset[1], 5 + offset[2]};
        const CellNodes &a = numbering.cell_nodes[locator.cell_of_voxel(one)],
                        &b = numbering.cell_nodes[locator.cell_of_voxel(other)];
        EXPECT_EQ(std::find_first_of(a.begin(), a.end(), b.begin(), b.end()), a.end()) << "level " << l << ", j " << j;
      }
    }
  }
}

/// Voxels that only touch at edges and corners, as those at noisy surfaces do, with a way around close by: level 0 is
/// the mesh that any other program makes of the voxels.
TEST(SplitCells, NoiseOpensNothing) {
  const auto noisy = [](const Index3& v) -> std::uint16_t {
    const double r = (Vec3(v[0], v[1], v[2]) - Vec3(10, 10, 10)).norm();
    const unsigned dice = (73856093U * static_cast<unsigned>(v[0]) ^ 19349663U * static_cast<unsigned>(v[1]) ^
                           83492791U * static_cast<unsigned>(v[2])) %
                          7;
    return r < 7.5 || (r < 8.6 && dice > 2) ? 1 : 0;
  };
  const Lattice tied = make({21, 21, 21}, noisy, {}), split = make({21, 21, 21}, noisy, gaps);
  std::size_t at_edges = 0;  // that faces alone would open
  const CellLocator voxel_at(split.voxels, {1, 1, 1}, split.level(0).cells);
  for (const Index3& v : split.level(0).cells)
    at_edges += voxel_at.cell_of_voxel({v[0] + 1, v[1] + 1, v[2]}) >= 0 &&
                voxel_at.cell_of_voxel({v[0] + 1, v[1], v[2]}) < 0 &&
                voxel_at.cell_of_voxel({v[0], v[1] + 1, v[2]}) < 0;
  EXPECT_GT(at_edges, 20U);
  EXPECT_EQ(nodes_of(split.level(0)).nodes, nodes_of(tied.level(0)).nodes);
  EXPECT_EQ(nodes_of(split.level(0)).cell_nodes, nodes_of(tied.level(0)).cell_nodes);
}

/// Two blocks that meet at an edge: along a short one they hang together, along a long one there is a gap.
TEST(SplitCells, PartsThatMeetAtFewNodesHangTogether) {
  for (const std::int32_t length : {12, 24}) {
    const auto two = [](const Index3& v) -> std::uint16_t { return (v[0] < 8) == (v[1] < 8) ? 1 : 0; };
    const Lattice lattice = make({16, 16, length}, two, gaps, {1, 0, 2});
    expect_checked(lattice);
    expect_nested(lattice);
    for (int l = 0; l < lattice.num_levels(); ++l) EXPECT_EQ(count_bodies(lattice, l), length < 16 ? 1U : 2U);
  }
}

/// Crumbs beside a block go with it where a cell holds both, or two that touch do; a block of some size does not.
TEST(SplitCells, CrumbsGoWithWhatIsBesideThem) {
  for (const std::int32_t size : {2, 8}) {
    const auto crumb = [&](const Index3& v) -> std::uint16_t {
      return v[1] < 11 || (v[1] > 12 && v[1] < 13 + size && v[0] < size && v[2] < size) ? 1 : 0;
    };
    const Lattice lattice = make({27, 21, 11}, crumb, gaps);
    expect_checked(lattice);
    expect_nested(lattice);
    EXPECT_EQ(count_bodies(lattice, 0), 2U);
    for (int l = 2; l < lattice.num_levels(); ++l) EXPECT_EQ(count_bodies(lattice, l), size == 2 ? 1U : 2U) << l;
  }
}

TEST(SplitCells, AFissureStaysOpenAtEveryLevelAndPosition) {
  for (const Index3& offset : {Index3{0, 0, 0}, Index3{1, 0, 0}, Index3{2, 3, 1}, Index3{3, 1, 2}}) {
    const Lattice lattice = make(block, fissured, gaps, offset);
    expect_checked(lattice);
    expect_nested(lattice);
    for (int l = 0; l < lattice.num_levels(); ++l) {
      // One body all round the fissure, whose sides share nothing above its end.
      EXPECT_EQ(count_bodies(lattice, l), 1U);
      const Level& level = lattice.level(l);
      const CellLocator locator(lattice.voxels, level.voxels_per_cell, level.cells, level.split.owners);
      const NodeNumbering numbering = nodes_of(level);
      const Index3 left = {12 + offset[0], 18 + offset[1], 5 + offset[2]},
                   right = {14 + offset[0], 18 + offset[1], 5 + offset[2]};
      const std::int32_t a = locator.cell_of_voxel(left), b = locator.cell_of_voxel(right);
      ASSERT_GE(a, 0);
      ASSERT_GE(b, 0);
      if (level.voxels_per_cell[1] > 4) continue;  // a cell that holds the fissure's end holds its sides
      EXPECT_NE(a, b);
      for (const std::int32_t n : numbering.cell_nodes[a])
        EXPECT_EQ(std::count(numbering.cell_nodes[b].begin(), numbering.cell_nodes[b].end(), n), 0) << "level " << l;
    }
  }
}

TEST(SplitCells, OpenGapsAreMeasured) {
  // A fissure from j = begin to the top, along a border of cells of every size: its sides share the nodes up to the
  // cells in which it ends.
  const int begin = 11;
  const Index3 extent = {60, 60, 20};
  const auto cut = [&](const Index3& v) -> std::uint16_t { return v[0] == 31 && v[1] >= begin ? 0 : 1; };
  for (const Index3& offset : {Index3{0, 0, 0}, Index3{0, 1, 2}, Index3{0, 5, 6}, Index3{0, 12, 3}}) {
    const Lattice lattice = make(extent, cut, gaps, offset, {1, 1, 1});
    ASSERT_GE(lattice.num_levels(), 5);
    const auto shared_up_to = [&](int size) { return (begin + offset[1] + size - 1) / size * size; };  // in voxels
    const int top = (extent[1] + offset[1] + 1) / 2 * 2, along = (extent[2] - 1 + offset[2]) / 2 - offset[2] / 2 + 2;
    const double volume = static_cast<double>(lattice.level(0).cells.size()), area = std::pow(8 / volume, 2.0 / 3);
    const auto closed_by = [&](int size) { return along * (shared_up_to(size) - shared_up_to(2)) / 2 * area; };
    for (int l = 0; l < 5; ++l) {
      const int size = 1 << l;
      const OpenGaps& found = lattice.level(l).gaps;
      const double open = along * (top - shared_up_to(size)) / 2 * area;
      EXPECT_NEAR(found.open, l > 1 ? open : 0, 1e-12) << l;
      EXPECT_NEAR(found.closed, l > 1 ? closed_by(size) : 0, 1e-12) << l;
      EXPECT_NEAR(found.closed_finer, l > 1 ? closed_by(size / 2) : 0, 1e-12) << l;
    }
    expect_checked(lattice);
  }
  const Lattice whole = make(extent, [](const Index3&) -> std::uint16_t { return 1; }, gaps, {0, 0, 0});
  for (const Level& level : whole.levels) EXPECT_EQ(level.gaps, OpenGaps{});
}

TEST(SplitCells, GapsEndInCellsThatMoveTwoNodesOfOnePlaceAlike) {
  const auto oblique = [](const Index3& v) -> std::uint16_t { return v[0] + v[1] == 26 && v[1] > 5 ? 0 : 1; };
  const std::pair<Index3, std::function<std::uint16_t(const Index3&)>> bodies[] = {
      {block, fissured}, {{27, 27, 11}, oblique}, {{21, 21, 21}, ragged}};
  for (const Index3& offset : {Index3{0, 0, 0}, Index3{1, 2, 3}, Index3{2, 3, 1}})
    for (const auto& [extent, label_of] : bodies) {
      const Lattice lattice = make(extent, label_of, gaps, offset);
      std::size_t ends = 0;
      for (int l = 1; l < lattice.num_levels(); ++l) {
        const std::vector<bool> found = cells_where_gaps_end(lattice, l);
        EXPECT_EQ(found, cells_that_close(lattice, l)) << "level " << l;
        EXPECT_EQ(cells_round_gap_ends(lattice.level(l)), cells_with_ends(lattice.level(l))) << "level " << l;
        ends += static_cast<std::size_t>(std::count(found.begin(), found.end(), true));
      }
      EXPECT_GT(ends, 0U);
    }
  const Lattice whole = make(
      block, [](const Index3&) -> std::uint16_t { return 1; }, gaps);
  for (int l = 1; l < whole.num_levels(); ++l) {
    for (const std::vector<bool>& found : {cells_where_gaps_end(whole, l), cells_round_gap_ends(whole.level(l))})
      EXPECT_EQ(std::count(found.begin(), found.end(), true), 0);
  }
}

TEST(SplitCells, SegmentsThatSlideShareNoNode) {
  for (const Index3& offset : {Index3{0, 0, 0}, Index3{1, 2, 3}}) {
    const auto two = [](const Index3& v) -> std::uint16_t { return v[0] < 13 ? 1 : 2; };
    const Lattice lattice = make(block, two, slide, offset);
    expect_checked(lattice);
    expect_nested(lattice);
    for (int l = 0; l < lattice.num_levels(); ++l) {
      EXPECT_EQ(count_bodies(lattice, l), 2U);
      EXPECT_EQ(nodes_of(lattice.level(l)).nodes.size(), count_nodes(lattice.level(l).cells, lattice.level(l).split));
    }
    // A third that holds both makes them one body, and the sides part above it.
    const Lattice held = make(block, touching, slide, offset);
    expect_checked(held);
    expect_nested(held);
    for (int l = 0; l < held.num_levels(); ++l) EXPECT_EQ(count_bodies(held, l), 1U);
    EXPECT_GT(nodes_of(held.level(1)).nodes.size(), number_nodes(held.level(1).cells).nodes.size());
  }
}

/// Specks of a segment in another along which it slides, that touch its own edge by theirs: they move with one of both.
TEST(SplitCells, SpecksDoNotTieWhatTheyLieBetween) {
  for (const Index3& offset : {Index3{0, 0, 0}, Index3{1, 2, 3}})
    for (const std::set<Index3>& speck : std::vector<std::set<Index3>>{
             {{14, 7, 5}}, {{14, 7, 5}, {14, 7, 6}}, {{14, 7, 5}, {15, 8, 5}}, {{14, 7, 5}, {13, 6, 4}, {15, 8, 6}}}) {
      const auto label = [&](const Index3& v) -> std::uint16_t {
        const bool is_first = v[0] < (v[1] < 7 ? 14 : 13);
        return is_first == (speck.count(v) == 0) ? 1 : 2;
      };
      const Lattice lattice = make(block, label, slide, offset);
      expect_checked(lattice);
      expect_nested(lattice);
      for (int l = 0; l < lattice.num_levels(); ++l) EXPECT_EQ(count_bodies(lattice, l), 2U) << "level " << l;
    }
}

TEST(SplitCells, RaggedBodiesKeepTheirVolumeAndNest) {
  for (const Parting& parting : {gaps, slide, Parting{true, {{2, 1}}}}) {
    const Lattice lattice = make({21, 21, 21}, ragged, parting, {1, 0, 2});
    expect_checked(lattice);
    expect_nested(lattice);
    for (const Level& level : lattice.levels) {
      std::vector<std::int64_t> voxels(level.cells.size());
      const CellLocator locator(lattice.voxels, level.voxels_per_cell, level.cells, level.split.owners);
      for (const Index3& v : lattice.levels.front().cells) ++voxels[as_size(locator.cell_of_voxel(v))];
      for (std::size_t c = 0; c < voxels.size(); ++c) EXPECT_EQ(voxels[c], level.filled[level.element[c]]);
    }
  }
}

TEST(SplitCells, FilesKeepThem) {
  const TemporaryFolder folder;
  const Lattice lattice = make(block, touching, slide, {1, 0, 0});
  write_lattice(lattice, folder / "a");
  EXPECT_TRUE(is_as_written(folder / "a"));
  const Lattice again = read_lattice(folder / "a");
  EXPECT_EQ(again.parting, lattice.parting);
  for (int l = 0; l < lattice.num_levels(); ++l) {
    EXPECT_EQ(again.level(l).cells, lattice.level(l).cells);
    EXPECT_EQ(again.level(l).split, lattice.level(l).split);
    Result result = rest_state(lattice, l);
    result.displacement = result.nodes;
    result.report = "{}";
    write_result(result, folder / "r", folder / "a");
    const Result found = read_result(folder / "r");
    EXPECT_EQ(found.owners, lattice.level(l).split.owners);
    EXPECT_EQ(found.parting, lattice.parting);
    EXPECT_EQ(found.cell_nodes, result.cell_nodes);
  }
}

/// The first segment moved along y by one way, the second by another.
Result slid(const Lattice& lattice, int level, double first, double second) {
  Result result = rest_state(lattice, level);
  result.displacement.assign(result.nodes.size(), Vec3::Zero());
  for (std::size_t c = 0; c < result.cells.size(); ++c)
    for (const std::int32_t n : result.cell_nodes[c])
      result.displacement[as_size(n)] = Vec3(0, result.segment[c] == 1 ? first : second, 0);
  return result;
}

/// What a scan looks like when its segments have slid: each voxel's material where its segment went.
TEST(SplitCells, SurfacesFollowTheirOwnSegment) {
  const auto two = [](const Index3& v) -> std::uint16_t { return v[0] < 13 ? 1 : 2; };
  const Lattice lattice = make(block, two, slide);
  for (int l = 0; l < lattice.num_levels(); ++l) {
    Result result = slid(lattice, l, 3, -2);
    // A triangle of each on the face between them, as smoothed surfaces have it: a little to either side.
    for (const std::uint16_t label : {1, 2})
      for (const double beside : {-0.4, 0.4}) {
        const auto first = static_cast<std::int32_t>(result.surface.points.size());
        for (const double j : {4.0, 6.0, 9.0})
          result.surface.points.push_back(lattice.voxels.position(Vec3(12.5 + beside, j, 5)));
        result.surface.triangles.push_back({first, first + 1, first + 2});
        result.surface.segment.push_back(label);
      }
    move_surface(result);
    for (std::size_t t = 0; t < result.surface.triangles.size(); ++t)
      for (const std::int32_t p : result.surface.triangles[t])
        EXPECT_NEAR(result.surface_displacement[as_size(p)][1], result.surface.segment[t] == 1 ? 3 : -2, 1e-12)
            << "level " << l;
  }
}

/// What is found at a place came from there with the segment that it is of.
TEST(SplitCells, WarpsTakeEachSegmentFromItsOwnCells) {
  const auto two = [](const Index3& v) -> std::uint16_t { return v[0] < 13 ? 1 : 2; };
  const Lattice lattice = make(block, two, slide);
  for (int l = 0; l < lattice.num_levels(); ++l) {
    Result result = slid(lattice, l, 2.5, -1.25);
    const DisplacementField field = displacement_to_rest(result, lattice.voxels, 0);
    std::size_t found = 0;
    for (std::size_t n = 0; n < field.values.size(); ++n) {
      if (std::isnan(field.values[n][0])) continue;
      const Vec3 rest = lattice.voxels.center(lattice.voxels.index(n)) + field.values[n].cast<double>();
      const Index3 voxel = nearest_voxel(lattice.voxels.continuous_index(rest));
      if (!lattice.voxels.contains(voxel)) continue;
      const bool is_first = lattice.labels[lattice.voxels.offset(voxel)] == 1;
      EXPECT_NEAR(field.values[n][1], is_first ? -2.5 : 1.25, 1e-5) << "level " << l;
      ++found;
    }
    EXPECT_GT(found, 4000U);
  }
}

}  // namespace test_split_cells
