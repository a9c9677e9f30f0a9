// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "hexmesh/tetra/tet_mesh.h"

namespace hexmesh {

/// Read the tetrahedra of 4 or 10 nodes (those of 10 with straight edges) of a VTK XML unstructured grid (.vtu), a Gmsh
/// mesh in text (.msh, versions 1, 2 and 4.1) or an Abaqus or CalculiX deck (.inp: *NODE, *ELEMENT of a type that
/// starts with C3D4 or C3D10). Other elements are left out; node numbers may have gaps; inside-out ones are turned.
/// Coordinates are taken as LPS in mm. Their segments are 0.
/// @throws Error{input}, also where there is no tetrahedron, or both kinds
TetMesh read_tetrahedra(const std::filesystem::path& path);

}  // namespace hexmesh
