// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "hexmesh/scan/phantom.h"
#include "hexsolver/equilibrium.h"

/// The paper's experiments, as bodies and scenes.
namespace testing_support {

using hexmesh::Lattice;
using hexmesh::Vec3;

/// "beam", "cylinder", ...: a solid phantom centred at the origin.
hexmesh::LabelVolume solid(const char* name, double spacing, const std::map<std::string, double>& size);

bool has_scan();  ///< of TotalSegmentator, beside the project

hexsolver::Scene with(std::vector<hexsolver::Condition> conditions,
                      hexsolver::Elasticity elasticity = hexsolver::Elasticity::cauchy);

/// A lattice of the first segment alone, E in kPa.
Lattice lattice_of(hexmesh::LabelVolume volume, double young_kpa, double poisson);

Lattice liver_of_phantom(double spacing, double poisson);

/// The liver of the TotalSegmentator test scan; has_scan() must hold.
Lattice liver_of_scan(double poisson);

/// A condition on the places within `radius` of `center`.
hexsolver::Condition patch(const std::string& name, const Vec3& center, double radius, const Vec3& by,
                           hexsolver::SurfacePoints on = hexsolver::SurfacePoints::faces);

/// A condition on the places with (p - point) . normal >= 0.
hexsolver::Condition beyond(const std::string& name, const Vec3& point, const Vec3& normal, const Vec3& by,
                            hexsolver::SurfacePoints on = hexsolver::SurfacePoints::faces);

/// The ends z = -half and z = half clamped and moved together by `press` mm.
std::vector<hexsolver::Condition> pressed_ends(double half, double press);

/// The four places of the reference solutions on the liver of the scan, the last pulled by 40 mm.
std::vector<hexsolver::Condition> liver_patches(double radius, hexsolver::SurfacePoints on);

/// Three places of the phantom's liver held, the fourth pulled by 40 mm, as in the example scene.
std::vector<hexsolver::Condition> phantom_patches(double radius);

/// Displacements of a result at points of the body or within a cell of it [mm].
std::vector<Vec3> displacement_at(const hexmesh::Result& result, const std::vector<Vec3>& points);

/// Mean outward displacement of the mantle of a cylinder around z at z = 0 [mm].
double growth_half_way(const hexmesh::Result& result, double radius);

/// Centres of all voxels with material.
std::vector<Vec3> material_points(const Lattice& lattice);

/// A node of a reference solution.
struct NodeRow {
  Vec3 position, displacement;  ///< [mm]
};
std::vector<NodeRow> read_reference(const std::filesystem::path& gzipped_csv);

struct Distance {
  double mean = 0, largest = 0;
};
Distance distance(const std::vector<Vec3>& a, const std::vector<Vec3>& b);

/// Those inside the body.
std::vector<NodeRow> within(const Lattice& lattice, const std::vector<NodeRow>& rows);
Distance distance(const hexmesh::Result& result, const std::vector<NodeRow>& reference);

struct Solved {
  hexsolver::SolveReport report;
  hexmesh::Result result;
};

/// Solve; a failure to converge fails the test.
Solved solve(const Lattice& lattice, const hexsolver::Scene& scene, int level);

}  // namespace testing_support
