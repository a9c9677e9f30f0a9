// SPDX-License-Identifier: Apache-2.0
// Run by mpiexec with several processes, which all pass or fail together; see test_shared_nodes.cpp.
#include <gtest/gtest.h>
#include <petscsys.h>

#include <algorithm>
#include <map>

#include "distributed/node_subdomain.h"
#include "distributed/part_hierarchy.h"
#include "distributed/shared_nodes.h"

using namespace hexsolver;
using namespace hexsolver::mpi;

namespace {

/// A block with a slit and holes, and towards one side so sparse that it falls into parts, small ones among them.
std::vector<Index3> crumbling_block() {
  std::vector<Index3> out;
  std::uint32_t state = 7;
  for (std::int32_t k = 0; k < 18; ++k)
    for (std::int32_t j = 0; j < 20; ++j)
      for (std::int32_t i = 0; i < 44; ++i) {
        state = state * 1664525U + 1013904223U;
        const double number = static_cast<double>(state >> 8) / (1U << 24);
        const bool in_slit = (i == 11 && j < 15) || (k == 9 && i < 20 && j > 2);
        if (!in_slit && number < (i < 24 ? 0.95 : 0.6 - 0.028 * (i - 24))) out.push_back({i, j, k});
      }
  return out;
}

const Mat3 edges = Mat3::Identity();
const Vec3 corner = Vec3::Zero();

/// What make_part_hierarchy() makes of the cells of this process.
Hierarchy hierarchy_of_part(const Processes& all, const std::vector<Index3>& cells, const SharedMerges& merges) {
  std::vector<Index3> blocks;
  for (const Index3& c : cells) blocks.push_back(hexmesh::coarser_index(c, merges.block));
  // The first has read all cells, and tells.
  const std::vector<int> goes_to =
      all.gather(partition_along_curve(all, all.is_first() ? blocks : std::vector<Index3>()));
  std::vector<Index3> own;
  Index3 low = {1000, 1000, 1000};
  for (std::size_t c = 0; c < cells.size(); ++c)
    if (goes_to[c] == all.rank()) {
      own.push_back(cells[c]);
      for (std::size_t d = 0; d < 3; ++d) low[d] = std::min(low[d], cells[c][d]);
    }
  for (std::size_t d = 0; d < 3; ++d) low[d] -= low[d] % merges.block[d];
  KeyedCells keys;
  for (const Index3& c : own) keys.cells.push_back({c});
  const Vec3 origin(low[0], low[1], low[2]);
  Mesh mesh = keys.make_mesh(low, edges, origin);
  return make_part_hierarchy(all, std::move(mesh), keys.nodes, low, origin, corner, merges);
}

/// Nodes of cells are the same ones, whatever their numbers.
void expect_same_mesh(const Mesh& a, const Mesh& b) {
  ASSERT_EQ(a.cells(), b.cells());
  EXPECT_EQ(a.nodes(), b.nodes());
  std::map<std::int32_t, std::int32_t> b_of_a, a_of_b;
  std::size_t differing = 0;
  for (std::size_t c = 0; c < a.num_cells(); ++c)
    for (std::size_t n = 0; n < 8; ++n) {
      const std::int32_t of_a = a.cell_nodes()[c][n], of_b = b.cell_nodes()[c][n];
      differing += b_of_a.try_emplace(of_a, of_b).first->second != of_b;
      differing += a_of_b.try_emplace(of_b, of_a).first->second != of_a;
    }
  EXPECT_EQ(differing, 0U);
}

SharedMerges cubic_merges(int count) {
  SharedMerges out;
  for (int n = 0; n < count; ++n) {
    out.factors.push_back({2, 2, 2});
    for (std::int32_t& b : out.block) b *= 2;
  }
  return out;
}

}  // namespace

TEST(PartHierarchy, CoarseNodesOverGapsAreThoseOfOneProcess) {
  const Processes all(PETSC_COMM_WORLD);
  const std::vector<Index3> cells = crumbling_block();
  const Hierarchy whole(Mesh(cells, edges, corner), corner);
  // Not what merging by index would find: gaps are open, and small parts there were.
  EXPECT_GT(whole.meshes[1].num_nodes(), hexmesh::number_nodes(whole.meshes[1].cells()).nodes.size());
  EXPECT_GT(whole.meshes[2].num_nodes(), hexmesh::number_nodes(whole.meshes[2].cells()).nodes.size());
  EXPECT_LT(whole.meshes[1].num_nodes(), hexmesh::number_linked_parent_nodes(
                                             whole.merges[0], whole.meshes[0].cell_nodes(), whole.meshes[0].num_nodes())
                                             .nodes.size());
  for (const int count : {1, 2, 3}) {
    SCOPED_TRACE(count);
    const Hierarchy part = hierarchy_of_part(all, cells, cubic_merges(count));
    ASSERT_EQ(part.meshes.size(), whole.meshes.size());
    EXPECT_EQ(all.sum(part.meshes[0].num_cells()), cells.size());
    for (std::size_t l = 0; l < part.meshes.size(); ++l) {
      SCOPED_TRACE(l);
      if (static_cast<int>(l) < count) {
        ASSERT_NE(part.subdomain(l), nullptr);
        const NodeVector one = NodeVector::Ones(static_cast<Eigen::Index>(part.meshes[l].num_dofs()));
        EXPECT_EQ(part.subdomain(l)->dot(one, one), static_cast<double>(whole.meshes[l].num_dofs()));
      } else {
        EXPECT_EQ(part.subdomain(l), nullptr);
        expect_same_mesh(part.meshes[l], whole.meshes[l]);
      }
    }
  }
}

TEST(PartHierarchy, ProlongationAndRestrictionAreThoseOfOneProcess) {
  const Processes all(PETSC_COMM_WORLD);
  const std::vector<Index3> cells = crumbling_block();
  const Hierarchy whole(Mesh(cells, edges, corner), corner);
  const Hierarchy part = hierarchy_of_part(all, cells, cubic_merges(2));
  // From the first level that all have down to the finest and back: numbers that belong to coarse nodes.
  const auto there_and_back = [](const Hierarchy& h, const NodeVector& coarse) {
    NodeVector middle, fine, out;
    h.prolongations[1].prolongate(coarse, middle);
    h.prolongations[0].prolongate(middle, fine);
    if (h.subdomain(0)) h.subdomain(0)->keep_own(fine);
    h.prolongations[0].restrict_to(fine, middle);
    if (h.subdomain(1)) h.subdomain(1)->add_up(middle);
    if (h.subdomain(1)) h.subdomain(1)->keep_own(middle);
    h.prolongations[1].restrict_to(middle, out);
    if (h.subdomain(1)) h.subdomain(1)->sum(std::span<double>(out.data(), static_cast<std::size_t>(out.size())));
    return out;
  };
  const Mesh &a = whole.meshes[2], &b = part.meshes[2];
  NodeVector of_whole = NodeVector::Random(static_cast<Eigen::Index>(a.num_dofs())), of_part = of_whole;
  const auto copy = [&](const NodeVector& from, const Mesh& mesh_of, const Mesh& mesh_to, NodeVector& to) {
    for (std::size_t c = 0; c < mesh_of.num_cells(); ++c)
      for (std::size_t n = 0; n < 8; ++n)
        to.segment<3>(3 * Eigen::Index{mesh_to.cell_nodes()[c][n]}) =
            from.segment<3>(3 * Eigen::Index{mesh_of.cell_nodes()[c][n]});
  };
  copy(of_whole, a, b, of_part);
  const NodeVector expected = there_and_back(whole, of_whole), got = there_and_back(part, of_part);
  NodeVector as_whole = got;
  copy(got, b, a, as_whole);
  EXPECT_LT((as_whole - expected).lpNorm<Eigen::Infinity>(), 1e-12 * expected.lpNorm<Eigen::Infinity>());
}

TEST(NodeSubdomain, SumsAreTheSameToTheLastBitForAllThatHaveANode) {
  const Processes all(PETSC_COMM_WORLD);
  // A node for all, one for each two neighbouring processes, and one that nobody else has.
  const auto rank = static_cast<std::uint64_t>(all.rank());
  const std::vector<NodeName> names = {{0}, {100 + rank}, {101 + rank}, {1000 + rank}};
  const NodeSubdomain part(all, names, {0, 0, 0});
  NodeVector v = NodeVector::Zero(12);
  for (Eigen::Index d = 0; d < 3; ++d)
    for (Eigen::Index n = 0; n < 4; ++n) v[3 * n + d] = 1.0 / (3 + static_cast<double>(rank)) + 1e-3 * d;
  const double alone = v[9];
  part.add_up(v);
  EXPECT_EQ(v[9], alone);
  EXPECT_EQ(all.least(v[0]), all.largest(v[0]));
  struct Told {
    std::uint64_t place;
    double value;
  };
  std::map<std::uint64_t, double> of_place;
  for (const Told& t :
       all.gather(std::vector<Told>{{names[0].place, v[0]}, {names[1].place, v[3]}, {names[2].place, v[6]}}))
    EXPECT_EQ(of_place.try_emplace(t.place, t.value).first->second, t.value);
  double sum = 0;
  for (int p = 0; p < all.count(); ++p) sum += 1.0 / (3 + p);
  EXPECT_NEAR(v[0], sum, 1e-12);
}
