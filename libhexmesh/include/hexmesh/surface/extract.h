// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hexmesh/lattice/lattice.h"
#include "hexmesh/result/result.h"

namespace hexmesh {

/// A smooth closed surface around one segment: flying edges (a marching cubes), then windowed-sinc smoothing, which
/// keeps the volume.
/// @param labels  of the voxels
/// @param label   of the segment
TriangleSurface extract_surface(const Grid& voxels, const std::vector<std::uint16_t>& labels, std::uint16_t label);

/// Likewise of a lattice with labels.
inline TriangleSurface extract_surface(const Lattice& lattice, std::uint16_t label) {
  return extract_surface(lattice.voxels, lattice.labels, label);
}

/// Give a lattice with labels the surfaces of its segments with material, one part after the other.
void add_surface(Lattice& lattice);

/// Give a result as read_result() reads it the surface that its file leaves out, one part after the other of each
/// segment with material, and move it. Nothing happens where it has one.
void add_surface(Result& result);

}  // namespace hexmesh
