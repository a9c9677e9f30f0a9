// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hexmesh/lattice/lattice.h"

namespace hexmesh {

/// The segments of a lattice with what they are made of.
struct AssignedMaterials {
  std::vector<LatticeSegment> segments;         ///< those that occur, ascending by label
  std::map<std::uint16_t, MaterialRule> rules;  ///< of the segments whose material follows the grey values
  std::vector<std::string> notes;               ///< one line for each default that was taken
};

/// Materials of all segments that occur in the volume.
/// @param choices  by segment name, "*" for all that are not named; a name that is not a segment is an error
/// @throws Error{input} naming a segment without material or with one out of bounds
AssignedMaterials assign_materials(const LabelVolume& volume, const std::map<std::string, MaterialChoice>& choices);

}  // namespace hexmesh
