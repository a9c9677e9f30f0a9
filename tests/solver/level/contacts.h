// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "hexsolver/scene/scene.h"
#include "level/make_contacts.h"
#include "support/bodies.h"
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

/// Segments of one material in three levels, of labels from 1 on; the first two slide along each other, or none.
inline hexmesh::Lattice segments_of(const std::vector<std::string>& names, const hexmesh::Index3& extent,
                                    const hexsolver::Vec3& spacing,
                                    const std::function<int(const hexmesh::Index3&)>& label, bool slide = true,
                                    const hexmesh::Index3& offset = {0, 0, 0}) {
  constexpr double young_kpa = 10, poisson = 0.3;
  std::vector<hexmesh::LatticeSegment> segments;
  for (const std::string& name : names) {
    const auto number = static_cast<std::uint16_t>(segments.size() + 1);
    segments.push_back({{number, name}, hexmesh::material_from_units(young_kpa, poisson, 1000), 0, ""});
  }
  hexmesh::LatticeOptions options{3, offset, {}};
  if (slide) options.parting.sliding = {{1, 2}};
  return build_lattice(make_volume(extent, spacing, label), segments, options);
}

/// Cells of a level, or of number 2 graded ones, of levels 0 to 2.
inline hexsolver::MeshCells cells_of(const hexmesh::Lattice& lattice, int number) {
  if (number < 2) return {lattice, number};
  return {lattice, 0, 2, [](int, const hexmesh::Index3& cell) { return (cell[0] + 2 * cell[1] + cell[2]) % 3 == 0; }};
}

/// A contact within a body by itself, on such cells.
struct ContactOnLevel {
  ContactOnLevel(const hexsolver::Contact& scene, const hexmesh::Lattice& lattice, int number)
      : ContactOnLevel(scene, cells_of(lattice, number)) {}
  ContactOnLevel(const hexsolver::Contact& scene, const hexsolver::MeshCells& of) : cells(of) {
    hexsolver::Selector selector(cells, mesh);
    contact = hexsolver::make_segment_contact(scene, hexsolver::SegmentShapes().of(scene, 0, cells.lattice()), cells,
                                              mesh, selector, false);
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
