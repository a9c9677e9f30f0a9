// SPDX-License-Identifier: Apache-2.0
// A program of somebody else: a bar of voxels is stretched, by what is installed alone. Its answer is known.
#include <hexmesh/file/lattice_file.h>
#include <hexmesh/file/result_file.h>
#include <hexmesh/lattice/lattice.h>
#include <hexsolver/equilibrium/equilibrium.h>

#include <cmath>
#include <cstdio>
#include <filesystem>

namespace {

using hexmesh::Vec3;

/// Where a face of the bar holds it along one axis.
hexsolver::Condition held(const char* name, const Vec3& point, const Vec3& normal, int axis, double by) {
  hexsolver::Condition c;
  c.name = c.where = name;
  c.selection.halfspace = hexsolver::HalfSpace{point, normal};
  c.selection.on = hexsolver::SurfacePoints::nodes;
  c.axes = {axis == 0, axis == 1, axis == 2};
  c.by[axis] = by;
  return c;
}

bool is_near(const char* what, double value, double expected) {
  const bool is_right = std::abs(value - expected) <= 1e-7 * std::abs(expected);
  std::printf("%s %.9g, expected %.9g%s\n", what, value, expected, is_right ? "" : ": WRONG");
  return is_right;
}

}  // namespace

int main() {
  constexpr double length = 16, width = 8, stretch = 0.01, young = 0.1, poisson = 0.3;  // mm, MPa
  hexmesh::LabelVolume scan{hexmesh::Grid({8, 4, 4}, {2, 2, 2}, {1, 1, 1}), {}, {{1, "bar"}}};
  scan.labels.assign(scan.grid.num_voxels(), 1);
  hexmesh::LatticeSegment bar{scan.segments[0], hexmesh::Material{}};
  bar.material->young = young;
  bar.material->poisson = poisson;
  const hexmesh::Lattice built = hexmesh::build_lattice(scan, {bar});
  hexmesh::write_lattice(built, "bar.hexmesh");
  const hexmesh::Lattice lattice = hexmesh::read_lattice("bar.hexmesh");

  hexsolver::Scene scene;
  scene.elasticity = hexsolver::Elasticity::cauchy;
  scene.tolerance = 1e-10;
  scene.conditions = {held("left", {0, 0, 0}, {-1, 0, 0}, 0, 0), held("right", {length, 0, 0}, {1, 0, 0}, 0, 0.16),
                      held("front", {0, 0, 0}, {0, -1, 0}, 1, 0), held("bottom", {0, 0, 0}, {0, 0, -1}, 2, 0)};
  bool is_right = true;
  for (const int level : {0, 1}) {
    const auto [result, report] = hexsolver::solve_equilibrium(lattice, scene, level);
    std::printf("level %d: %s\n", level, report.reason.c_str());
    hexmesh::write_result(result, "bar.hexresult");
    const hexmesh::Result read = hexmesh::read_result("bar.hexresult");
    std::filesystem::remove("bar.hexresult");
    is_right = report.converged && is_right;
    is_right = is_near("pull [N]", report.conditions[1].reaction_n[0], young * width * width * stretch) && is_right;
    for (std::size_t n = 0; n < read.nodes.size(); ++n)
      if ((read.nodes[n] - Vec3(length, width, width)).norm() < 1e-9)
        is_right = is_near("side [mm]", read.displacement[n][1], -poisson * stretch * width) && is_right;
  }
  return is_right ? 0 : 1;
}
