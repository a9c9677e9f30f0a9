// SPDX-License-Identifier: Apache-2.0
#include "experiments.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <sstream>

#include "files.h"
#include "hexmesh/lattice/locator.h"
#include "hexmesh/scan/image_io.h"

namespace testing_support {

using namespace hexsolver;

hexmesh::LabelVolume solid(const char* name, double spacing, const std::map<std::string, double>& size) {
  hexmesh::SolidPhantom s;
  s.name = name;
  s.spacing = spacing;
  s.size = size;
  return hexmesh::solid_phantom(s);
}

bool has_scan() { return std::filesystem::exists(shared_data() / "data/totalsegmentator/example_seg.nii.gz"); }

Scene with(std::vector<Condition> conditions, Elasticity elasticity) {
  Scene scene;
  scene.elasticity = elasticity;
  if (elasticity == Elasticity::green_lagrange) scene.volumetric = Volumetric::full;
  scene.conditions = std::move(conditions);
  return scene;
}

Lattice lattice_of(hexmesh::LabelVolume volume, double young_kpa, double poisson) {
  volume.segments.resize(1);
  for (std::uint16_t& label : volume.labels)
    if (label != volume.segments[0].label) label = 0;
  return hexmesh::build_lattice(
      volume, {{volume.segments[0], hexmesh::material_from_units(young_kpa, poisson, 1000), 0, "given"}});
}

Lattice liver_of_phantom(double spacing, double poisson) {
  hexmesh::LabelVolume labels = hexmesh::liver_phantom(spacing).labels;
  for (std::uint16_t& label : labels.labels) label = label != 0;  // with its tumour and vessel
  return lattice_of(std::move(labels), 100, poisson);
}

Lattice liver_of_scan(double poisson) {
  std::vector<hexmesh::Overlap> none;
  const auto scan = shared_data() / "data/totalsegmentator/example_seg.nii.gz";
  return lattice_of(
      hexmesh::flatten(hexmesh::select_segments(hexmesh::read_segmentation({scan}), {{"5", "liver"}}), {}, none), 100,
      poisson);
}

Condition patch(const std::string& name, const Vec3& center, double radius, const Vec3& by, SurfacePoints on) {
  Condition c;
  c.name = name;
  c.where = "test";
  c.selection.balls = {{center, radius}};
  c.selection.on = on;
  c.by = by;
  return c;
}

Condition beyond(const std::string& name, const Vec3& point, const Vec3& normal, const Vec3& by, SurfacePoints on) {
  Condition c;
  c.name = name;
  c.where = "test";
  c.selection.halfspace = HalfSpace{point, normal};
  c.selection.on = on;
  c.by = by;
  return c;
}

std::vector<Condition> pressed_ends(double half, double press) {
  return {beyond("below", {0, 0, -half}, {0, 0, -1}, {0, 0, press / 2}, SurfacePoints::nodes),
          beyond("above", {0, 0, half}, {0, 0, 1}, {0, 0, -press / 2}, SurfacePoints::nodes)};
}

double growth_half_way(const hexmesh::Result& result, double radius) {
  constexpr int count = 360;
  std::vector<Vec3> rim;
  for (int n = 0; n < count; ++n) {
    const double angle = n * 2 * std::numbers::pi / count;
    rim.emplace_back(radius * std::cos(angle), radius * std::sin(angle), 0);
  }
  const std::vector<Vec3> u = displacement_at(result, rim);
  double sum = 0;
  for (std::size_t n = 0; n < rim.size(); ++n) sum += u[n].head<2>().dot(rim[n].head<2>()) / radius;
  return sum / count;
}

std::vector<Condition> liver_patches(double radius, SurfacePoints on) {
  return {patch("right_lateral", {-138.54367, -138.819, 155.80176}, radius, Vec3::Zero(), on),
          patch("posterior", {-81.54367, -84.819, 149.80176}, radius, Vec3::Zero(), on),
          patch("inferior_right", {-84.54367, -180.819, 92.80176}, radius, Vec3::Zero(), on),
          patch("left_lobe_tip", {56.45633, -222.819, 176.80176}, radius, {0, -28.284271, -28.284271}, on)};
}

std::vector<Condition> phantom_patches(double radius) {
  return {patch("right end", {-99.000, -1.000, -15.000}, radius, Vec3::Zero()),
          patch("back", {-48.000, 48.000, -15.000}, radius, Vec3::Zero()),
          patch("lower end", {-50.000, -13.000, -50.000}, radius, Vec3::Zero()),
          patch("left end", {99.000, -19.000, 7.000}, radius, {0, -28.284271, -28.284271})};
}

std::vector<Vec3> displacement_at(const hexmesh::Result& result, const std::vector<Vec3>& points) {
  const hexmesh::CellLocator locator(result.voxels, result.voxels_per_cell, result.cells);
  std::vector<Vec3> out;
  for (const Vec3& p : points) {
    const hexmesh::Embedding e = locator.locate_position(p);
    EXPECT_GE(e.cell, 0) << p.transpose();
    if (e.cell < 0) return {};
    const hexmesh::NodeWeights weights = hexmesh::shape_functions(e.local);
    Vec3 u = Vec3::Zero();
    for (int a = 0; a < 8; ++a) {
      const auto node = result.cell_nodes[static_cast<std::size_t>(e.cell)][static_cast<std::size_t>(a)];
      u += weights[a] * result.displacement[static_cast<std::size_t>(node)];
    }
    out.push_back(u);
  }
  return out;
}

std::vector<Vec3> material_points(const Lattice& lattice) {
  std::vector<Vec3> points;
  for (const hexmesh::Index3& v : lattice.levels[0].cells)
    points.push_back(lattice.voxels.position(Vec3(v[0], v[1], v[2])));
  return points;
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
  Distance d;
  for (std::size_t n = 0; n < a.size(); ++n) {
    d.mean += (a[n] - b[n]).norm() / static_cast<double>(a.size());
    d.largest = std::max(d.largest, (a[n] - b[n]).norm());
  }
  return d;
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
