// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <vector>

#include "terms/elastic.h"

namespace hexsolver {

/// What the cells of a level went through, from F, the mean gradient over the filled part of each, and from det F where
/// their material is. Stretches and stresses are from where cells are free of stress, the rest from the shape at rest.
struct CellMeasures {
  std::array<std::vector<double>, 3> principal_stretch;  ///< singular values of F, the largest first
  std::vector<double> rotation_degrees;                  ///< angle of R in F = R S
  std::vector<double> von_mises_stress;                  ///< sqrt(3/2) |dev(Cauchy stress)| [MPa]
  std::vector<double> pressure;                          ///< -tr(Cauchy stress) / 3, compression positive [MPa]
  std::vector<double> smoothed_pressure;                 ///< averaged to the nodes by volume and back [MPa]
  std::vector<double> young_modulus, poisson_ratio;      ///< of the mean moduli over the filled part [MPa], [1]
  std::vector<double> min_jacobian;                      ///< least det F, see ElasticCells::jacobians
  std::vector<double> volume_ratio;                      ///< mean det F: the volume over that at rest
  std::vector<double> inverted_part;                     ///< of the material, where det F <= 0
  /// Root mean square, over the nodes with eight cells, of the part of their pressure that changes sign from cell to
  /// cell [MPa]: mean dilatation on a regular grid cannot tell it from none (Q1-P0; Hughes, The Finite Element Method,
  /// 1987, section 4.3).
  double pressure_checkerboard = 0;
  std::size_t checkerboard_nodes = 0;  ///< that it is of
};

/// @param counts  which nodes pressure_checkerboard is of; empty: all
CellMeasures measure_cells(const ElasticCells& cells, const NodeVector& u,
                           const std::function<bool(const Index3&)>& counts = {});

/// Of each cell: whether it, or one that shares a node with it, is nearly inside out somewhere.
/// @param u      of all nodes
/// @param least  det F below which that is so
/// @param share_nodes  tell other processes which nodes are of such cells, and hear it of theirs; nothing: there are
/// none
std::vector<bool> cells_near_folds(const ElasticCells& cells, const NodeVector& u, double least,
                                   const std::function<void(std::vector<bool>&)>& share_nodes = {});

}  // namespace hexsolver
