// SPDX-License-Identifier: Apache-2.0
// Conditions of every number and size; units and places.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "hexmesh/core/error.h"
#include "motions.h"
#include "record.h"
#include "support/bodies.h"
#include "support/experiments.h"
#include "support/files.h"
#include "support/solve.h"

namespace test_conditions {

using namespace hexsolver;
using namespace testing_support;
using stability::Case;

constexpr const char* constraints = "08 constraints";
constexpr const char* units = "09 units and scale";

Lattice ball() {
  return lattice_of(
      make_volume({16, 16, 16}, Vec3::Constant(2),
                  [](const Index3& i) { return Vec3(i[0] - 7.5, i[1] - 7.5, i[2] - 7.5).norm() < 7.6 ? 1 : 0; }),
      100, 0.3);
}

Condition everything(const std::string& name, const Vec3& by, SurfacePoints on = SurfacePoints::faces) {
  return beyond(name, {-1e6, 0, 0}, {1, 0, 0}, by, on);
}

/// Converged or not.
Solved ends(const Lattice& lattice, const Scene& scene, int level) {
  SolveReport report;
  hexmesh::Result result = solve_equilibrium(lattice, scene, level, report);
  return {std::move(report), std::move(result)};
}

TEST(HardConditions, OnePointHoldsNothingButWhatItHolds) {
  Case c(constraints, "one point held");
  const Lattice lattice = ball();
  for (int level = 0; level < 3; ++level) {
    Scene scene = with({patch("point", {0, 15, 15}, 0, {1, 2, 3})}, Elasticity::corotational);
    const std::string message = message_of(hexmesh::ErrorKind::geometry, [&] { ends(lattice, scene, level); });
    EXPECT_NE(message.find("turn"), std::string::npos) << message;
    if (level == 0) c.note("refused, exit 4, with", message);
  }
  // With two more it carries the body.
  Scene scene = with({patch("point", {0, 15, 15}, 0, {1, 2, 3}), patch("b", {30, 15, 15}, 0, {1, 2, 3}),
                      patch("c", {15, 30, 15}, 0, {1, 2, 3})},
                     Elasticity::corotational);
  double off = 0;
  for (int level = 0; level < 3; ++level) {
    const Solved e = ends(lattice, scene, level);
    EXPECT_TRUE(e.report.converged) << e.report.reason;
    for (const Vec3& u : displacement_at(e.result, material_points(lattice)))
      off = stability::worst(off, (u - Vec3(1, 2, 3)).norm());
  }
  c.at_most("three points moved alike: displacement off theirs [mm]", off, 1e-6);
}

TEST(HardConditions, AllPointsAndDuplicates) {
  Case c(constraints, "all surface points; the same patch four times");
  const Lattice lattice = ball();
  const std::vector<Vec3> points = material_points(lattice);
  double off = 0, difference = 0;
  for (const SurfacePoints on : {SurfacePoints::faces, SurfacePoints::voxels, SurfacePoints::nodes})
    for (int level = 0; level < 3; ++level) {
      const Solved all = ends(lattice, with({everything("all", {1, -2, 3}, on)}, Elasticity::corotational), level);
      EXPECT_TRUE(all.report.converged) << all.report.reason;
      for (const Vec3& u : displacement_at(all.result, material_points(lattice)))
        off = stability::worst(off, (u - Vec3(1, -2, 3)).norm());
      Scene once =
          with({patch("held", {0, 15, 15}, 12, Vec3::Zero(), on), patch("moved", {30, 15, 15}, 12, {3, 2, 1}, on)},
               Elasticity::corotational);
      Scene often = once;
      for (int n = 0; n < 3; ++n)
        often.conditions.push_back(patch(fmt::format("again {}", n), {30, 15, 15}, 12, {3, 2, 1}, on));
      const Solved a = ends(lattice, once, level), b = ends(lattice, often, level);
      EXPECT_TRUE(a.report.converged && b.report.converged) << a.report.reason << b.report.reason;
      difference = stability::worst(
          difference, distance(displacement_at(a.result, points), displacement_at(b.result, points)).largest);
    }
  c.at_most("all points moved alike: displacement off theirs [mm]", off, 1e-6);
  c.at_most("four times the same condition, off once in the material [mm]", difference, 1e-5);
}

TEST(HardConditions, ConflictsAreToldOrCompromised) {
  Case c(constraints, "the same points pulled by 5 mm and by 1 mm the other way");
  const Lattice lattice = ball();
  for (int level = 1; level < 3; ++level) {
    Scene scene = with({patch("held", {0, 15, 15}, 5, Vec3::Zero()), patch("one", {30, 15, 15}, 4, {0, 5, 0}),
                        patch("other", {30, 15, 15}, 4, {0, -1, 0})},
                       Elasticity::corotational);
    const std::string message = message_of(hexmesh::ErrorKind::geometry, [&] { ends(lattice, scene, level); });
    EXPECT_NE(message.find("one"), std::string::npos) << message;
    EXPECT_NE(message.find("other"), std::string::npos) << message;
    if (level == 1) c.note("refused, exit 4, with", message);
    scene.compromise = true;
    const Solved e = ends(lattice, scene, level);
    EXPECT_TRUE(e.report.converged) << e.report.reason;
    // The mean of both is 3 mm off each.
    c.at_most(fmt::format("level {}: compromise, misfit off 3 mm [mm]", level),
              std::max(std::abs(e.report.conditions[1].misfit_mm - 3), std::abs(e.report.conditions[2].misfit_mm - 3)),
              0.05);
  }
}

TEST(HardConditions, MoreConstraintsThanUnknownsAndOnSlivers) {
  Case c(constraints, "more points than unknowns; on cells filled to 1/512");
  const Lattice lattice = ball();
  const int coarsest = static_cast<int>(lattice.levels.size()) - 1;
  const Solved e = ends(lattice, with({everything("all", {4, 0, 0})}, Elasticity::corotational), coarsest);
  EXPECT_TRUE(e.report.converged) << e.report.reason;
  c.at_least("constrained points over nodes",
             double(e.report.conditions[0].points) / double(e.report.levels.back().nodes), 1);
  const hexmesh::LabelVolume volume = make_volume({16, 16, 16}, {2, 2, 2}, [](const Index3&) { return 1; });
  const Lattice cut = hexmesh::build_lattice(
      volume, {{volume.segments[0], hexmesh::material_from_units(100, 0.3, 1000), 0, ""}}, {4, {7, 7, 7}});
  double violation = 0;
  for (int level = 1; level <= 3; ++level) {
    // The corner voxel alone, in a cell of next to nothing.
    Scene scene = with({patch("held", {30, 30, 30}, 8, Vec3::Zero()), patch("sliver", {0, 0, 0}, 1.8, {-2, -1, -3})},
                       Elasticity::corotational);
    const Solved s = ends(cut, scene, level);
    EXPECT_TRUE(s.report.converged) << "level " << level << ": " << s.report.reason;
    violation = stability::worst(violation, s.report.constraint_violation_mm);
  }
  c.at_most("corner voxel of a sliver cell pulled: constraints off [mm]", violation, 1e-6);
}

TEST(HardConditions, DisplacementsOfEverySize) {
  Case c(constraints, "imposed displacements of 1e-9 and 1e3 mm");
  const Lattice lattice = ball();
  const auto pulled = [&](const Vec3& by, Elasticity e) {
    return with({patch("held", {0, 15, 15}, 6, Vec3::Zero()), patch("moved", {30, 15, 15}, 6, by)}, e);
  };
  double off = 0, off_small = 0;
  for (int level = 0; level < 3; ++level) {
    const Solved one = ends(lattice, pulled({0.5, 1, 0.2}, Elasticity::cauchy), level);
    for (const double size : {1e-9, 1e-6, 1e3}) {
      const Solved e = ends(lattice, pulled(size * Vec3(0.5, 1, 0.2), Elasticity::cauchy), level);
      EXPECT_TRUE(e.report.converged) << size << ": " << e.report.reason;
      for (std::size_t n = 0; n < e.result.displacement.size(); ++n)
        off = stability::worst(off, (e.result.displacement[n] / size - one.result.displacement[n]).norm());
    }
    // With rotating cells small ones are as without; by 1e3 mm the ball of 30 mm is either solved or the load cut.
    const Solved small = ends(lattice, pulled(1e-9 * Vec3(0.5, 1, 0.2), Elasticity::corotational), level);
    EXPECT_TRUE(small.report.converged) << small.report.reason;
    for (std::size_t n = 0; n < small.result.displacement.size(); ++n)
      off_small =
          stability::worst(off_small, (small.result.displacement[n] / 1e-9 - one.result.displacement[n]).norm());
    const Solved large = ends(lattice, pulled({500, 1000, 200}, Elasticity::corotational), level);
    EXPECT_TRUE(large.report.converged || !large.report.reason.empty());
    for (const Vec3& u : large.result.displacement) EXPECT_TRUE(u.allFinite());
    c.note(fmt::format("level {}: part of 1136 mm that a ball of 30 mm bears", level), large.report.load_fraction);
    // All of it moved away together.
    const Solved away = ends(lattice, with({everything("all", {1e3, 0, 0})}, Elasticity::corotational), level);
    EXPECT_TRUE(away.report.converged) << away.report.reason;
  }
  c.at_most("small strain: displacement over that imposed, off that of 1 mm [mm]", off, 1e-5);
  // Strains of 3e-11 that are differences of places: five digits are left, fewer where the body hardly moves.
  c.at_most("rotating cells, 1e-9 mm: the same", off_small, 1e-2);
}

/// The same block with every length times `scale` and E = young kPa, its corner at `origin`.
Lattice scaled_block(double scale, double young, const Vec3& origin = Vec3::Zero()) {
  return lattice_of(make_volume(
                        {12, 8, 8}, Vec3(2, 2, 2.5) * scale,
                        [](const Index3& i) { return i[0] > 7 && i[1] > 5 ? 0 : 1; }, Mat3::Identity(), origin),
                    young, 0.4);
}

Scene scaled_scene(double scale, double young, Elasticity e, const Vec3& origin = Vec3::Zero()) {
  Scene scene = with({beyond("held", origin + scale * Vec3(-0.9, 0, 0), {-1, 0, 0}, Vec3::Zero()),
                      beyond("moved", origin + scale * Vec3(22.9, 0, 0), {1, 0, 0}, scale * Vec3(-2, 5, 3))},
                     e);
  scene.tolerance = 1e-12;
  Force force;
  force.name = "pushed";
  force.selection = beyond("", origin + scale * Vec3(0, -0.9, 0), {0, -1, 0}, Vec3::Zero()).selection;
  force.pressure = 1e-5 * young;  // 0.01 E
  scene.forces = {force};
  return scene;
}

TEST(Units, TheAnswerDoesNotDependOnThem) {
  for (const Elasticity e :
       {Elasticity::cauchy, Elasticity::corotational, Elasticity::neo_hookean, Elasticity::stable_neo_hookean}) {
    Case c(units, fmt::format("m, mm and um; E from 1 Pa to 1 TPa, {}", stability::law_name(e)));
    double off = 0, off_energy = 0;
    for (int level = 0; level < 3; ++level) {
      const Solved plain = ends(scaled_block(1, 10), scaled_scene(1, 10, e), level);
      EXPECT_TRUE(plain.report.converged) << plain.report.reason;
      double largest = 0;
      for (const Vec3& u : plain.result.displacement) largest = std::max(largest, u.norm());
      for (const double scale : {1e-3, 1.0, 1e3})
        for (const double young : {1e-3, 10.0, 1e9}) {
          const Solved s = ends(scaled_block(scale, young), scaled_scene(scale, young, e), level);
          EXPECT_TRUE(s.report.converged) << "scale " << scale << " E " << young << ": " << s.report.reason;
          double most = 0;
          for (std::size_t n = 0; n < s.result.displacement.size(); ++n)
            most = stability::worst(most,
                                    (s.result.displacement[n] / scale - plain.result.displacement[n]).norm() / largest);
          const double in_energy = std::abs(
              s.report.strain_energy_n_mm / (scale * scale * scale * young / 10) / plain.report.strain_energy_n_mm - 1);
          off = stability::worst(off, most);
          off_energy = stability::worst(off_energy, in_energy);
        }
    }
    c.at_most("displacement off that in mm and 10 kPa, relative", off, 1e-9);
    c.at_most("strain energy off, relative", off_energy, 1e-9);
  }
}

TEST(Units, FarFromTheOrigin) {
  for (const Elasticity e : {Elasticity::cauchy, Elasticity::corotational, Elasticity::neo_hookean}) {
    Case c(units, fmt::format("1e6 mm from the origin, {}", stability::law_name(e)));
    double off = 0;
    for (int level = 0; level < 3; ++level) {
      const Vec3 far(1e6, -1e6, 1e6);
      const Solved near_by = ends(scaled_block(1, 10), scaled_scene(1, 10, e), level);
      Scene scene = scaled_scene(1, 10, e, far);
      const Solved away = ends(scaled_block(1, 10, far), scene, level);
      EXPECT_TRUE(away.report.converged) << away.report.reason;
      double largest = 0;
      for (const Vec3& u : near_by.result.displacement) largest = std::max(largest, u.norm());
      for (std::size_t n = 0; n < away.result.displacement.size(); ++n)
        off = stability::worst(off, (away.result.displacement[n] - near_by.result.displacement[n]).norm() / largest);
    }
    c.at_most("displacement off that at the origin, relative", off, 1e-6);
  }
}

}  // namespace test_conditions
