// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "hexmesh/result/result.h"

namespace hexmesh {

/// Write the model of a result as an input deck of CalculiX (and of other programs that read Abaqus decks): voxels as
/// C3D8, each segment its elastic material, conditions on lattice nodes as prescribed displacements, forces and gravity
/// as forces on nodes, one linear static step. Units mm, N, MPa.
/// @throws Error{input} for what such a deck cannot say: partly filled cells, materials that follow grey values,
///   conditions on other points than nodes
void write_calculix_deck(const Result& result, const std::filesystem::path& path);

}  // namespace hexmesh
