// SPDX-License-Identifier: Apache-2.0
#include "experiments.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>

#include "files.h"
#include "hexbench/statistics.h"
#include "hexmesh/lattice/locator.h"
#include "hexmesh/scan/image_io.h"
#include "support/solve.h"

namespace testing_support {

using namespace hexsolver;

bool has_scan() { return std::filesystem::exists(shared_data() / "data/totalsegmentator/example_seg.nii.gz"); }

bool has_references() { return has_scan() && std::filesystem::exists(shared_data() / "reference"); }

Scene with(std::vector<Condition> conditions, Elasticity elasticity) {
  Scene scene;
  scene.elasticity = elasticity;
  if (elasticity == Elasticity::green_lagrange) scene.volumetric = Volumetric::full;
  scene.conditions = std::move(conditions);
  scene.error_estimation = ErrorEstimation::off;
  return scene;
}

Lattice liver_of_scan(double poisson) {
  std::vector<hexmesh::Overlap> none;
  const auto scan = shared_data() / "data/totalsegmentator/example_seg.nii.gz";
  return lattice_of(
      hexmesh::flatten(hexmesh::select_segments(hexmesh::read_segmentation({scan}), {{"5", "liver"}}), {}, none), 100,
      poisson);
}

double growth_half_way(const hexmesh::Result& result, double radius) {
  const std::vector<Vec3> rim = circle(radius), u = displacement_at(result, rim);
  double sum = 0;
  for (std::size_t n = 0; n < rim.size(); ++n) sum += u[n].head<2>().dot(rim[n].head<2>()) / radius;
  return sum / static_cast<double>(rim.size());
}

std::vector<Condition> liver_patches(double radius, SurfacePoints on) {
  return {patch("right_lateral", {-138.54367, -138.819, 155.80176}, radius, Vec3::Zero(), on),
          patch("posterior", {-81.54367, -84.819, 149.80176}, radius, Vec3::Zero(), on),
          patch("inferior_right", {-84.54367, -180.819, 92.80176}, radius, Vec3::Zero(), on),
          patch("left_lobe_tip", {56.45633, -222.819, 176.80176}, radius, {0, -28.284271, -28.284271}, on)};
}

std::vector<Vec3> displacement_at(const hexmesh::Result& result, const std::vector<Vec3>& points) {
  const hexmesh::CellLocator locator = hexmesh::locator_of(result);
  for (const Vec3& p : points) {
    const bool is_in_a_cell = locator.locate_position(p).cell >= 0;
    EXPECT_TRUE(is_in_a_cell) << p.transpose();
    if (!is_in_a_cell) return {};
  }
  return hextools::displacement_at(result, points);
}

std::vector<NodeRow> read_reference(const std::filesystem::path& gzipped_csv) {
  std::istringstream rows(shell("gzip -dc '" + gzipped_csv.string() + "'").output);
  std::vector<NodeRow> out;
  std::string line;
  std::getline(rows, line);
  while (std::getline(rows, line)) {
    std::replace(line.begin(), line.end(), ',', ' ');
    std::istringstream values(line);
    long node = 0;
    NodeRow row;
    values >> node;
    for (Vec3* v : {&row.position, &row.displacement}) values >> (*v)[0] >> (*v)[1] >> (*v)[2];
    EXPECT_TRUE(values) << line;
    out.push_back(row);
  }
  return out;
}

Distance distance(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
  const hextools::Distances d = hextools::distances(a, b);
  return {d.mean, d.max};
}

std::vector<NodeRow> within(const Lattice& lattice, const std::vector<NodeRow>& rows) {
  const hexmesh::CellLocator inside(lattice.voxels, {1, 1, 1}, lattice.levels[0].cells);
  std::vector<NodeRow> out;
  for (const NodeRow& row : rows) {
    const hexmesh::Embedding e = inside.locate_position(row.position);
    if (e.cell >= 0 && (e.local - Vec3::Constant(0.5)).cwiseAbs().maxCoeff() <= 0.5) out.push_back(row);
  }
  return out;
}

Distance distance(const hexmesh::Result& result, const std::vector<NodeRow>& reference) {
  std::vector<Vec3> points, displacements;
  for (const NodeRow& row : reference) {
    points.push_back(row.position);
    displacements.push_back(row.displacement);
  }
  return distance(displacement_at(result, points), displacements);
}

Solved solve(const Lattice& lattice, const Scene& scene, int level) {
  SolveReport report;
  hexmesh::Result result = solve_equilibrium(lattice, scene, level, report);
  EXPECT_TRUE(report.converged) << report.reason;
  return {std::move(report), std::move(result)};
}

}  // namespace testing_support
