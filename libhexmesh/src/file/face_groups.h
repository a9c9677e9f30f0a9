// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>

#include "hdf5.h"
#include "hexmesh/lattice/lattice.h"

namespace hexmesh::hdf5 {

/// The datasets `/faces/face` and `/faces/block`.
void write_faces(Writer& file, const SurfaceFaces& faces);

/// The faces of a lattice file, each block read when it is first asked for. They keep the file open.
/// @param lattice  read from it: each face is on a voxel of its finest level read, or of its labels
/// @throws Error{input}, when they are asked for too
std::shared_ptr<const SurfaceFaces> open_faces(const std::filesystem::path& path, const Lattice& lattice);

}  // namespace hexmesh::hdf5
