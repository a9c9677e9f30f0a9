// SPDX-License-Identifier: Apache-2.0
// What is embedded is the body, wherever its lattice lies: volume, mass and inertia against the analytic ones.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <numbers>

#include "hexmesh/lattice/element_tree.h"
#include "hexmesh/scan/phantom.h"

namespace test_placement {

using namespace hexmesh;

struct Placement {
  const char* name;
  Vec3 rotation, shift;
};

void PrintTo(const Placement& p, std::ostream* out) { *out << p.name; }

/// Mass, centre of mass and int rho (x - center)(x - center)^T dV of a level. Quadratic functions are triquadratic, so
/// the 27 integrals of a cell give all three exactly.
struct Moments {
  double volume = 0, mass = 0;
  Vec3 center = Vec3::Zero();
  Mat3 second = Mat3::Zero();

  Moments(const Lattice& lattice, int number) {
    const Level& level = lattice.levels[static_cast<std::size_t>(number)];
    const std::vector<Element> elements = form_elements(lattice, number);
    const Mat3 edges = lattice.cell_edges(number);
    Mat3 about_origin = Mat3::Zero();
    for (std::size_t c = 0; c < level.cells.size(); ++c) {
      const Element& e = elements[static_cast<std::size_t>(level.element[c])];
      const Index3& ijk = level.cells[c];
      for (int q = 0; q < num_rule_points; ++q) {
        const Vec3 s(q % 3 / 2.0, q / 3 % 3 / 2.0, q / 9 / 2.0);
        const Vec3 x = lattice.corner() + edges * (Vec3(ijk[0], ijk[1], ijk[2]) + s);
        const double m = e.density[static_cast<std::size_t>(q)];
        volume += e.fill[static_cast<std::size_t>(q)];
        mass += m;
        center += m * x;
        about_origin += m * x * x.transpose();
      }
    }
    center /= mass;
    second = about_origin - mass * center * center.transpose();
  }
};

class BeamPlacement : public testing::TestWithParam<Placement> {};

TEST_P(BeamPlacement, VolumeMassAndInertiaAreThoseOfTheBeam) {
  constexpr double tolerance = 0.005;
  const Vec3 size(160, 40, 40);
  SolidPhantom beam;
  beam.rotation = GetParam().rotation;
  beam.shift = GetParam().shift;
  const LabelVolume volume = solid_phantom(beam);
  const Lattice lattice =
      build_lattice(volume, {{volume.segments[0], material_from_units(100, 0.3, 1000), 0, "given"}});

  constexpr double radians = std::numbers::pi / 180;
  const Mat3 rotation = (Eigen::AngleAxisd(beam.rotation[2] * radians, Vec3::UnitZ()) *
                         Eigen::AngleAxisd(beam.rotation[1] * radians, Vec3::UnitY()) *
                         Eigen::AngleAxisd(beam.rotation[0] * radians, Vec3::UnitX()))
                            .toRotationMatrix();
  const double expected_mass = size.prod() * 1e-9;
  const Mat3 expected_second = expected_mass / 12 * rotation * size.cwiseAbs2().asDiagonal() * rotation.transpose();
  double volume_error = 0, inertia_error = 0;
  for (int level = 0; level < static_cast<int>(lattice.levels.size()); ++level) {
    const Moments m(lattice, level);
    EXPECT_NEAR(m.volume, size.prod(), tolerance * size.prod()) << "level " << level;
    EXPECT_NEAR(m.mass, expected_mass, tolerance * expected_mass);
    EXPECT_LT((m.center - beam.shift).cwiseAbs().maxCoeff(), 0.5001 * beam.spacing);  // voxels round to whole ones
    // The inertia tensor tr(S) 1 - S, compared by its norm.
    const auto inertia = [](const Mat3& second) -> Mat3 { return second.trace() * Mat3::Identity() - second; };
    const double error = (inertia(m.second) - inertia(expected_second)).norm() / inertia(expected_second).norm();
    EXPECT_LT(error, tolerance) << "level " << level;
    volume_error = std::max(volume_error, std::abs(m.volume / size.prod() - 1));
    inertia_error = std::max(inertia_error, error);
  }
  printf("beam, %s: volume off by %.2g %%, inertia by %.2g %%\n", GetParam().name, 100 * volume_error,
         100 * inertia_error);
}

INSTANTIATE_TEST_SUITE_P(Placements, BeamPlacement,
                         testing::Values(Placement{"best position", {0, 0, 0}, {0, 0, 0}},
                                         Placement{"shifted", {0, 0, 0}, {0.7, 1, 1.3}},
                                         Placement{"rotated by 20 degrees about z", {0, 0, 20}, {0, 0, 0}},
                                         Placement{"rotated by 30 degrees about z", {0, 0, 30}, {0.3, 0.9, 0.5}},
                                         Placement{"rotated by 20 and 30 degrees", {0, 20, 30}, {0.7, 0.2, 1.1}}));

}  // namespace test_placement
