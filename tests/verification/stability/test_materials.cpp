// SPDX-License-Identifier: Apache-2.0
// Nearly incompressible material, and stiff beside soft in the same cells.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <optional>

#include "motions.h"
#include "record.h"
#include "support/experiments.h"
#include "support/solve.h"

namespace test_materials {

using namespace hexsolver;
using namespace testing_support;
using stability::Case;

constexpr const char* incompressible = "03 near-incompressible";
constexpr const char* contrast = "04 contrast";

/// Bodies of two materials in a cube of n voxels an edge.
struct TwoMaterials {
  const char* name;
  int (*label)(const Index3&, int n);
};

double from_middle(const Index3& i, int n) {
  return Vec3(i[0] - (n - 1) / 2.0, i[1] - (n - 1) / 2.0, i[2] - (n - 1) / 2.0).norm();
}

const TwoMaterials inclusion = {"inclusion",
                                [](const Index3& i, int n) { return from_middle(i, n) < 0.27 * n ? 2 : 1; }};
const TwoMaterials shell = {"shell of one voxel around a core", [](const Index3& i, int n) {
                              const double r = from_middle(i, n);
                              return r > 0.5 * n ? 0 : r > 0.5 * n - 1.2 ? 2 : 1;
                            }};
const TwoMaterials gap = {"gap of two voxels between parts",
                          [](const Index3& i, int n) { return i[0] == n / 2 - 1 || i[0] == n / 2 ? 1 : 2; }};

/// E of the second `ratio` times that of the first, 100 kPa.
Lattice lattice_of(const TwoMaterials& body, int n, double ratio) {
  const hexmesh::LabelVolume volume =
      make_volume({n, n, n}, Vec3::Constant(2), [&](const Index3& i) { return body.label(i, n); });
  return hexmesh::build_lattice(volume,
                                {{volume.segments[0], hexmesh::material_from_units(100, 0.3, 1000), 0, ""},
                                 {volume.segments[1], hexmesh::material_from_units(100 * ratio, 0.3, 1000), 0, ""}});
}

/// One side held, the other moved along and across.
std::vector<Condition> sheared(double length, double spacing) {
  return {beyond("held", {0.2 * spacing, 0, 0}, {-1, 0, 0}, Vec3::Zero()),
          beyond("moved", {length - 1.2 * spacing, 0, 0}, {1, 0, 0}, {0.05 * length, 0.05 * length, 0})};
}

TEST(NearlyIncompressible, CellsDoNotLock) {
  // A cantilever of coarse cells that bends under its weight: what locks hardly moves.
  Case c(incompressible, "cantilever bent by its weight, coarse cells against fine ones");
  double compressible = 0;
  for (const double poisson : {0.3, 0.45, 0.49, 0.499, 0.4999}) {
    const Lattice lattice = box({48, 8, 8}, Vec3::Constant(2.5), 30, poisson);
    Scene scene = with({beyond("held", {0, 0, 0}, {-1, 0, 0}, Vec3::Zero())}, Elasticity::corotational);
    scene.gravity = stability::earth;
    const std::vector<Vec3> tip = {{47.5 * 2.5, 3.5 * 2.5, 3.5 * 2.5}};
    std::array<double, 3> sag{};
    for (int level = 0; level < 3; ++level) {
      SolveReport report;
      const hexmesh::Result r = solve_equilibrium(lattice, scene, level, report);
      EXPECT_TRUE(report.converged) << poisson << " level " << level << ": " << report.reason;
      sag[static_cast<std::size_t>(level)] = -displacement_at(r, tip)[0][2];
      if (level == 1) {
        const auto& raw = r.cell_fields.at("pressure");
        const auto& smooth = r.cell_fields.at("smoothed_pressure");
        const auto range = [](const std::vector<double>& v) {
          return 1e3 * (*std::max_element(v.begin(), v.end()) - *std::min_element(v.begin(), v.end()));
        };
        c.note(fmt::format("nu = {}: range of the raw pressure [kPa]", poisson), range(raw));
        c.note(fmt::format("nu = {}: range of the smoothed pressure [kPa]", poisson), range(smooth));
        c.note(fmt::format("nu = {}: checkerboard [kPa]", poisson), 1e3 * report.pressure_checkerboard);
      }
    }
    // Bending asks for E alone, but for the held end, which cannot draw in.
    if (compressible == 0) compressible = sag[0];
    c.at_least(fmt::format("nu = {}: sag over that of nu = 0.3, 8 cells across", poisson), sag[0] / compressible, 0.9);
    c.at_least(fmt::format("nu = {}: sag with 4 cells across / with 8", poisson), sag[1] / sag[0], 0.8);
    c.at_least(fmt::format("nu = {}: sag with 2 cells across / with 8", poisson), sag[2] / sag[0], 0.6);
  }
}

TEST(NearlyIncompressible, IterationsOfALinearLiver) {
  Case c(incompressible, "liver pulled by 40 mm, voxels, small strain, to 1e-8");
  std::vector<double> nus, iterations;
  for (const double poisson : {0.3, 0.45, 0.49, 0.499, 0.4999}) {
    const Lattice lattice = liver_of_phantom(stability::whole_or(3.0, 5.0), poisson);
    const Solved s = solve(lattice, with(phantom_patches(12)), 0);
    const int linear = s.report.levels.back().newton.linear_iterations;
    nus.push_back(0.5 - poisson);
    iterations.push_back(linear);
    const std::string what = fmt::format("nu = {}: iterations", poisson);
    if (poisson <= 0.49)
      c.at_most(what, linear, 25);
    else
      c.note(what, linear);
  }
  c.curve({"linear liver", "0.5 - nu", "iterations", true, false}, "voxels", nus, iterations);
}

TEST(Contrast, FromAMillionthToAMillion) {
  constexpr int small = 18;
  const int large = stability::whole_or(48, 36);  // more levels than are factored at once
  struct Of {
    const TwoMaterials& body;
    std::optional<double> most_iterations;  ///< over those of one material
  };
  // A core in a shell a million times softer is held by next to nothing: many iterations, but an end.
  for (const Of& of : {Of{inclusion, 10}, Of{shell, {}}, Of{gap, 10}}) {
    Case c(contrast, fmt::format("{}, stiffness 1e-6 to 1e6 times the other's", of.body.name));
    double most = 0, softer_over_stiffer = 0;
    std::vector<double> ratios, iterations;
    for (const auto& [n, level] : {std::pair{small, 0}, {small, 1}, {small, 2}, {large, 2}, {large, 1}}) {
      if (n == large && level == 1 && !stability::is_full()) continue;
      const Scene scene = with(sheared(2 * n, 2), Elasticity::corotational);
      const auto solved = [&, n = n, level = level](double ratio) {
        SolveReport report;
        solve_equilibrium(lattice_of(of.body, n, ratio), scene, level, report);
        EXPECT_TRUE(report.converged) << of.body.name << " " << ratio << " level " << level << ": " << report.reason;
        return report;
      };
      const double alike = solved(1).levels.back().newton.linear_iterations;
      double before = 0;
      for (int exponent = -6; exponent <= 6; exponent += stability::whole_or(2, 6)) {
        const SolveReport report = solved(std::pow(10.0, exponent));
        const double linear = report.levels.back().newton.linear_iterations;
        most = stability::worst(most, linear / alike);
        // Displacements are given: what is stiffer stores more.
        softer_over_stiffer = stability::worst(softer_over_stiffer, before / report.strain_energy_n_mm);
        before = report.strain_energy_n_mm;
        if (n == large && level == 2) {
          ratios.push_back(std::pow(10.0, exponent));
          iterations.push_back(linear);
        }
      }
    }
    c.at_most("energy of a softer body over that of a stiffer", softer_over_stiffer, 1);
    if (of.most_iterations)
      c.at_most("most linear iterations over those of one material", most, *of.most_iterations);
    else
      c.note("most linear iterations over those of one material", most);
    c.curve({fmt::format("{}^3 voxels, level 2", large), "ratio of stiffnesses", "linear iterations", true, false},
            of.body.name, ratios, iterations);
  }
}

TEST(Contrast, LargeStrainToo) {
  for (const TwoMaterials* body : {&inclusion, &shell, &gap}) {
    Case c(contrast, fmt::format("{}, neo-hookean, stiffness 1e-6 to 1e6 times the other's", body->name));
    double most = 0, residual = 0;
    for (const double ratio : {1e-6, 1e-3, 1e3, 1e6})
      for (int level = 0; level < 3; ++level) {
        if (std::abs(std::log10(ratio)) < 6 && !stability::is_full()) continue;
        const Scene scene = with(sheared(36, 2), Elasticity::neo_hookean);
        SolveReport report;
        solve_equilibrium(lattice_of(*body, 18, ratio), scene, level, report);
        EXPECT_TRUE(report.converged) << body->name << " " << ratio << " level " << level << ": " << report.reason;
        most = std::max(most, double(report.levels.back().newton.linear_iterations));
        residual = stability::worst(residual, report.relative_residual);
      }
    c.at_most("largest relative residual", residual, 1e-8);
    c.note("most linear iterations", most);
  }
}

class HardMaterialsInMotion : public testing::TestWithParam<Rotation> {};

TEST_P(HardMaterialsInMotion, GainNoEnergy) {
  for (const double poisson : {0.49, 0.4999}) {
    Case c(incompressible, fmt::format("motion of a cantilever, nu = {}, {}", poisson, stability::name_of(GetParam())));
    double gain = 0;
    for (int level = 0; level < 3; ++level) {
      const Lattice lattice = box({12, 8, 8}, {4, 4, 4}, 30, poisson);
      Scene scene = stability::starved(GetParam());
      scene.gravity = stability::earth;
      scene.conditions = {beyond("held", {-1, 0, 0}, {-1, 0, 0}, Vec3::Zero())};
      Motion motion(lattice, scene, level);
      const stability::Run r = stability::run(motion, stability::whole_or(300, 100));
      EXPECT_TRUE(r.finished) << r.reason;
      gain = stability::worst(gain, r.largest_gain);
    }
    c.at_most("energy gained in a step", gain, stability::allowed_gain(GetParam()));
  }
  for (const TwoMaterials* body : {&inclusion, &shell, &gap}) {
    Case c(contrast, fmt::format("motion of {}, {}", body->name, stability::name_of(GetParam())));
    double gain = 0;
    for (const double ratio : {1e-6, 1e6})
      for (int level = 0; level < 3; ++level) {
        const Lattice lattice = lattice_of(*body, 18, ratio);
        Scene scene = stability::starved(GetParam());
        scene.gravity = stability::earth;
        scene.conditions = {sheared(36, 2)[0]};
        Motion motion(lattice, scene, level);
        const stability::Run r = stability::run(motion, stability::whole_or(200, 50));
        EXPECT_TRUE(r.finished) << r.reason;
        gain = stability::worst(gain, r.largest_gain);
      }
    c.at_most("energy gained in a step", gain, stability::allowed_gain(GetParam()));
  }
}

TEST(ContrastInMotion, AreSolvedToTheTolerance) {
  for (const TwoMaterials* body : {&inclusion, &shell, &gap}) {
    Case c(contrast, fmt::format("motion of {}, multigrid to 1e-8, 1e6 times stiffer and softer", body->name));
    double gain = 0, residual = 0;
    for (const double ratio : {1e-6, 1e6}) {
      const Lattice lattice = lattice_of(*body, 18, ratio);
      Scene scene = stability::starved(Rotation::polar, 0, 0.01);
      scene.dynamics->solver = StepSolver::multigrid;
      scene.dynamics->newton_iterations = 0;
      scene.gravity = stability::earth;
      scene.conditions = {sheared(36, 2)[0]};
      Motion motion(lattice, scene, 1);
      const stability::Run r = stability::run(motion, 10);
      EXPECT_TRUE(r.finished) << ratio << ": " << r.reason;
      gain = stability::worst(gain, r.largest_gain);
      residual = stability::worst(residual, motion.counts().largest_residual);
    }
    c.at_most("energy gained in a step", gain, 1e-3);
    c.at_most("largest relative residual", residual, 1e-8);
  }
}

INSTANTIATE_TEST_SUITE_P(Rotations, HardMaterialsInMotion, testing::Values(Rotation::polar, Rotation::edges),
                         [](const auto& p) { return stability::name_of(p.param); });

}  // namespace test_materials
