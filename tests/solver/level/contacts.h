// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include "hexsolver/scene/scene.h"
#include "level/segment_contact.h"
#include "terms/body_map.h"

/// What tests of contacts within a body share.
namespace testing_support {

/// The points behind a plane, held or moved.
inline hexsolver::Condition held(const std::string& name, const hexsolver::Vec3& point, const hexsolver::Vec3& normal,
                                 const hexsolver::Vec3& by = hexsolver::Vec3::Zero()) {
  hexsolver::Condition c;
  c.name = name;
  c.selection.halfspace = hexsolver::HalfSpace{point, normal};
  c.by = by;
  return c;
}

/// Cells of a level, or of number 2 graded ones, of levels 0 to 2.
inline hexsolver::MeshCells cells_of(const hexmesh::Lattice& lattice, int number) {
  if (number < 2) return {lattice, number};
  return {lattice, 0, 2, [](int, const hexmesh::Index3& cell) { return (cell[0] + 2 * cell[1] + cell[2]) % 3 == 0; }};
}

/// A contact within a body by itself, on such cells.
struct ContactOnLevel {
  ContactOnLevel(const hexsolver::Contact& scene, const hexmesh::Lattice& lattice, int number)
      : cells(cells_of(lattice, number)) {
    hexsolver::Selector selector(cells, mesh);
    contact = hexsolver::make_segment_contact(scene, cells, mesh, selector, false);
  }
  const hexsolver::MeshCells cells;
  const hexsolver::Mesh mesh = cells.make_mesh();
  std::unique_ptr<hexsolver::PenaltyContact> contact;
};

/// How far a place is beyond its cell, in edges: a body that fills its cells.
inline double beyond_cell(const hexsolver::BodyMap::Place& place) {
  return ((place.local.array() - 0.5).abs() - 0.5).maxCoeff();
}

}  // namespace testing_support
