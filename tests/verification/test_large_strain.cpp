// SPDX-License-Identifier: Apache-2.0
// Laws of large strain against closed forms and independent solutions.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <numbers>

#include "support/bodies.h"
#include "support/experiments.h"
#include "support/files.h"
#include "support/forms.h"
#include "support/limits.h"
#include "support/solve.h"

namespace test_large_strain {

using namespace hexsolver;
using namespace testing_support;

/// Faces whose centres lie in a thin box.
Condition faces_in(const std::string& name, const Vec3& low, const Vec3& high, const char* axes, const Vec3& by) {
  Condition c;
  c.name = name;
  c.where = "test";
  c.selection.box = hexmesh::box_between(low, high);
  for (std::size_t d = 0; d < 3; ++d) c.axes[d] = std::string(axes).find("xyz"[d]) != std::string::npos;
  c.by = by;
  return c;
}

/// The part of a body with positive coordinates: cubes of edge h whose centres satisfy `holds`.
Lattice positive_part(const Index3& extent, double h, double young_kpa, double poisson,
                      const std::function<bool(const Vec3&)>& holds) {
  const hexmesh::LabelVolume volume = make_volume(
      extent, Vec3::Constant(h),
      [&](const Index3& v) { return holds(h * (Vec3(v[0], v[1], v[2]) + Vec3::Constant(0.5))); }, Mat3::Identity(),
      Vec3::Constant(h / 2));
  return lattice_of(volume, young_kpa, poisson);
}

/// The other half of a body, beyond the plane through the origin across an axis.
Condition mirror(int axis) {
  Condition c = beyond("mirror", Vec3::Zero(), -Vec3::Unit(axis), Vec3::Zero(), SurfacePoints::nodes);
  for (int d = 0; d < 3; ++d) c.axes[static_cast<std::size_t>(d)] = d == axis;
  return c;
}

// Plates on which the cylinder slides: the stress is uniaxial and the same everywhere, whatever the cells are filled
// with. The lateral stretch of St. Venant-Kirchhoff material is sqrt(1 + nu (1 - l^2)) at the length l.
TEST(SlidingPlates, GiveTheExactStretchAtEveryLevelAndOffset) {
  constexpr double poisson = 0.49, stretch = 0.8, height = 24;
  constexpr int across = 21;  // odd: faces lie in the planes that are pinned
  const hexmesh::LabelVolume volume = make_volume({across, across, 12}, {1, 1, 2}, [](const Index3& v) {
    const double x = v[0] - across / 2, y = v[1] - across / 2;
    return x * x + y * y <= 10.5 * 10.5;
  });
  const double middle = across / 2;  // NOLINT: a voxel's number
  const double bottom = -1, top = bottom + height, much = 100, thin = 0.1;
  const Scene scene = [&] {
    Scene s = with(
        {faces_in("bottom", {-much, -much, bottom - thin}, {much, much, bottom + thin}, "z", {0, 0, 0}),
         faces_in("top", {-much, -much, top - thin}, {much, much, top + thin}, "z", {0, 0, (stretch - 1) * height}),
         faces_in("x", {middle - thin, -much, bottom - thin}, {middle + thin, much, bottom + thin}, "x", {0, 0, 0}),
         faces_in("y", {-much, middle - thin, bottom - thin}, {much, middle + thin, bottom + thin}, "y", {0, 0, 0})},
        Elasticity::green_lagrange);
    s.tolerance = 1e-10;
    return s;
  }();
  const double lateral = std::sqrt(1 + poisson * (1 - stretch * stretch));
  for (const Index3& offset : {Index3{0, 0, 0}, Index3{1, 0, 1}, Index3{3, 2, 1}}) {
    const Lattice lattice = hexmesh::build_lattice(
        volume, {{volume.segments[0], hexmesh::material_from_units(100, poisson, 1000), 0, ""}}, {4, offset});
    std::vector<Vec3> points;
    for (const hexmesh::ExposedFace& face : hexmesh::exposed_faces(lattice))
      points.push_back(lattice.voxels.position(hexmesh::face_index(face)));
    for (int level = 0; level < 4; ++level) {
      const Solved s = solve(lattice, scene, level);
      const std::vector<Vec3> u = displacement_at(s.result, points);
      double worst = 0;
      for (std::size_t n = 0; n < points.size(); ++n) {
        const Vec3 from(points[n][0] - middle, points[n][1] - middle, points[n][2] - bottom);
        const Vec3 expected((lateral - 1) * from[0], (lateral - 1) * from[1], (stretch - 1) * from[2]);
        worst = std::max(worst, (u[n] - expected).norm() / (height / 2));
      }
      std::printf("offset %d %d %d, level %d: stretch %.6f, off by %.1e at most\n", offset[0], offset[1], offset[2],
                  level, lateral, worst);
      EXPECT_LT(worst, 1e-6);
    }
  }
}

// An eighth of a cylinder with its ends clamped: the axisymmetric solution, by quadratic elements, extrapolated; height
// 1, radius 0.5, nu = 0.49.
TEST(PressedCylinder, BulgesAsNeoHookeanMaterialDoes) {
  constexpr int across = 50;
  constexpr double h = 50.0 / across;
  const Lattice lattice =
      positive_part({across, across, across}, h, 100, 0.49, [](const Vec3& p) { return p.head<2>().norm() <= 50; });
  for (const auto& [press, radius] :
       {std::pair{10.0, 0.532099}, std::pair{20.0, 0.569207}, std::pair{30.0, 0.611099}}) {
    if (press < 30 && !is_full()) continue;  // the strongest is the hardest
    std::vector<Condition> conditions = {
        mirror(0), mirror(1), mirror(2),
        beyond("end", {0, 0, 50}, {0, 0, 1}, {0, 0, -press / 2}, SurfacePoints::nodes)};
    const Solved s = solve(lattice, with(conditions, Elasticity::neo_hookean), 0);
    std::vector<Vec3> rim;
    for (int n = 0; n <= 90; ++n)
      rim.push_back(49.999 * Vec3(std::cos(n * std::numbers::pi / 180), std::sin(n * std::numbers::pi / 180), 0));
    const std::vector<Vec3> u = displacement_at(s.result, rim);
    double growth = 0;
    for (std::size_t n = 0; n < rim.size(); ++n)
      growth += u[n].dot(rim[n].normalized()) / static_cast<double>(rim.size());
    const double expected = 100 * radius - 50;
    std::printf("pressed by %g %%: radius grows by %.4f mm, off by %.2f %%\n", press, growth,
                100 * (growth / expected - 1));
    EXPECT_NEAR(growth, expected, 0.02 * expected);
  }
}

TEST(HangingBeam, BendsAsStVenantKirchhoffMaterialDoes) {
  // Half of the beam of test_accuracy, E = 300 kPa.
  constexpr double h = 1;
  for (const double poisson : {0.3, 0.45}) {
    const std::string name = fmt::format("beam, green-lagrange, E 300, nu {}", poisson);
    const double x = limit_of(name, "tip_x_mm"), z = limit_of(name, "tip_z_mm");
    const Lattice lattice = positive_part({160, 20, 40}, h, 300, poisson, [](const Vec3&) { return true; });
    Scene scene = with({mirror(1), beyond("clamp", {0, 0, 0}, {-1, 0, 0}, Vec3::Zero(), SurfacePoints::nodes)},
                       Elasticity::green_lagrange);
    scene.gravity = {0, 0, -9810};
    const Solved s = solve(lattice, scene, 0);
    const Vec3 tip = displacement_at(s.result, {{159.999, 0.001, 20}})[0];
    std::printf("nu %g: tip %.3f %.3f mm, off by %.2f and %.2f %%\n", poisson, tip[0], tip[2], 100 * (tip[0] / x - 1),
                100 * (tip[2] / z - 1));
    EXPECT_NEAR(tip[2], z, 0.005 * std::abs(z));
    EXPECT_NEAR(tip[0], x, 0.01 * std::abs(x));
  }
}

// Bending of nearly incompressible material, small strain: the beam of test_accuracy.
TEST(HangingBeam, DoesNotLockWithTheMeanDilatation) {
  std::printf("  nu     level   tip over the reference: mean, full dilatation\n");
  for (const double poisson : {0.45, 0.49, 0.499}) {
    const double expected = limit_of(fmt::format("beam, cauchy, E 100, nu {}", poisson), "tip_z_mm");
    const Lattice lattice = lattice_of(solid("beam", 2, {}), 100, poisson);
    Scene scene = with({beyond("clamp", {-80, 0, 0}, {-1, 0, 0}, Vec3::Zero(), SurfacePoints::nodes)});
    scene.gravity = {0, 0, -9810};
    for (int level = 3; level >= 0; --level) {
      std::array<double, 2> tip{};
      for (const Volumetric v : {Volumetric::mean, Volumetric::full}) {
        scene.volumetric = v;
        const Solved s = solve(lattice, scene, level);
        tip[v == Volumetric::full] = displacement_at(s.result, {{79.999, 0, 0}})[0][2] / expected;
      }
      std::printf("  %-6g %d       %.3f %.3f\n", poisson, level, tip[0], tip[1]);
      EXPECT_GT(tip[0], tip[1]) << "the full dilatation locks, if any";
      constexpr std::array allowed = {0.005, 0.01, 0.025, 0.06};
      EXPECT_NEAR(tip[0], 1, allowed[static_cast<std::size_t>(level)]);
    }
  }
}

// The smooth shape of a real liver, meshed by quadratic tetrahedra and solved by CalculiX: the staircase and the
// outline of the patches alone make about 0.2 mm.
TEST(SmoothLiver, IsMetByVoxelsAndByCellsOfTwice) {
  if (!has_references()) GTEST_SKIP() << "no shared data beside the project";
  struct Case {
    const char* file;
    double poisson, radius, part;
    Elasticity elasticity;
    std::vector<std::pair<int, double>> levels;  ///< and what the mean distance is below [mm]
  };
  constexpr Elasticity linear = Elasticity::cauchy, stvk = Elasticity::green_lagrange;
  for (const Case& c : {Case{"liver_0.3_linear_tetA_r20.csv.gz", 0.3, 20, 1, linear, {{1, 0.8}, {0, 0.4}}},
                        Case{"liver_0.4_linear_tetA_r20.csv.gz", 0.4, 20, 1, linear, {{1, 0.8}, {0, 0.4}}},
                        Case{"liver_0.3_stvk_tetA_r20.csv.gz", 0.3, 20, 1, stvk, {{0, 0.4}}},
                        Case{"liver_0.3_stvk_tetB_20mm.csv.gz", 0.3, 10, 0.5, stvk, {{0, 0.4}}}}) {
    const Lattice lattice = liver_of_scan(c.poisson);
    const std::vector<NodeRow> reference = within(lattice, read_reference(shared_data() / "reference" / c.file));
    ASSERT_GT(reference.size(), 2000U);
    Scene scene = with(liver_patches(c.radius, SurfacePoints::faces), c.elasticity);
    scene.conditions.back().by *= c.part;
    for (const auto& [level, allowed] : c.levels) {
      const Distance d = distance(solve(lattice, scene, level).result, reference);
      std::printf("%s, level %d: mean %.3f, largest %.3f mm at %zu points\n", c.file, level, d.mean, d.largest,
                  reference.size());
      EXPECT_LT(d.mean, allowed);
    }
  }
}

TEST(GreenLagrange, SaysWhyItHasNoSolutionInStrongCompression) {
  // 160 x 40 x 40 mm under its own weight: with 20 kPa the clamp would have to bear 0.94 E, the law bears 0.19 E.
  for (const double young_kpa : {20.0, 2.0}) {
    const Lattice lattice = lattice_of(solid("beam", 5, {}), young_kpa, 0.3);
    Scene scene = with({beyond("clamp", {-80, 0, 0}, {-1, 0, 0}, Vec3::Zero())}, Elasticity::green_lagrange);
    scene.gravity = {0, 0, -9810};
    SolveReport report;
    solve_equilibrium(lattice, scene, 0, report);
    EXPECT_FALSE(report.converged);
    EXPECT_LT(report.load_fraction, 1);
    EXPECT_NE(report.reason.find("Green-Lagrange"), std::string::npos) << report.reason;
  }
  const Lattice lattice = lattice_of(solid("beam", 5, {}), 20, 0.3);
  Scene scene = with({beyond("clamp", {-80, 0, 0}, {-1, 0, 0}, Vec3::Zero())}, Elasticity::neo_hookean);
  scene.gravity = {0, 0, -9810};
  EXPECT_TRUE(solve(lattice, scene, 0).report.converged);
}

}  // namespace test_large_strain
