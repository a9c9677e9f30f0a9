// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hexmesh/tetra/tet_mesh.h"

namespace testing_support {

/// A box with its lower corner at the origin, each of its bricks cut into six tetrahedra of 4 nodes around a diagonal.
hexmesh::TetMesh box_of_tets(const hexmesh::Vec3& size, const hexmesh::Index3& bricks);

}  // namespace testing_support
