// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "hexmesh/core/grid.h"

namespace hexsolver {

using hexmesh::Index3;
using hexmesh::Mat3;
using hexmesh::Vec3;

/// Values at nodes: (x, y, z) of node 0, of node 1, ...; length 3 num_nodes.
using NodeVector = Eigen::VectorXd;

}  // namespace hexsolver
