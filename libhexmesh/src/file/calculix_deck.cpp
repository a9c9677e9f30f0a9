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

/// Names of sets have no blanks and no other signs.
std::string set_name(const std::string& name, std::size_t number) {
  std::string out = fmt::format("S{}_", number);
  for (const char c : name) out += std::isalnum(static_cast<unsigned char>(c)) ? c : '_';
  return out.substr(0, 60);
}

}  // namespace

void write_calculix_deck(const Result& result, const std::filesystem::path& path) {
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
