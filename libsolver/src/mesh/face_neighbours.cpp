// SPDX-License-Identifier: Apache-2.0
#include "mesh/face_neighbours.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

namespace hexsolver {
namespace {

constexpr std::array<std::array<std::size_t, 4>, 6> corners_of_sides = {
    {{0, 2, 4, 6}, {1, 3, 5, 7}, {0, 1, 4, 5}, {2, 3, 6, 7}, {0, 1, 2, 3}, {4, 5, 6, 7}}};

constexpr double rounding = 1e-12;  // of weights

using Told = std::function<void(const SharedFace&)>;

/// Two cells share a face where they share its four nodes, which are in the same order on opposite sides.
void by_nodes(const Mesh& mesh, const Told& f) {
  struct Face {
    std::array<std::int32_t, 4> nodes;
    std::int32_t cell;
    int side;
  };
  std::vector<Face> faces;
  faces.reserve(6 * mesh.num_cells());
  for (std::size_t c = 0; c < mesh.num_cells(); ++c)
    for (int side = 0; side < 6; ++side) {
      Face& face = faces.emplace_back(Face{{}, static_cast<std::int32_t>(c), side});
      for (std::size_t n = 0; n < 4; ++n)
        face.nodes[n] = mesh.cell_nodes()[c][corners_of_sides[static_cast<std::size_t>(side)][n]];
    }
  std::sort(faces.begin(), faces.end(),
            [](const Face& a, const Face& b) { return std::tie(a.nodes, a.cell) < std::tie(b.nodes, b.cell); });
  for (std::size_t n = 1; n < faces.size(); ++n)
    for (std::size_t before = n; before-- > 0 && faces[before].nodes == faces[n].nodes;)
      f({faces[n].cell, faces[n].side, faces[before].cell, faces[before].side});
}

/// Cells of several sizes.
void by_places(const Mesh& mesh, const Told& f) {
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
    const Index3& size = mesh.sizes()[mesh.size_of(c)].size;
    for (int side = 0; side < 6; ++side) {
      const auto axis = static_cast<std::size_t>(side / 2);
      Index3 beyond = mesh.nodes()[mesh.node(c, 0)];
      beyond[axis] += side % 2 == 1 ? size[axis] : -1;
      const auto [first, end] = cells_at(beyond, mesh.cells(), mesh.sizes());
      for (std::int32_t other = first; other < end; ++other) {
        const auto o = hexmesh::as_size(other);
        const bool is_its_turn =
            mesh.size_of(o) > mesh.size_of(c) || (mesh.size_of(o) == mesh.size_of(c) && side % 2 == 1);
        const auto is_held = [&](std::size_t corner) { return holds_node(mesh, o, mesh.node(c, corner)); };
        const auto& corners = corners_of_sides[static_cast<std::size_t>(side)];
        if (is_its_turn && (!mesh.is_graded_and_split() || std::all_of(corners.begin(), corners.end(), is_held)))
          f({static_cast<std::int32_t>(c), side, other, side ^ 1});
      }
    }
  }
}

}  // namespace

bool holds_node(const Mesh& mesh, std::size_t cell, std::size_t node) {
  std::map<std::int32_t, double> difference;
  mesh.for_each_free(node, [&](std::int32_t n, double weight) { difference[n] -= weight; });
  const NodeWeights weights =
      hexmesh::shape_functions(local_in(mesh.nodes()[node], mesh.cells()[cell], mesh.sizes()[mesh.size_of(cell)].size));
  for (std::size_t a = 0; a < 8; ++a) {
    const double of_corner = weights[static_cast<Eigen::Index>(a)];
    if (of_corner != 0)
      mesh.for_each_free(cell, a, [&](std::int32_t n, double weight) { difference[n] += of_corner * weight; });
  }
  return std::all_of(difference.begin(), difference.end(),
                     [](const auto& of_node) { return std::abs(of_node.second) < rounding; });
}

void for_each_shared_face(const Mesh& mesh, const Told& f) {
  mesh.is_graded() ? by_places(mesh, f) : by_nodes(mesh, f);
}

}  // namespace hexsolver
