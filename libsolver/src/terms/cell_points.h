// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "hexmesh/lattice/quadrature.h"
#include "mesh/mesh.h"

namespace hexsolver {

/// A point of the material of a cell, and what it stands for; see hexmesh::MaterialPoint.
struct CellPoint {
  NodeGradients gradient;  ///< of N_a, by the place at rest [1/mm]
  double volume = 0;       ///< [mm^3]
  double shear = 0;        ///< int mu dV [N mm]
  double bulk = 0;         ///< int kappa dV [N mm]
};
using CellPoints = std::vector<CellPoint>;

/// @param edges  columns = the cell's edge vectors [mm]
CellPoints make_cell_points(const std::vector<hexmesh::MaterialPoint>& points, const Mat3& edges);

/// The same material in a cell whose corners are at rest elsewhere: with f = 1 + sum to_rest_a grad N_a^T, the
/// gradients f^-T grad N_a and det f times the volume, shear and bulk.
/// @param to_rest  of the corners, from the lattice [mm]
/// @returns false where some det f <= 0; `out` is then of no meaning
bool reshape(const CellPoints& on_lattice, const CellVector& to_rest, CellPoints& out);

/// What cells of points have in the mean.
struct PointMeans {
  NodeGradients gradient;  ///< [1/mm]
  double volume = 0;       ///< sum [mm^3]
  double shear = 0;        ///< sum [N mm]
  double bulk = 0;         ///< sum [N mm]
};
PointMeans means(const CellPoints& points);

/// K of Hooke's law, (3) in THEORY.md, by the points.
CellMatrix stiffness_by_points(const CellPoints& points, bool mean_dilatation);

/// K v by the points, without K.
CellVector forces_by_points(const CellPoints& points, bool mean_dilatation, const CellVector& v);

}  // namespace hexsolver
