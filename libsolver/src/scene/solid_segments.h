// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "hexmesh/lattice/lattice.h"

namespace hexsolver {

/// The segment of exactly that name, if it has a material; else null.
const hexmesh::LatticeSegment* find_solid_segment(const hexmesh::Lattice& lattice, const std::string& name);

/// Names of those that have one, "liver, tumour".
std::string names_of_solid_segments(const hexmesh::Lattice& lattice);

}  // namespace hexsolver
