// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "hexmesh/core/grid.h"

namespace hexmesh {

/// Node a of a cell sits at corner (a & 1, a >> 1 & 1, a >> 2).
inline constexpr int num_cell_nodes = 8;

/// The nodes of a cell as VTK and CalculiX order them, around each of two faces. For exports only.
inline constexpr std::array<std::size_t, 8> corners_around_faces = {0, 1, 3, 2, 4, 5, 7, 6};

inline constexpr int corner_bit(int node, int axis) { return node >> axis & 1; }

using CellVector = Eigen::Matrix<double, 24, 1>;   ///< 8 nodes x (x, y, z), node major
using CellMatrix = Eigen::Matrix<double, 24, 24>;  ///< symmetric, node major
using NodeWeights = Eigen::Matrix<double, 8, 1>;
using NodeGradients = Eigen::Matrix<double, 8, 3>;  ///< row a = gradient of N_a

/// Trilinear shape functions N_a = prod_d (a_d ? s_d : 1 - s_d) on the unit cell.
/// @param s  position in the cell, [0, 1]^3 (outside: extrapolated)
NodeWeights shape_functions(const Vec3& s);

/// The position in the cell whose weights these are: shape_functions() the other way.
Vec3 local_position(const NodeWeights& weights);

/// d N_a / d s_d at s; shape (8, 3).
NodeGradients shape_gradients(const Vec3& s);

/// Values at the nodes of a cell that starts at the origin, of the field u = gradient x.
/// @param edges  columns = the cell's edge vectors
CellVector linear_field(const Mat3& edges, const Mat3& gradient);

}  // namespace hexmesh
