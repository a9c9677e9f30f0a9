// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>

#include "build_options.h"

namespace hextools {

/// The surface to show of each segment with material: one of the user's, one from the voxels with as many triangles as
/// asked for, or none.
class SurfaceMaker {
public:
  /// @throws Error{usage} naming what is wrong with --surface; Error{input} for an unknown segment
  SurfaceMaker(const BuildOptions& o, const BuildInputs& inputs, const hexmesh::Lattice& lattice);

  /// All of them as one. @param notes  gets warnings of surfaces that cross themselves
  /// @throws Error{geometry} for a surface that is not of this body
  hexmesh::TriangleSurface make(Notes& notes) const;

  /// Whether each is from the voxels, with as many triangles as these give.
  bool all_of_voxels() const { return triangles_.empty() && files_of_.empty(); }

private:
  std::uint16_t label_of(const std::string& name) const;
  hexmesh::TriangleSurface extracted(const hexmesh::LatticeSegment& s, Notes& notes) const;
  hexmesh::TriangleSurface embedded(const Input& file, std::uint16_t label) const;

  const hexmesh::Lattice& lattice_;
  std::map<std::uint16_t, std::size_t> triangles_;
  std::map<std::uint16_t, std::vector<const Input*>> files_of_;  ///< by label
};

}  // namespace hextools
