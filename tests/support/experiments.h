// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "hexbench/experiments.h"
#include "hexsolver/equilibrium/equilibrium.h"

namespace testing_support {

using hexmesh::Lattice;
using hexmesh::Vec3;
using hextools::beyond;
using hextools::circle;
using hextools::lattice_of;
using hextools::liver_of_phantom;
using hextools::material_points;
using hextools::patch;
using hextools::phantom_patches;
using hextools::pressed_ends;
using hextools::solid;

bool has_scan();        ///< of TotalSegmentator, beside the project
bool has_references();  ///< of its liver by other programs, and it

/// A scene that does not look at the next level for its error.
hexsolver::Scene with(std::vector<hexsolver::Condition> conditions,
                      hexsolver::Elasticity elasticity = hexsolver::Elasticity::cauchy);

/// The liver of the TotalSegmentator test scan; has_scan() must hold.
Lattice liver_of_scan(double poisson);

/// The four places of the reference solutions on the liver of the scan, the last pulled by 40 mm.
std::vector<hexsolver::Condition> liver_patches(double radius, hexsolver::SurfacePoints on);

/// Displacements of a result at points of the body or within a cell of it [mm]; other points fail the test.
std::vector<Vec3> displacement_at(const hexmesh::Result& result, const std::vector<Vec3>& points);

/// Mean outward displacement of the mantle of a cylinder around z at z = 0 [mm].
double growth_half_way(const hexmesh::Result& result, double radius);

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
