// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "terms/contact.h"

namespace hexsolver {

/// What a contact within the body knows of the voxels, whatever the level.
struct SegmentShape {
  std::vector<bool> second;                 ///< of each label, whether the second has it
  double young;                             ///< of the second, where it is softest [MPa]
  std::vector<hexmesh::ExposedFace> faces;  ///< of the first, or of the body itself
  std::vector<bool> touching;               ///< of these, see OtherSegment
  std::vector<double> outside;
  std::shared_ptr<const hexmesh::SegmentDistance> distance;  ///< from the second
};

/// The shapes of a lattice's contacts, for all its levels: they take seconds and are made when first asked for.
class SegmentShapes {
public:
  /// @param number  of the contact in the scene
  /// @throws Error{input} unless both have a material and the cells keep them apart; of the whole body with itself,
  ///                      where segments of it slide; for what is too thin to have a side
  const SegmentShape& of(const Contact& contact, std::size_t number, const hexmesh::Lattice& lattice);

private:
  std::vector<std::unique_ptr<const SegmentShape>> shapes_;
};

/// Of two segments: the surface of the first, as it is at rest where they touch and wherever else nothing is beside it,
/// against the rest shape of the second. Of the body, or a part of it that slides, with itself likewise.
/// @param cells  of a lattice with labels
/// @param shape  of the contact
std::unique_ptr<PenaltyContact> make_segment_contact(const Contact& contact, const SegmentShape& shape,
                                                     const MeshCells& cells, const Mesh& mesh, Selector& selector,
                                                     bool is_hard);

/// Of a scene: these, and the body's surface against obstacles.
/// @param shapes  of the lattice under the scene, which this adds to
/// @throws Error{input} as SegmentShapes::of()
std::vector<std::unique_ptr<PenaltyContact>> make_contacts(const Scene& scene, const MeshCells& cells, const Mesh& mesh,
                                                           Selector& selector, SegmentShapes& shapes);

/// Where two segments touch at rest [mm]; of the body with itself nowhere.
/// @throws Error{input} as SegmentShapes::of()
std::vector<Vec3> places_of_touch(const Contact& contact, const hexmesh::Lattice& lattice);

}  // namespace hexsolver
