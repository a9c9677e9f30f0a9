// SPDX-License-Identifier: Apache-2.0
// Thin and stringy bodies, and bodies that are hardly any.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "hexmesh/core/error.h"
#include "hexmesh/surface/surface_file.h"
#include "hexmesh/surface/voxelize.h"
#include "motions.h"
#include "record.h"
#include "support/experiments.h"
#include "support/files.h"
#include "support/solve.h"

namespace test_shapes {

using namespace hexsolver;
using namespace testing_support;
using stability::Case;

constexpr const char* thin = "05 thin and stringy";
constexpr const char* degenerate = "12 degenerate input";

Lattice soft(const Index3& extent, double spacing, const std::function<int(const Index3&)>& label) {
  return lattice_of(make_volume(extent, Vec3::Constant(spacing), label), 100, 0.3);
}

int sheet(const Index3& i) { return i[2] == 4 || i[0] < 3 ? 1 : 0; }
int line(const Index3& i) { return (i[1] == 4 && i[2] == 4) || i[0] < 3 ? 1 : 0; }
int comb(const Index3& i) { return (i[1] % 2 == 0 && i[2] % 2 == 0) || i[0] < 3 ? 1 : 0; }

std::vector<Condition> held_left(double spacing) {
  return {beyond("held", {0.1 * spacing, 0, 0}, {-1, 0, 0}, Vec3::Zero())};
}

struct Shape {
  const char* name;
  int (*label)(const Index3&);
};
const Shape shapes[] = {{"sheet of one voxel", sheet}, {"line of one voxel", line}, {"comb of lines", comb}};

/// A message of the error that solving ends with, or "".
std::string refusal(const Lattice& lattice, const Scene& scene, int level, SolveReport& report,
                    hexmesh::ErrorKind expected) {
  try {
    solve_equilibrium(lattice, scene, level, report);
  } catch (const hexmesh::Error& e) {
    EXPECT_EQ(e.kind(), expected) << e.what();
    return e.what();
  }
  return "";
}

TEST(Thin, SheetsAndLinesBendUnderTheirWeight) {
  for (const Shape& shape : shapes) {
    Case c(thin, fmt::format("{}, 20 voxels of 2 mm, under its weight", shape.name));
    const Lattice lattice = soft({20, 9, 9}, 2, shape.label);
    Scene scene = with(held_left(2), Elasticity::corotational);
    scene.gravity = stability::earth / 10;
    double residual = 0;
    std::size_t inverted = 0;
    for (int level = 0; level < static_cast<int>(lattice.levels.size()); ++level) {
      SolveReport report;
      solve_equilibrium(lattice, scene, level, report);
      EXPECT_TRUE(report.converged) << shape.name << " level " << level << ": " << report.reason;
      residual = stability::worst(residual, report.relative_residual);
      inverted += report.inverted_cells;
    }
    c.at_most("largest relative residual, all levels", residual, scene.tolerance);
    c.at_most("inverted cells", double(inverted), 0);
  }
}

TEST(Thin, PartsThatHangByAnEdgeOrACornerAreTold) {
  Case c(thin, "two blocks joined by an edge, and by a corner, of a voxel");
  for (const bool by_corner : {false, true}) {
    const char* joint = by_corner ? "corner" : "edge";
    const Lattice lattice = soft({12, 12, 12}, 2, [&](const Index3& i) {
      const bool first = i[0] < 6 && i[1] < 6 && (!by_corner || i[2] < 6);
      const bool second = i[0] >= 6 && i[1] >= 6 && (!by_corner || i[2] >= 6);
      return first || second ? 1 : 0;
    });
    Scene scene = with(held_left(2), Elasticity::corotational);
    scene.gravity = stability::earth / 10;
    for (int level = 0; level < 3; ++level) {
      SolveReport report;
      const std::string message = refusal(lattice, scene, level, report, hexmesh::ErrorKind::geometry);
      if (level == 0) {
        EXPECT_NE(message.find("free to turn"), std::string::npos) << message;
        c.note(fmt::format("by {} {}: refused, exit 4, with", by_corner ? "a" : "an", joint), message);
      } else {
        // Cells of 2 voxels meet the joint as voxels do; those of 4 hold some of both blocks, and so join them.
        EXPECT_EQ(message.empty(), level == 2) << message;
        EXPECT_EQ(report.converged, level == 2) << report.reason;
      }
      for (const Islands islands : {Islands::drop, Islands::hold}) {
        scene.islands = islands;
        SolveReport other;
        EXPECT_EQ(refusal(lattice, scene, level, other, hexmesh::ErrorKind::geometry), "");
        EXPECT_TRUE(other.converged) << other.reason;
      }
      scene.islands = Islands::error;
    }
  }
}

TEST(Thin, IslandsAreToldDroppedOrHeld) {
  Case c(thin, "a held block and 40 specks that nothing holds");
  const Lattice lattice = soft({20, 20, 12}, 2, [](const Index3& i) {
    return i[0] < 6 || (i[0] % 3 == 1 && i[1] % 4 == 1 && i[2] % 6 == 1) ? 1 : 0;
  });
  Scene scene = with(held_left(2), Elasticity::corotational);
  scene.gravity = stability::earth / 10;
  SolveReport none;
  EXPECT_NE(refusal(lattice, scene, 0, none, hexmesh::ErrorKind::geometry).find("islands"), std::string::npos);
  for (const Islands islands : {Islands::drop, Islands::hold}) {
    scene.islands = islands;
    SolveReport report;
    const hexmesh::Result r = solve_equilibrium(lattice, scene, 0, report);
    EXPECT_TRUE(report.converged) << report.reason;
    double most = 0;
    for (const Vec3& u : r.displacement) most = stability::worst(most, u.norm());
    c.note(islands == Islands::drop ? "cells dropped" : "cells held", double(report.dropped_cells + report.held_cells));
    c.at_most(fmt::format("{}: largest displacement [mm]", islands == Islands::drop ? "drop" : "hold"), most, 5);
  }
}

/// A sheet rolled up one and a half times around z, open on all sides.
hexmesh::TriangleSurface rolled_sheet() {
  constexpr int around = 60, along = 12;
  hexmesh::TriangleSurface out;
  for (int a = 0; a <= around; ++a)
    for (int l = 0; l <= along; ++l) {
      const double angle = 3 * std::numbers::pi * a / around, radius = 20 + 20.0 * a / around;
      out.points.emplace_back(radius * std::cos(angle), radius * std::sin(angle), 60.0 * l / along);
      if (a == around || l == along) continue;
      const std::int32_t n = a * (along + 1) + l, beside = n + along + 1;
      out.triangles.push_back({n, beside, n + 1});
      out.triangles.push_back({n + 1, beside, beside + 1});
    }
  return out;
}

void hangs(const std::string& name, const hexmesh::Shape& shape) {
  Case c(thin, name + " of an open surface, one voxel thin");
  Vec3 low = shape.surface.points[0], high = low;
  for (const Vec3& p : shape.surface.points) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  const Vec3 size = high - low;
  const double spacing = size.maxCoeff() / 60;
  const hexmesh::Grid grid = hexmesh::grid_around({shape}, spacing);
  hexmesh::LabelVolume volume{grid, std::vector<std::uint16_t>(grid.num_voxels()), {{1, name}}};
  for (const std::size_t v : hexmesh::voxelize(shape, grid).voxels) volume.labels[v] = 1;
  const Lattice lattice =
      hexmesh::build_lattice(volume, {{volume.segments[0], hexmesh::material_from_units(100, 0.3, 1000), 0, ""}});
  for (int level = 0; level < 3; ++level) {
    Scene scene =
        with({beyond("held", {low[0] + 0.1 * size[0], 0, 0}, {-1, 0, 0}, Vec3::Zero())}, Elasticity::corotational);
    scene.islands = Islands::drop;
    scene.gravity = Vec3(0, -1, 0) * 0.01 * 0.1 / (1e-9 * size.maxCoeff());  // weighs a hundredth of E a length
    SolveReport report;
    solve_equilibrium(lattice, scene, level, report);
    EXPECT_TRUE(report.converged) << report.reason;
    c.at_most(fmt::format("level {}, {} cells: relative residual", level, report.levels.back().cells),
              report.relative_residual, scene.tolerance);
  }
}

TEST(Thin, OpenSurfacesHangByOneEnd) {
  hexmesh::Shape sheet;
  sheet.surface = rolled_sheet();
  hangs("a rolled sheet", sheet);
  const std::filesystem::path dragon = shared_data() / "data/sofa-meshes/dragon.obj";
  if (std::filesystem::exists(dragon)) hangs("the dragon", hexmesh::read_shape(dragon));
}

class ThinInMotion : public testing::TestWithParam<Rotation> {};

TEST_P(ThinInMotion, GainsNoEnergy) {
  for (const Shape& shape : shapes) {
    Case c(thin, fmt::format("motion of a {}, {}", shape.name, stability::name_of(GetParam())));
    const Lattice lattice = soft({20, 9, 9}, 2, shape.label);
    double gain = 0;
    for (int level = 0; level < 3; ++level) {
      Scene scene = stability::starved(GetParam());
      scene.gravity = stability::earth;
      scene.conditions = held_left(2);
      Motion motion(lattice, scene, level);
      const stability::Run r = stability::run(motion, 300);
      EXPECT_TRUE(r.finished) << r.reason;
      gain = stability::worst(gain, r.largest_gain);
    }
    c.at_most("energy gained in a step", gain, stability::allowed_gain(GetParam()));
  }
}

INSTANTIATE_TEST_SUITE_P(Rotations, ThinInMotion, testing::Values(Rotation::polar, Rotation::edges),
                         [](const auto& p) { return stability::name_of(p.param); });

TEST(Degenerate, OneVoxel) {
  Case c(degenerate, "one voxel, one face moved by half its edge");
  const Lattice lattice = soft({1, 1, 1}, 2, [](const Index3&) { return 1; });
  Scene scene = with({beyond("held", {-0.9, 0, 0}, {-1, 0, 0}, Vec3::Zero(), SurfacePoints::nodes),
                      beyond("moved", {0.9, 0, 0}, {1, 0, 0}, {1, 0, 0}, SurfacePoints::nodes)},
                     Elasticity::corotational);
  SolveReport report;
  solve_equilibrium(lattice, scene, 0, report);
  EXPECT_TRUE(report.converged) << report.reason;
  // All nodes are held: uniaxial strain of 1/2, W = (lambda + 2 mu) strain^2 / 2 V.
  const hexmesh::Material m = hexmesh::material_from_units(100, 0.3, 1000);
  const double modulus = m.bulk_modulus() + 4.0 / 3 * m.shear_modulus();
  c.at_most("strain energy off that of uniaxial strain, relative",
            std::abs(report.strain_energy_n_mm / (modulus * 0.125 * 8) - 1), 1e-12);
}

TEST(Degenerate, OneLayerAndHoles) {
  Case c(degenerate, "one layer of voxels; a block with a hole through it and a cavity");
  Scene scene = with(held_left(2), Elasticity::corotational);
  scene.gravity = stability::earth / 100;
  double residual = 0;
  for (const Lattice& lattice :
       {soft({12, 12, 1}, 2, [](const Index3&) { return 1; }), soft({12, 12, 12}, 2, [](const Index3& i) {
          const bool hole = std::abs(i[1] - 5) < 2 && std::abs(i[2] - 5) < 2;
          const bool cavity = i[0] == 9 && i[1] == 10 && i[2] == 10;
          return hole || cavity ? 0 : 1;
        })})
    for (int level = 0; level < static_cast<int>(lattice.levels.size()); ++level) {
      SolveReport report;
      solve_equilibrium(lattice, scene, level, report);
      EXPECT_TRUE(report.converged) << "level " << level << ": " << report.reason;
      residual = stability::worst(residual, report.relative_residual);
    }
  c.at_most("largest relative residual, all levels", residual, scene.tolerance);
}

TEST(Degenerate, FiveThousandComponents) {
  Case c(degenerate, "5,000 voxels that do not touch, and a block");
  const Lattice lattice = soft({60, 40, 40}, 2, [](const Index3& i) {
    return i[0] < 8 || (i[0] >= 10 && i[0] % 2 == 0 && i[1] % 2 == 0 && i[2] % 2 == 0 &&
                        ((i[0] - 10) / 2 * 20 + i[1] / 2) * 20 + i[2] / 2 < 5000)
               ? 1
               : 0;
  });
  Scene scene = with(held_left(2), Elasticity::corotational);
  scene.gravity = stability::earth / 100;
  SolveReport none;
  const std::string message = refusal(lattice, scene, 0, none, hexmesh::ErrorKind::geometry);
  c.note("refused with", message.substr(0, 160));
  EXPECT_NE(message.find("islands"), std::string::npos) << message;
  EXPECT_LT(message.size(), 600U);
  for (const Islands islands : {Islands::drop, Islands::hold})
    for (int level = 0; level < 3; ++level) {
      scene.islands = islands;
      SolveReport report;
      solve_equilibrium(lattice, scene, level, report);
      EXPECT_TRUE(report.converged) << report.reason;
      if (level == 0)
        c.at_least(islands == Islands::drop ? "cells dropped" : "cells held",
                   double(report.dropped_cells + report.held_cells), 5000);
    }
}

TEST(Degenerate, NoLoad) {
  Case c(degenerate, "nothing pulls");
  const Lattice lattice = soft({8, 8, 8}, 2, [](const Index3&) { return 1; });
  double most = 0;
  for (const Elasticity e : {Elasticity::cauchy, Elasticity::corotational, Elasticity::green_lagrange,
                             Elasticity::neo_hookean, Elasticity::stable_neo_hookean})
    for (int level = 0; level < 3; ++level) {
      SolveReport report;
      Scene scene = with(held_left(2), e);
      const hexmesh::Result r = solve_equilibrium(lattice, scene, level, report);
      EXPECT_TRUE(report.converged) << report.reason;
      for (const Vec3& u : r.displacement) most = stability::worst(most, u.norm());
    }
  c.at_most("largest displacement, five laws, levels 0 to 2 [mm]", most, 1e-12);
}

TEST(Degenerate, SegmentsWithoutStiffnessAreRefused) {
  Case c(degenerate, "E = 0");
  const hexmesh::LabelVolume volume = make_volume({4, 4, 4}, {2, 2, 2}, [](const Index3&) { return 1; });
  const std::string message = message_of(hexmesh::ErrorKind::input, [&] {
    hexmesh::build_lattice(volume, {{volume.segments[0], hexmesh::material_from_units(0, 0.3, 1000), 0, ""}});
  });
  EXPECT_NE(message.find("young"), std::string::npos) << message;
  c.note("refused, exit 3, with", message);
}

}  // namespace test_shapes
