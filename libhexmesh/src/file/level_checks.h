// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "cell_checks.h"

/// Whether the levels of a lattice file fit together; as cell_checks.h.
namespace hexmesh::hdf5 {

/// Elements, labels and parts of some or all cells of a level.
/// @param level  its elements are in `filled`, and `children` unless matrices are stored
void check_cells_of_level(const Reader& file, const Lattice& lattice, int level);

/// The elements of a level's cells hold as many voxels as the segments with material have.
void check_filled(const Reader& file, const Lattice& lattice, int level);

/// The cells of a level are the parents of those of the one before; where its elements have children, these are they.
void check_parents(const Reader& file, const Lattice& lattice, int level);

/// All of a lattice as far as it has been read.
void validate(const Reader& file, const Lattice& lattice);

}  // namespace hexmesh::hdf5
