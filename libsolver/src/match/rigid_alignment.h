// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "match/matching.h"

namespace hexsolver {

/// The rigid motion that brings a body nearest to what it is to match: iterated closest points (Besl, McKay, IEEE
/// Trans. PAMI 14 (1992) 239), both ways, each step RigidFit's, of what is far let go. It starts from where the body
/// is; with a whole surface as target also from the middle of that, and turned so that their longest axes are along
/// each other, where that ends far nearer; with a part of one, and nothing near from there, turned all around; with
/// landmarks beside others also from where these put it.
Eigen::Isometry3d align(const Matchings& matchings);

/// The scene with the pose that align() finds, if it has a [[match]], no pose yet, and nothing that is held in space.
Scene placed(Scene scene, const Matchings& matchings);

}  // namespace hexsolver
