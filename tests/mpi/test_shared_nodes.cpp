// SPDX-License-Identifier: Apache-2.0
// Run by mpiexec with several processes, which all pass or fail together.
#include <gtest/gtest.h>
#include <petscsys.h>

#include <algorithm>
#include <map>
#include <set>

#include "distributed/shared_nodes.h"
#include "hexmesh/lattice/nodes.h"
#include "support/bodies.h"
#include "support/files.h"

using namespace hexsolver::mpi;
using testing_support::bitten_ball;

namespace {

struct Ball {
  std::vector<Index3> cells = bitten_ball({1, 1, 1}).levels[0].cells;
  std::vector<Index3> nodes = hexmesh::number_nodes(cells).nodes;
};

/// Two nodes at some of the indices.
std::vector<Key> keys_of(const std::vector<Index3>& nodes) {
  std::vector<Key> out;
  for (const Index3& node : nodes) {
    out.push_back({node});
    if ((node[0] + node[1] + node[2]) % 5 == 0) out.push_back({node, 1});
  }
  return out;
}

std::vector<std::uint64_t> first_rows(const std::vector<Index3>& cells) {
  std::vector<std::uint64_t> rows(static_cast<std::size_t>(hexmesh::extent_of(cells)[2]) + 1);
  for (const Index3& c : cells) ++rows[static_cast<std::size_t>(c[2]) + 1];
  for (std::size_t k = 1; k < rows.size(); ++k) rows[k] += rows[k - 1];
  return rows;
}

/// The cells that this process gets of those that it read: every so-manieth.
std::vector<Index3> part_of(const Processes& all, const std::vector<Index3>& cells) {
  std::vector<Index3> read;
  for (std::size_t c = 0; c < cells.size(); ++c)
    if (static_cast<int>(c) % all.count() == all.rank()) read.push_back(cells[c]);
  const std::vector<int> goes_to = partition_along_curve(all, read);
  std::vector<std::vector<Index3>> to(static_cast<std::size_t>(all.count()));
  for (std::size_t c = 0; c < read.size(); ++c) to[static_cast<std::size_t>(goes_to[c])].push_back(read[c]);
  std::vector<Index3> own;
  for (const auto& from : all.exchange(to)) own.insert(own.end(), from.begin(), from.end());
  return own;
}

}  // namespace

TEST(Partition, EveryCellGoesToOneProcessAndAllGetAsMany) {
  const Processes all(PETSC_COMM_WORLD);
  const Ball ball;
  const std::vector<Index3> own = part_of(all, ball.cells);
  EXPECT_LE(own.size(), ball.cells.size() / static_cast<std::size_t>(all.count()) + 1);
  std::vector<Index3> everybodys = all.gather(own), whole = ball.cells;
  std::sort(everybodys.begin(), everybodys.end());
  std::sort(whole.begin(), whole.end());
  EXPECT_EQ(everybodys, whole);
}

TEST(Partition, PartsAreCompact) {
  const Processes all(PETSC_COMM_WORLD);
  const Ball ball;
  const std::vector<Index3> own = part_of(all, ball.cells);
  // Nodes that processes share are few beside those inside: a random division would share nearly all.
  const auto nodes = static_cast<double>(hexmesh::number_nodes(own).nodes.size());
  EXPECT_LT(all.sum(nodes), 1.6 * static_cast<double>(ball.nodes.size()));
}

TEST(SharedNodes, EveryNodeHasOneNumberAndOneOwner) {
  const Processes all(PETSC_COMM_WORLD);
  const Ball ball;
  const std::vector<Key> keys = keys_of(hexmesh::number_nodes(part_of(all, ball.cells)).nodes),
                         of_ball = keys_of(ball.nodes);
  const SharedNodes nodes(all, Layers(all, first_rows(ball.cells)), keys);
  EXPECT_EQ(static_cast<std::size_t>(nodes.num_all()), of_ball.size());
  EXPECT_EQ(all.sum(static_cast<double>(nodes.num_own())), nodes.num_all());
  // Whoever asks, the same node has the same number, and different ones different numbers.
  struct Named {
    Key key;
    PetscInt number;
  };
  std::vector<Named> own;
  for (std::size_t n = 0; n < keys.size(); ++n) own.push_back({keys[n], nodes.numbers()[n]});
  const auto comes_first = [](const Key& a, const Key& b) { return before(a, b); };
  std::map<Key, PetscInt, decltype(comes_first)> of_key(comes_first);
  std::set<PetscInt> numbers;
  for (const Named& n : all.gather(own)) {
    EXPECT_EQ(of_key.try_emplace(n.key, n.number).first->second, n.number);
    numbers.insert(n.number);
  }
  EXPECT_EQ(of_key.size(), of_ball.size());
  EXPECT_EQ(numbers.size(), of_ball.size());
  EXPECT_EQ(*numbers.begin(), 0);
  EXPECT_EQ(*numbers.rbegin(), nodes.num_all() - 1);
  const std::vector<PetscInt> found = nodes.find({of_ball.front(), {{1000, 0, 1000}}, of_ball.back()});
  EXPECT_EQ(found[0], of_key.at(of_ball.front()));
  EXPECT_EQ(found[1], -1);
  EXPECT_EQ(found[2], of_key.at(of_ball.back()));
}

TEST(Processes, AnErrorOfOneIsThrownByAll) {
  const Processes all(PETSC_COMM_WORLD);
  const std::string message = testing_support::message_of(hexmesh::ErrorKind::geometry, [&] {
    all.all_or_none([&] {
      if (all.rank() == all.count() - 1) throw hexmesh::Error(hexmesh::ErrorKind::geometry, "the last one's");
    });
  });
  EXPECT_EQ(message, "the last one's");
  all.all_or_none([] {});
}

int main(int argc, char** argv) {
  testing::InitGoogleTest(&argc, argv);
  PetscInitialize(&argc, &argv, nullptr, nullptr);
  const int failed = RUN_ALL_TESTS();
  PetscFinalize();
  return failed;
}
