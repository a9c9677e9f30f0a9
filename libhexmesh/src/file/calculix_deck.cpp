// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/file/calculix_deck.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>

#include "hexmesh/core/error.h"
#include "hexmesh/file/text_file.h"

namespace hexmesh {
namespace {

[[noreturn]] void fail(const std::string& what) {
  throw Error(ErrorKind::input, fmt::format("a deck of finite elements cannot be written: {}", what));
}

void check(const Result& result) {
  if (result.cell_fields.contains("cell_level"))
    fail("the result is of graded cells, expected one of cells alike (solve.grading = \"off\")");
  const auto fill = result.cell_fields.find("fill");
  if (fill != result.cell_fields.end() &&
      std::any_of(fill->second.begin(), fill->second.end(), [](double f) { return f < 1; }))
    fail(fmt::format("level {} has partly filled cells, expected full ones, as at level 0", result.level));
  for (const auto& [name, of] : {std::pair{"young_modulus", &Material::young}, {"poisson_ratio", &Material::poisson}}) {
    const auto field = result.cell_fields.find(name);
    for (const LatticeSegment& s : result.segments)
      for (std::size_t c = 0; field != result.cell_fields.end() && s.material && c < result.cells.size(); ++c)
        if (result.segment[c] == s.segment.label && std::abs(field->second[c] / (*s.material).*of - 1) > 1e-9 &&
            std::abs(field->second[c] - (*s.material).*of) > 1e-9)
          fail(fmt::format("segment '{}' has cells of {} {:g} and {:g}, expected one material per segment",
                           s.segment.name, name, (*s.material).*of, field->second[c]));
  }
}

/// Lattice nodes by their positions.
class NodeFinder {
public:
  explicit NodeFinder(const Result& result) : result_(result) {
    for (std::size_t n = 0; n < result.nodes.size(); ++n) number_[key(result.nodes[n])] = n;
  }

  std::size_t at(const Vec3& position, const std::string& condition) const {
    const auto found = number_.find(key(position));
    if (found == number_.end())
      fail(fmt::format("condition '{}' holds points between the lattice nodes, expected on = \"nodes\"", condition));
    return found->second;
  }

private:
  std::array<long, 3> key(const Vec3& p) const {
    const Vec3 i = 4 * result_.voxels.continuous_index(p);
    return {std::lround(i[0]), std::lround(i[1]), std::lround(i[2])};
  }

  const Result& result_;
  std::map<std::array<long, 3>, std::size_t> number_;
};

/// The centre of an outer face that an obstacle may touch.
struct GapPoint {
  std::array<std::int32_t, 4> corners;
  Vec3 rest;
  Vec3 normal;       ///< out of the obstacle
  double clearance;  ///< at rest along it [mm]
  double stiffness;  ///< of what it meets [N/mm]
};

/// Corners of the faces that one cell alone has.
std::vector<std::pair<std::size_t, std::array<std::int32_t, 4>>> outer_faces(const Result& result) {
  constexpr std::array<std::array<std::size_t, 4>, 6> corners_of_face = {
      {{0, 2, 4, 6}, {1, 3, 5, 7}, {0, 1, 4, 5}, {2, 3, 6, 7}, {0, 1, 2, 3}, {4, 5, 6, 7}}};
  std::map<std::array<std::int32_t, 4>, std::pair<std::size_t, int>> cells_at;  ///< the last, and how many
  for (std::size_t c = 0; c < result.cells.size(); ++c)
    for (const std::array<std::size_t, 4>& face : corners_of_face) {
      std::array<std::int32_t, 4> nodes{};
      for (std::size_t n = 0; n < 4; ++n) nodes[n] = static_cast<std::int32_t>(result.cell_nodes[c][face[n]]);
      std::sort(nodes.begin(), nodes.end());
      std::pair<std::size_t, int>& at = cells_at[nodes];
      at = {c, at.second + 1};
    }
  std::vector<std::pair<std::size_t, std::array<std::int32_t, 4>>> out;
  for (const auto& [nodes, at] : cells_at)
    if (at.second == 1) out.emplace_back(at.first, nodes);
  return out;
}

std::vector<GapPoint> gap_points(const Result& result, const std::vector<DeckObstacle>& obstacles) {
  constexpr double reach_in_voxels = 2;
  constexpr double hardness = 1e6;  // times what a voxel resists: what a face sinks in is that part of its strain
  std::vector<GapPoint> out;
  if (obstacles.empty()) return out;
  std::map<std::int32_t, double> young_of;
  for (const LatticeSegment& s : result.segments)
    if (s.material) young_of[s.segment.label] = s.material->young;
  const double edge = result.voxels.spacing().maxCoeff();
  for (const auto& [cell, corners] : outer_faces(result)) {
    const auto young = young_of.find(result.segment[cell]);
    if (young == young_of.end()) continue;
    Vec3 rest = Vec3::Zero(), moved = Vec3::Zero();
    for (const std::int32_t n : corners) {
      rest += 0.25 * result.nodes[as_size(n)];
      moved += 0.25 * result.displacement[as_size(n)];
    }
    for (const DeckObstacle& obstacle : obstacles) {
      const Gap gap = gap_to(obstacle.solid, rest + moved);
      if (gap.depth > reach_in_voxels * edge) continue;
      const double hard = hardness * young->second * edge;
      out.push_back({corners, rest, gap.normal, gap.depth - gap.normal.dot(moved),
                     obstacle.stiffness > 0 ? obstacle.stiffness : hard});
    }
  }
  return out;
}

/// Names of sets have no blanks and no other signs.
std::string set_name(const std::string& name, std::size_t number) {
  std::string out = fmt::format("S{}_", number);
  for (const char c : name) out += std::isalnum(static_cast<unsigned char>(c)) ? c : '_';
  return out.substr(0, 60);
}

}  // namespace

void write_calculix_deck(const Result& result, const std::vector<DeckObstacle>& obstacles,
                         const std::filesystem::path& path) {
  check(result);
  const NodeFinder nodes(result);
  // Before anything is written: the nodes of all conditions; where they share one, the last says where it goes.
  std::map<std::pair<std::size_t, int>, double> prescribed;
  for (const ConditionPoints& c : result.conditions)
    for (std::size_t p = 0; p < c.points.size(); ++p)
      for (int d = 0; d < 3; ++d)
        if (c.axes[d]) prescribed[{nodes.at(c.points[p], c.name), d}] = c.displacement[p][d];

  std::string text;
  const auto print = [&]<class... Args>(fmt::format_string<Args...> format, Args&&... args) {
    fmt::format_to(std::back_inserter(text), format, std::forward<Args>(args)...);
  };
  print("** mm, N, MPa; positions are patient LPS\n");
  for (const std::string& line : result.history)
    print("** {}\n", line.substr(0, std::min<std::size_t>(120, line.find('\n'))));
  print("*NODE, NSET=ALL\n");
  for (std::size_t n = 0; n < result.nodes.size(); ++n)
    print("{}, {:.9g}, {:.9g}, {:.9g}\n", n + 1, result.nodes[n][0], result.nodes[n][1], result.nodes[n][2]);
  for (std::size_t s = 0; s < result.segments.size(); ++s) {
    const LatticeSegment& segment = result.segments[s];
    if (!segment.material) continue;
    const std::string set = set_name(segment.segment.name, s + 1);
    print("*ELEMENT, TYPE=C3D8, ELSET={}\n", set);
    for (std::size_t c = 0; c < result.cells.size(); ++c) {
      if (result.segment[c] != segment.segment.label) continue;
      print("{}", c + 1);
      for (const std::size_t corner : corners_around_faces) print(", {}", result.cell_nodes[c][corner] + 1);
      print("\n");
    }
    print("*MATERIAL, NAME={0}\n*ELASTIC\n{1:.9g}, {2:.9g}\n*SOLID SECTION, ELSET={0}, MATERIAL={0}\n", set,
          segment.material->young, segment.material->poisson);
  }
  const std::vector<GapPoint> gaps = gap_points(result, obstacles);
  // Of each gap the node on the face, then the one that stands for the obstacle.
  const auto number_of = [&](std::size_t gap) { return result.nodes.size() + 2 * gap + 1; };
  if (!gaps.empty()) {
    print("** Without a law that yields CalculiX solves no gap.\n*MATERIAL, NAME=ITERATE\n*ELASTIC\n1., 0.\n");
    print("*PLASTIC\n1.e20, 0.\n*NODE\n");
    for (std::size_t g = 0; g < gaps.size(); ++g) {
      const Vec3 facing = gaps[g].rest - gaps[g].clearance * gaps[g].normal;
      print("{}, {:.9g}, {:.9g}, {:.9g}\n", number_of(g), gaps[g].rest[0], gaps[g].rest[1], gaps[g].rest[2]);
      print("{}, {:.9g}, {:.9g}, {:.9g}\n", number_of(g) + 1, facing[0], facing[1], facing[2]);
    }
  }
  for (std::size_t g = 0; g < gaps.size(); ++g) {
    const GapPoint& gap = gaps[g];
    for (int d = 1; d <= 3; ++d) {
      print("*EQUATION\n5\n{}, {}, 1.", number_of(g), d);
      for (const std::int32_t n : gap.corners) print(", {}, {}, -0.25", n + 1, d);
      print("\n");
    }
    print("*ELEMENT, TYPE=GAPUNI, ELSET=G{}\n{}, {}, {}\n", g + 1, result.cells.size() + g + 1, number_of(g) + 1,
          number_of(g));
    constexpr double pull = 1e-15;  // where it is open, as a part of what the spring exerts when it is closed by 1 mm
    print("*GAP, ELSET=G{}\n{:.12g}, {:.12g}, {:.12g}, {:.12g}, , {:.9g}, {:.9g}\n", g + 1, gap.clearance,
          gap.normal[0], gap.normal[1], gap.normal[2], gap.stiffness, pull * gap.stiffness);
  }
  if (!gaps.empty()) print("*BOUNDARY\n");
  for (std::size_t g = 0; g < gaps.size(); ++g) print("{}, 1, 3\n", number_of(g) + 1);
  print("*STEP\n*STATIC\n*BOUNDARY\n");
  for (const auto& [dof, value] : prescribed)
    print("{}, {}, {}, {:.9g}\n", dof.first + 1, dof.second + 1, dof.second + 1, value);
  if (!result.load.empty()) print("*CLOAD\n");
  for (std::size_t n = 0; n < result.load.size(); ++n)
    for (int d = 0; d < 3; ++d)
      if (result.load[n][d] != 0) print("{}, {}, {:.12g}\n", n + 1, d + 1, result.load[n][d]);
  print("*NODE PRINT, NSET=ALL\nU\n*END STEP\n");
  write_whole_file(path, text);
}

}  // namespace hexmesh
