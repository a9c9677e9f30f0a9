// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include "terms/contact.h"

namespace hexsolver {

/// The contact of two segments: the surface of the first, as it is at rest where they touch and wherever else nothing
/// is beside it, against the rest shape of the second. Or of the body, or a part of it that slides, with itself.
/// @param cells  of a lattice with labels
/// @throws Error{input} unless both have a material and the cells keep them apart; of the whole body with itself,
///                      where segments of it slide
std::unique_ptr<PenaltyContact> make_segment_contact(const Contact& contact, const MeshCells& cells, const Mesh& mesh,
                                                     Selector& selector, bool is_hard);

/// Where two segments touch at rest [mm]; of the body with itself nowhere.
/// @throws Error{input} likewise
std::vector<Vec3> places_of_touch(const Contact& contact, const hexmesh::Lattice& lattice);

}  // namespace hexsolver
