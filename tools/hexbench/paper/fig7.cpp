// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <numbers>

#include "hexbench/experiments.h"
#include "hexmesh/scan/phantom.h"
#include "measurements.h"

namespace hextools::paper {
namespace {

using hexmesh::Lattice;
using hexmesh::Mat3;
using hexmesh::Vec3;
using hexsolver::Scene;
using hexsolver::Stiffness;

struct Placement {
  std::string name;
  Vec3 rotation = Vec3::Zero();        ///< about x, y, z [degrees]
  hexmesh::Index3 offset = {0, 0, 0};  ///< of the lattice [voxels]
};

/// Rotation of a solid phantom.
Mat3 rotation_of(const Placement& p) {
  const Vec3 radians = p.rotation * std::numbers::pi / 180;
  return (Eigen::AngleAxisd(radians[2], Vec3::UnitZ()) * Eigen::AngleAxisd(radians[1], Vec3::UnitY()) *
          Eigen::AngleAxisd(radians[0], Vec3::UnitX()))
      .toRotationMatrix();
}

}  // namespace

std::vector<Row> fig7(const Console& console) {
  constexpr double young_kpa = 300, tip_reference = 20.7362, length = 160, width = 40;  // mm; quadratic elements, StVK
  std::vector<Vec3> places;                                                             // of the beam, in its own frame
  for (double x = -length / 2 + 4; x < length / 2; x += 8)
    for (double y = -width / 2 + 4; y < width / 2; y += 8)
      for (double z = -width / 2 + 4; z < width / 2; z += 8) places.emplace_back(x, y, z);
  const std::vector<Vec3> tip = {{length / 2, 0, 0}};
  struct Bent {
    std::vector<Vec3> u;  // at `places`, in the beam's frame
    double sag;           // of the tip
  };
  bool converged = true;
  const auto bend = [&](const Placement& p, Stiffness stiffness, int level) {
    hexmesh::SolidPhantom beam;
    beam.rotation = p.rotation;
    const Lattice lattice = lattice_of(hexmesh::solid_phantom(beam), young_kpa, 0.3, {0, p.offset});
    const Mat3 r = rotation_of(p);
    Scene scene;
    scene.stiffness = stiffness;
    scene.gravity = r * Vec3(0, 0, -9810);
    // The staircase of a rotated end is within a voxel of it.
    scene.conditions = {beyond("end", -r * Vec3(length / 2 - 0.8, 0, 0), -r.col(0), Vec3::Zero())};
    const Outcome s = solve(lattice, scene, level);
    converged = converged && s.converged;
    const auto in_frame = [&](const std::vector<Vec3>& where) {
      std::vector<Vec3> there;
      for (const Vec3& x : where) there.push_back(r * x);
      std::vector<Vec3> u = s.at(there);
      for (Vec3& v : u) v = r.transpose() * v;
      return u;
    };
    return Bent{in_frame(places), -in_frame(tip).front()[2]};
  };
  const std::vector<Placement> placements = {{"well fitted"},
                                             {"shifted by (6, 2, 4) mm", Vec3::Zero(), {3, 1, 2}},
                                             {"rotated by 20 degrees about z", {0, 0, 20}},
                                             {"rotated by 20 and 30 degrees", {0, 20, 30}}};
  std::vector<Bent> fine;
  for (const Placement& p : placements) fine.push_back(bend(p, Stiffness::exact, 0));
  std::vector<Row> rows;
  for (const int level : {3, 2}) {
    const Bent fitted = bend(placements.front(), Stiffness::exact, level);
    for (std::size_t n = 0; n < placements.size(); ++n) {
      const Bent ours = bend(placements[n], Stiffness::exact, level);
      const Bent uniform = bend(placements[n], Stiffness::uniform, level);
      const Distances to_fitted = distances(ours.u, fitted.u);
      const double to_fine = distances(ours.u, fine[n].u).mean, uniform_to_fine = distances(uniform.u, fine[n].u).mean;
      Row row = {{"case", fmt::format("{} mm cells, {}: to the well fitted [mm]", 2 << level, placements[n].name)},
                 {"paper", nullptr},
                 {"ours", to_fitted.mean},
                 {"reference", 0}};
      row["ours_min"] = to_fitted.min;
      row["ours_max"] = to_fitted.max;
      row["ours_std"] = to_fitted.deviation;
      row["to_fine_mm"] = to_fine;
      row["uniform_to_fine_mm"] = uniform_to_fine;
      row["reading"] = fmt::format(
          "{}to 2 mm cells {:.3f} mm, uniform cells {:.3f} mm; the tip sags by {:.2f} mm, 2 mm cells {:.2f}, quadratic "
          "elements of St. Venant-Kirchhoff material {:.2f}",
          converged ? "" : "NOT CONVERGED; ", to_fine, uniform_to_fine, ours.sag, fine[n].sag, tip_reference);
      rows.push_back(std::move(row));
    }
    console.note(fmt::format("fig7: {} mm cells done", 2 << level));
  }
  return rows;
}

}  // namespace hextools::paper
