// SPDX-License-Identifier: Apache-2.0
// Cells that hold next to nothing, wherever the lattice lies: the paper's "badly fitted" grids.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <optional>

#include "hexmesh/scan/phantom.h"
#include "motions.h"
#include "newton/minimize.h"
#include "record.h"
#include "support/experiments.h"
#include "support/solve.h"
#include "terms/corotational.h"

namespace test_slivers {

using namespace hexsolver;
using namespace testing_support;
using stability::Case;

constexpr const char* family = "02 slivers";

/// Largest way down of any material [mm].
double sag_of(const hexmesh::Result& r, const std::vector<Vec3>& points) {
  double most = 0;
  for (const Vec3& u : displacement_at(r, points)) most = stability::worst(most, -u[2]);
  return most;
}

/// Least and largest x.
std::pair<double, double> reach(const std::vector<Vec3>& points) {
  double low = 1e300, high = -1e300;
  for (const Vec3& p : points) {
    low = std::min(low, p[0]);
    high = std::max(high, p[0]);
  }
  return {low, high};
}

/// The first 18 % of the length along x.
Condition held_part(const std::vector<Vec3>& points) {
  const auto [low, high] = reach(points);
  return beyond("held", {low + 0.18 * (high - low), 0, 0}, {-1, 0, 0}, Vec3::Zero());
}

/// The phantom's liver at any spacing: voxels of more than 10 mm take every second one of half their size.
Lattice liver(double spacing) {
  if (spacing <= 10) return liver_of_phantom(spacing, 0.3);
  const hexmesh::LabelVolume half = hexmesh::liver_phantom(spacing / 2).labels;
  const Index3 n = half.grid.extent();
  return testing_support::lattice_of(
      make_volume({n[0] / 2, n[1] / 2, n[2] / 2}, Vec3::Constant(spacing),
                  [&](const Index3& i) {
                    return half.labels[half.grid.offset({2 * i[0], 2 * i[1], 2 * i[2]})] != 0;
                  }),
      100, 0.3);
}

/// A solid block whose lattice is shifted so that the layers of cells at its lower sides hold one layer of voxels.
Lattice block(int block_edge, int shift) {
  const hexmesh::LabelVolume volume =
      make_volume({block_edge, block_edge, block_edge}, Vec3::Constant(2), [](const Index3&) { return 1; });
  return hexmesh::build_lattice(volume, {{volume.segments[0], hexmesh::material_from_units(100, 0.3, 1000), 0, ""}},
                                {4, {shift, shift, shift}});
}

Scene pressed(int block_edge, Elasticity elasticity) {
  // Held on one side, the opposite one moved, and its weight.
  Scene scene = with({beyond("held", {-0.9, 0, 0}, {-1, 0, 0}, Vec3::Zero()),
                      beyond("moved", {2 * block_edge - 1.1, 0, 0}, {1, 0, 0}, {-4, 3, 0})},
                     elasticity);
  scene.gravity = stability::earth;
  return scene;
}

class SliversInMotion : public testing::TestWithParam<Rotation> {};

TEST_P(SliversInMotion, ALiverUnderItsWeightSagsAsFarAsItShould) {
  const bool polar = GetParam() == Rotation::polar;
  Case c(family, std::string("liver under its weight, 1000 steps of 10 iterations, ") + stability::name_of(GetParam()));
  constexpr double fine_spacing = 4.4;
  Scene still;
  still.gravity = stability::earth;
  double fine = 0;
  {
    const Lattice lattice = liver_of_phantom(fine_spacing, 0.3);
    const std::vector<Vec3> points = material_points(lattice);
    still.conditions = {held_part(points)};
    SolveReport report;
    fine = sag_of(solve_equilibrium(lattice, still, 0, report), points);
    ASSERT_TRUE(report.converged) << report.reason;
  }
  c.note(fmt::format("sag of the fine equilibrium, voxels of {} mm [mm]", fine_spacing), fine);
  struct Size {
    double cell, least, most;  ///< [mm]; sag over the fine one
  };
  for (const auto& [cell, least, most] :
       {Size{32, 0.8, 1.1}, Size{17, 0.9, 1.05}, Size{8.75, 0.95, 1.05}, Size{4.4, 0.97, 1.03}}) {
    // Of averaged edges the smallest cells would take an hour.
    const int most_finer = stability::whole_or(polar || cell > 5 ? 3 : 1, cell > 10 ? 3 : cell > 5 ? 1 : 0);
    for (int finer = 1; finer <= most_finer; ++finer) {
      const Lattice lattice = liver(cell / (1 << finer));
      const std::vector<Vec3> points = material_points(lattice);
      Scene scene = stability::starved(GetParam());
      scene.gravity = stability::earth;
      scene.conditions = {held_part(points)};
      Motion motion(lattice, scene, finer);
      const std::string of = fmt::format("{} cells, {} finer levels: ", motion.mesh().num_cells(), finer);
      const stability::Run r = stability::run(motion, 1000);
      EXPECT_TRUE(r.finished) << of << r.reason;
      const auto [at_the_end, moved] = motion.make_result({});
      const double sag = sag_of(at_the_end, points);
      c.at_least(of + "sag of the motion / fine", sag / fine, least);
      c.at_most(of + "sag of the motion / fine", sag / fine, most);
      c.at_most(of + "inverted cells of the motion", double(moved.inverted_cells), 0);
      c.at_most(of + "energy gained in a step", r.largest_gain, stability::allowed_gain(GetParam()));
      if (!polar) continue;
      scene.dynamics.reset();
      SolveReport report;
      const double at_rest = sag_of(solve_equilibrium(lattice, scene, finer, report), points);
      EXPECT_TRUE(report.converged) << of << report.reason;
      c.at_least(of + "sag of the equilibrium / fine", at_rest / fine, least);
      c.at_most(of + "sag of the equilibrium / fine", at_rest / fine, most);
      c.at_most(of + "inverted cells of the equilibrium", double(report.inverted_cells), 0);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Rotations, SliversInMotion, testing::Values(Rotation::polar, Rotation::edges),
                         [](const auto& p) { return stability::name_of(p.param); });

TEST(Slivers, CellsFilledToA512thTakeNoMoreThanTwiceTheIterations) {
  for (const Elasticity elasticity : {Elasticity::cauchy, Elasticity::corotational}) {
    // Enough cells for more than one level of the multigrid.
    const int edge = stability::whole_or(64, 48);
    Case c(family, fmt::format("a block of {}^3 voxels cut to fills of 1/8 to 1/512, {}", edge,
                               stability::law_name(elasticity)));
    const Scene scene = pressed(edge, elasticity);
    for (int level = 3; level >= stability::whole_or(1, 2); --level) {
      SolveReport whole, cut;
      solve_equilibrium(block(edge, 0), scene, level, whole);
      const Lattice shifted = block(edge, (1 << level) - 1);
      solve_equilibrium(shifted, scene, level, cut);
      EXPECT_TRUE(whole.converged && cut.converged) << whole.reason << ", " << cut.reason;
      double least = 1;
      const hexmesh::Level& l = shifted.levels[static_cast<std::size_t>(level)];
      for (std::size_t n = 0; n < l.cells.size(); ++n) least = std::min(least, l.fill(n));
      c.at_most(fmt::format("least fill 1/{:.0f}: linear iterations over those of whole cells", 1 / least),
                double(cut.levels.back().newton.linear_iterations) / whole.levels.back().newton.linear_iterations, 2);
      c.at_most(fmt::format("least fill 1/{:.0f}: inverted cells", 1 / least), double(cut.inverted_cells), 0);
    }
  }
}

TEST(Slivers, TheSolutionInsideTheMaterialConverges) {
  for (const Elasticity elasticity : {Elasticity::cauchy, Elasticity::corotational}) {
    constexpr int edge = 16;
    Case c(family,
           fmt::format("a block of {}^3 voxels in badly placed cells, {}", edge, stability::law_name(elasticity)));
    const Scene scene = pressed(edge, elasticity);
    const std::vector<Vec3> points = material_points(block(edge, 0));
    SolveReport report;
    const std::vector<Vec3> u_fine = displacement_at(solve_equilibrium(block(edge, 0), scene, 0, report), points);
    double before = 0;
    for (int level = 3; level >= 1; --level) {
      const hexmesh::Result r = solve_equilibrium(block(edge, (1 << level) - 1), scene, level, report);
      EXPECT_TRUE(report.converged) << report.reason;
      const double off = distance(displacement_at(r, points), u_fine).mean;
      c.note(fmt::format("level {}: mean distance from the voxels [mm]", level), off);
      if (before > 0) c.at_most(fmt::format("level {}: that over the level before's", level), off / before, 0.6);
      before = off;
    }
  }
}

TEST(Slivers, ACellWhoseMatricesAreNextToNothingChangesNothing) {
  Case c(family, "a corner cell scaled by 1 to 1e-9");
  const Lattice lattice = block(16, 0);
  constexpr int level = 1;
  const double end = 31;  // of the block [mm]; the cell's free corner is there on all three axes, where nothing is held
  const auto is_held = [&](const Vec3& p) { return p[0] < 0 || (p[0] > end - 0.1 && p[1] < end - 10); };
  const auto pulled = [](const Vec3& p) { return p[0] < 0 ? Vec3(0, 0, 0) : Vec3(-4, 3, 0); };
  const Body body(lattice, level, Elasticity::corotational);
  std::vector<bool> of_others(body.mesh.num_nodes());
  for (std::size_t n = 0; n + 1 < body.mesh.num_cells(); ++n)
    for (const std::int32_t node : body.mesh.cell_nodes()[n]) of_others[static_cast<std::size_t>(node)] = true;
  ASSERT_EQ(std::count(of_others.begin(), of_others.end(), false), 1);

  std::vector<double> scales, iterations;
  NodeVector next_to_gone;
  double off = 0;
  for (const double scale : {1e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1, 1.0}) {
    std::vector<std::int32_t> elements(body.mesh.num_cells(), 0);
    elements.back() = 1;
    std::vector<ElementModel> models(2, body.elastic->model(0));
    models[1].stiffness *= scale;
    models[1].volume *= scale;
    models[1].shear *= scale;
    models[1].bulk *= scale;
    Potential potential(body.mesh);
    potential.add(std::make_unique<CorotationalCells>(body.mesh, elements, models));
    const Hierarchy hierarchy(body.mesh, lattice.corner());
    const Constraints held(body.mesh, hold_nodes(body.mesh, is_held, pulled));
    NodeVector u = NodeVector::Zero(static_cast<Eigen::Index>(body.mesh.num_dofs()));
    const NewtonReport report = minimize(hierarchy, potential, held, {}, u);
    EXPECT_TRUE(report.converged) << scale << ": " << report.reason;
    scales.push_back(scale);
    iterations.push_back(report.linear_iterations);
    if (next_to_gone.size() == 0) next_to_gone = u;
    for (std::size_t n = 0; n < of_others.size() && scale <= 1e-6; ++n)
      if (of_others[n])
        off = stability::worst(off, (u - next_to_gone).segment<3>(3 * static_cast<Eigen::Index>(n)).norm());
  }
  c.at_most("linear iterations over those of the whole block",
            *std::max_element(iterations.begin(), iterations.end()) / iterations.back(), 2);
  c.at_most("displacement of the other cells with 1e-6, off that with 1e-9 [mm]", off, 1e-5);
  c.curve({"one cell scaled", "scale of its matrices", "linear iterations", true, false}, "co-rotational", scales,
          iterations);
}

TEST(Slivers, TheLatticeMayLieAnywhere) {
  Case c(family, "whole-voxel shifts of the lattice, level 2");
  const hexmesh::LabelVolume cube = make_volume({30, 30, 30}, Vec3::Constant(2), [](const Index3&) { return 1; });
  const hexmesh::LabelVolume beam = solid("beam", stability::whole_or(2.0, 4.0), {});
  hexmesh::LabelVolume liver = hexmesh::liver_phantom(stability::whole_or(2.0, 4.0)).labels;
  for (std::uint16_t& l : liver.labels) l = l != 0;
  liver.segments.resize(1);
  struct Placed {
    const char* name;
    const hexmesh::LabelVolume& body;
    double held_part;  ///< of the length
    bool is_pressed;
    std::optional<double> allowed;
  };
  // A liver's supports end where its cells do, up to a cell farther: that is not the cut cells' doing.
  for (const Placed& p : {Placed{"a cube pressed between its ends", cube, 0, true, 0.02},
                          Placed{"a cube under its weight", cube, 0, false, 0.02},
                          Placed{"a beam under its weight", beam, 0, false, 0.02},
                          Placed{"a liver under its weight, held at a fifth of its length", liver, 0.18, false, {}}}) {
    const int most = stability::whole_or(4, 2);
    double least = 1e300, largest = 0;
    std::size_t inverted = 0;
    for (int n = 0; n < most * most * most; ++n) {
      const Index3 offset = {n % most * (4 / most), n / most % most * (4 / most), n / most / most * (4 / most)};
      const Lattice lattice = hexmesh::build_lattice(
          p.body, {{p.body.segments[0], hexmesh::material_from_units(100, 0.3, 1000), 0, ""}}, {3, offset});
      const auto [low, high] = reach(material_points(lattice));
      const double near_face = 0.45 * lattice.voxels.spacing()[0];  // of half a voxel
      Scene scene =
          with({beyond("held", {low - near_face + p.held_part * (high - low), 0, 0}, {-1, 0, 0}, Vec3::Zero())},
               Elasticity::corotational);
      if (p.is_pressed)
        scene.conditions.push_back(beyond("moved", {high + near_face, 0, 0}, {1, 0, 0}, {-4, 3, 0}));
      else
        scene.gravity = stability::earth;
      SolveReport report;
      solve_equilibrium(lattice, scene, 2, report);
      EXPECT_TRUE(report.converged) << p.name << ", shift " << n << ": " << report.reason;
      inverted += report.inverted_cells;
      least = std::min(least, report.strain_energy_n_mm);
      largest = std::max(largest, report.strain_energy_n_mm);
    }
    const std::string what = fmt::format("{}, {} shifts: spread of the strain energy", p.name, most * most * most);
    if (p.allowed)
      c.at_most(what, largest / least - 1, *p.allowed);
    else
      c.note(what, largest / least - 1);
    c.at_most(fmt::format("{}: inverted cells", p.name), double(inverted), 0);
  }
}

/// Corners that hardly carry move far for nothing: cells do not turn by them.
TEST(Slivers, CondensedCellsBendFarInAsFewStepsAsThePapers) {
  const Lattice lattice = liver_of_phantom(4, 0.3);
  const auto steps = [&](Stiffness stiffness) {
    Scene scene = with({beyond("held", {-30, 0, 0}, {-1, 0, 0}, Vec3::Zero())}, Elasticity::corotational);
    scene.gravity = {0, 0, -150e3};
    scene.stiffness = stiffness;
    int out = 0;
    for (const LevelReport& l : testing_support::solve(lattice, scene, 1).report.levels) out += l.newton.iterations;
    return out;
  };
  EXPECT_LE(steps(Stiffness::condensed), steps(Stiffness::exact));
}

}  // namespace test_slivers
