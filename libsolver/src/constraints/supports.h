// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "constraints/constraints.h"

namespace hexsolver {

/// A part of the body and the rigid motions that the supports leave it.
struct FreePart {
  std::vector<std::string> motions;  ///< in words
  std::vector<std::int32_t> cells;
  bool is_island = false;  ///< no point of it is held
  bool hangs = false;      ///< on another part by an edge or a corner
};

/// The parts that the prescribed displacements do not hold; empty where the body is held.
///
/// A part is made of cells joined through faces; parts that only share edges or corners are joined by hinges and ball
/// joints, and count as parts of their own. Free motions are the null space of all supports and joints on the rigid
/// motions of all parts.
std::vector<FreePart> free_parts(const Mesh& mesh, const std::vector<ConstraintPoint>& points);

/// Number of the part of each cell, cells joined through faces.
std::vector<std::int32_t> parts_of(const Mesh& mesh, std::size_t& num_parts);

/// "missing supports at level ..." with the first few of the motions.
std::string missing_supports(const std::vector<std::string>& motions, int level);

/// A part of a body, of cells joined through faces.
struct BodyPart {
  std::size_t num_cells = 0;
  Vec3 center = Vec3::Zero();  ///< [mm]
  double size = 0;             ///< radius, about [mm]
};

/// A node at which parts meet.
struct Joint {
  Vec3 position;                   ///< [mm]
  std::vector<std::size_t> parts;  ///< two or more
};

/// A point that a condition holds.
struct HeldPoint {
  std::size_t part = 0;
  Vec3 position;  ///< [mm]
  std::array<bool, 3> axes = {true, true, true};
  bool at_joint = false;
};

/// What a part is free to do.
struct FreeMotions {
  std::size_t part = 0;
  std::vector<std::string> words;
  bool is_island = false;  ///< nothing holds it but other parts
  bool hangs = false;      ///< on other parts, by an edge or a corner
};

/// Of each part that some motion of the parts against each other moves, in their order.
std::vector<FreeMotions> free_motions(const std::vector<BodyPart>& parts, const std::vector<Joint>& joints,
                                      const std::vector<HeldPoint>& points);

}  // namespace hexsolver
