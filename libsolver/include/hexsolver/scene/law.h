// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace hexsolver {

/// The law of the cells: the measure of strain, and what energy it stores.
enum class Elasticity {
  cauchy,        ///< small strain, Hooke
  corotational,  ///< small strain in a frame that rotates with the cell, Hooke
  green_lagrange,
  neo_hookean,
  stable_neo_hookean
};

/// Whether the law is made for large strain, and integrated at points.
inline constexpr bool is_hyperelastic(Elasticity e) { return e != Elasticity::cauchy && e != Elasticity::corotational; }

/// How a co-rotational cell finds its rotation.
enum class Rotation {
  polar,  ///< of the mean gradient over the filled part; exact gradient and Hessian
  edges   ///< the paper's: orthonormalised averages of the cell's edges, held while forces are taken
};

/// How the volumetric part of the strain varies in a cell.
enum class Volumetric {
  mean,  ///< one dilatation per cell, so that coarse cells do not lock
  full   ///< the paper's
};

/// How a cell's stiffness follows from its voxels.
enum class Stiffness {
  exact,         ///< K_parent = sum L^T K_child L: soft where a cell is empty
  incompatible,  ///< less what incompatible modes relax, above level 0: cells that bend. Not at points (needs_points)
  condensed,     ///< the same with nodes inside cells nearly free, above level 0: as voxels let them; no motions
  uniform        ///< the fill-weighted full cell, for comparison
};

/// Whether cells know their stiffness alone, and none of it at points.
inline constexpr bool is_of_matrices(Stiffness stiffness) {
  return stiffness == Stiffness::incompatible || stiffness == Stiffness::condensed;
}

/// Whether cells ask for more of their elements than matrices. Those of condensed cells are made of the voxels'.
/// @param is_reshaped  whether they may be at rest elsewhere than on the lattice
inline constexpr bool needs_elements(Elasticity elasticity, Stiffness stiffness, bool is_reshaped) {
  const bool is_of_voxels = stiffness == Stiffness::exact || stiffness == Stiffness::condensed;
  return is_hyperelastic(elasticity) || !is_of_voxels || is_reshaped;
}

}  // namespace hexsolver
