// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <filesystem>
#include <stdexcept>

#include "cli/result_report.h"
#include "hexmesh/file/lattice_file.h"
#include "hexmesh/file/lattice_reader.h"
#include "hexmesh/file/result_file.h"
#include "hexmesh/lattice/check.h"
#include "hexmesh/lattice/element_tree.h"
#include "hexmesh/lattice/embedded_points.h"
#include "hexmesh/warp/bounds.h"

/// What tools do with the files that they read, in the libraries: whatever is read must bear it.
namespace fuzzing {

inline void expect(bool holds, const char* what) {
  if (!holds) throw std::logic_error(what);
}

inline void expect_finite(const std::vector<hexmesh::Vec3>& values, const char* what) {
  for (const hexmesh::Vec3& v : values) expect(v.allFinite(), what);
}

/// As hexsolve reads it at some level, without voxels.
inline void use_level(const std::filesystem::path& path, int level, int num_levels) {
  std::vector<int> levels;
  for (int n = level; n < num_levels; ++n) levels.push_back(n);
  const hexmesh::Lattice lattice =
      hexmesh::read_lattice(path, levels, hexmesh::Elements::stored, hexmesh::Voxels::left_out);
  const hexmesh::CellLocator locator(lattice.voxels, lattice.level(level).voxels_per_cell, lattice.level(level).cells);
  for (const hexmesh::ExposedFace& face : hexmesh::exposed_faces(lattice))
    expect(locator.in_cell_of_voxel(face.voxel, hexmesh::face_index(face)).cell >= 0, "a face without a cell");
  if (lattice.level(level).matrices.empty()) hexmesh::form_elements(lattice, level);
}

/// As hexmesh, hexsolve and hexexport read it.
/// @returns whether `hexmesh check` finds nothing
inline bool use_lattice(const std::filesystem::path& path) {
  const std::size_t num_levels = hexmesh::cells_of_levels(path).size();
  for (std::size_t n = 0; n < num_levels; ++n) use_level(path, static_cast<int>(n), static_cast<int>(num_levels));
  const hexmesh::Lattice lattice = hexmesh::read_lattice(path);
  hexmesh::classify_voxels(lattice);
  bool all_hold = hexmesh::is_as_written(path);
  for (const hexmesh::Finding& f : hexmesh::check_lattice(lattice)) all_hold &= f.holds();
  for (int n = 0; n < lattice.num_levels(); ++n) {
    const auto error = hexmesh::stored_matrix_error(path, lattice, n);
    all_hold &= !error || *error <= 1e-12;
    const hexmesh::Result rest = hexmesh::rest_state(lattice, n);
    expect_finite(rest.nodes, "a node at rest that is not finite");
  }
  hexmesh::content_checksum(path);
  return all_hold;
}

/// As hexexport and hexslice read it.
inline void use_result(const std::filesystem::path& path) {
  hexmesh::Result result = hexmesh::read_result(path);
  hextools::report_of(result);
  hexmesh::move_surface(result);
  expect_finite(result.surface_displacement, "a surface that moves to where no number is");
  const hexmesh::Bounds bounds = hexmesh::bounds_of(result);
  expect((bounds.high - bounds.low).allFinite(), "a body without bounds");
  for (std::size_t n = 0; n < result.times.size(); ++n) {
    const hexmesh::MotionStep step = hexmesh::read_step(path, result, n);
    expect_finite(step.displacement, "a state that is not finite");
  }
}

}  // namespace fuzzing
