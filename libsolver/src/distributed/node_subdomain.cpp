// SPDX-License-Identifier: Apache-2.0
#include "distributed/node_subdomain.h"

#include <algorithm>
#include <map>

namespace hexsolver::mpi {
namespace {

MPI_Datatype type_of(double) { return MPI_DOUBLE; }
MPI_Datatype type_of(float) { return MPI_FLOAT; }

/// Another process that has a node, told by the one that was asked of it.
struct Holder {
  std::int32_t asked;  ///< place of the node among those asked of the process
  std::int32_t rank;
};

/// Which process is asked of a node.
std::size_t asked_of(const NodeName& name, std::size_t count) {
  constexpr std::uint64_t mixer = 0x9E3779B97F4A7C15;  // Knuth's multiplicative hashing
  return static_cast<std::size_t>(((name.place + static_cast<std::uint64_t>(name.number)) * mixer >> 32) % count);
}

/// To each process: who else has the nodes that it asks of.
std::vector<std::vector<Holder>> other_holders(const std::vector<std::vector<NodeName>>& asked) {
  struct Entry {
    NodeName name;
    std::int32_t rank, place;
  };
  std::vector<Entry> entries;
  for (std::size_t p = 0; p < asked.size(); ++p)
    for (std::size_t n = 0; n < asked[p].size(); ++n)
      entries.push_back({asked[p][n], static_cast<std::int32_t>(p), static_cast<std::int32_t>(n)});
  std::stable_sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) { return a.name < b.name; });
  std::vector<std::vector<Holder>> out(asked.size());
  for (std::size_t begin = 0, end = 0; begin < entries.size(); begin = end) {
    while (end < entries.size() && entries[end].name == entries[begin].name) ++end;
    for (std::size_t a = begin; a < end; ++a)
      for (std::size_t b = begin; b < end; ++b)
        if (a != b) out[static_cast<std::size_t>(entries[a].rank)].push_back({entries[a].place, entries[b].rank});
  }
  return out;
}

}  // namespace

NodeSubdomain::NodeSubdomain(const Processes& all, const std::vector<NodeName>& names, const Index3& low)
    : Subdomain(low), all_(all) {
  const auto count = static_cast<std::size_t>(all.count());
  std::vector<std::vector<NodeName>> to(count);
  std::vector<std::vector<std::int32_t>> nodes(count);
  for (std::size_t n = 0; n < names.size(); ++n) {
    const std::size_t process = asked_of(names[n], count);
    to[process].push_back(names[n]);
    nodes[process].push_back(static_cast<std::int32_t>(n));
  }
  const auto answers = all.exchange(other_holders(all.exchange(to)));
  std::map<std::int32_t, std::vector<std::int32_t>> nodes_with;
  for (std::size_t p = 0; p < count; ++p)
    for (const Holder& h : answers[p]) {
      const std::int32_t node = nodes[p][static_cast<std::size_t>(h.asked)];
      nodes_with[h.rank].push_back(node);
      shared_.push_back(node);
      if (h.rank < all.rank()) of_others_.push_back(node);
    }
  for (std::vector<std::int32_t>* list : {&shared_, &of_others_}) {
    std::sort(list->begin(), list->end());
    list->erase(std::unique(list->begin(), list->end()), list->end());
  }
  for (auto& [rank, list] : nodes_with) {
    std::sort(list.begin(), list.end(), [&](std::int32_t a, std::int32_t b) {
      return names[static_cast<std::size_t>(a)] < names[static_cast<std::size_t>(b)];
    });
    neighbours_.push_back({rank, std::move(list)});
  }
}

/// The values of a node are summed in the order of ranks, by all that have it.
template <class Real>
void NodeSubdomain::add_up(Real* values, std::size_t per_node, Space<Real>& space) const {
  const auto at = [&](std::int32_t node) { return values + per_node * static_cast<std::size_t>(node); };
  space.own.clear();
  space.sent.clear();
  for (const std::int32_t node : shared_) space.own.insert(space.own.end(), at(node), at(node) + per_node);
  for (const Neighbour& n : neighbours_)
    for (const std::int32_t node : n.nodes) space.sent.insert(space.sent.end(), at(node), at(node) + per_node);
  space.received.resize(space.sent.size());
  constexpr int tag = 17;
  std::vector<MPI_Request> requests;
  std::size_t begin = 0;
  for (const Neighbour& n : neighbours_) {
    const std::size_t size = per_node * n.nodes.size();
    MPI_Irecv(space.received.data() + begin, static_cast<int>(size), type_of(Real{}), n.rank, tag, all_.comm(),
              &requests.emplace_back());
    MPI_Isend(space.sent.data() + begin, static_cast<int>(size), type_of(Real{}), n.rank, tag, all_.comm(),
              &requests.emplace_back());
    begin += size;
  }
  MPI_Waitall(static_cast<int>(requests.size()), requests.data(), MPI_STATUSES_IGNORE);

  for (const std::int32_t node : shared_) std::fill(at(node), at(node) + per_node, Real{0});
  const Real* from = space.received.data();
  bool has_own = false;
  const auto add_own = [&] {
    const Real* own = space.own.data();
    for (const std::int32_t node : shared_)
      for (std::size_t d = 0; d < per_node; ++d) at(node)[d] += *own++;
    has_own = true;
  };
  for (const Neighbour& n : neighbours_) {
    if (!has_own && n.rank > all_.rank()) add_own();
    for (const std::int32_t node : n.nodes)
      for (std::size_t d = 0; d < per_node; ++d) at(node)[d] += *from++;
  }
  if (!has_own) add_own();
}

void NodeSubdomain::add_up(NodeVector& v) const { add_up(v.data(), 3, doubles_); }
void NodeSubdomain::add_up(FloatNodeVector& v) const { add_up(v.data(), 3, floats_); }
void NodeSubdomain::add_up(std::vector<Mat3>& of_nodes) const {
  static_assert(sizeof(Mat3) == 9 * sizeof(double));
  if (!of_nodes.empty()) add_up(of_nodes[0].data(), 9, doubles_);
}

}  // namespace hexsolver::mpi
