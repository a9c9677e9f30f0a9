// SPDX-License-Identifier: Apache-2.0
#include "level/segment_contact.h"

#include <fmt/format.h>

#include <algorithm>

#include "hexmesh/core/error.h"
#include "scene/solid_segments.h"

namespace hexsolver {
namespace {

using hexmesh::Error;
using hexmesh::ErrorKind;
using hexmesh::Lattice;

const hexmesh::LatticeSegment& solid_segment(const Contact& contact, const Lattice& lattice, const std::string& name) {
  if (const hexmesh::LatticeSegment* segment = find_solid_segment(lattice, name)) return *segment;
  throw Error(ErrorKind::input, fmt::format("contact '{}' ({}) is between '{}', expected two of: {}", contact.name,
                                            contact.where, name, names_of_solid_segments(lattice)));
}

/// The faces of a segment's voxels beside which there is another segment, or nothing with a material.
std::vector<hexmesh::ExposedFace> faces_of(const Lattice& lattice, std::uint16_t label, std::uint16_t other) {
  std::vector<bool> of(65536), towards(65536, true);
  of[label] = true;
  for (const hexmesh::LatticeSegment& s : lattice.segments)
    towards[s.segment.label] = !s.material || s.segment.label == other;
  return faces_between(lattice, of, towards);
}

}  // namespace

std::unique_ptr<PenaltyContact> make_segment_contact(const Contact& contact, const MeshCells& cells, const Mesh& mesh,
                                                     Selector& selector, bool is_hard) {
  const Lattice& lattice = cells.lattice();
  const auto& [first, second] = *contact.between;
  const hexmesh::LatticeSegment &one = solid_segment(contact, lattice, first),
                                &other = solid_segment(contact, lattice, second);
  const std::uint16_t label = one.segment.label, beside = other.segment.label;
  const std::vector<hexmesh::ExposedFace> faces = faces_of(lattice, label, beside);
  const bool touch =
      std::any_of(faces.begin(), faces.end(), [&](const auto& face) { return face.neighbour == beside; });
  if (!lattice.parting.slide(label, beside) && (touch || !lattice.parting.any()))
    throw Error(ErrorKind::input,
                fmt::format("contact '{}' ({}) is between '{}' and '{}', which the cells of the lattice "
                            "hold together, expected one of hexmesh build --slide {} {}",
                            contact.name, contact.where, first, second, first, second));
  hexmesh::SegmentDistance distance(lattice.voxels, lattice.labels, beside, label);
  const double at_once = std::min(distance.thickness() / 4, 2 * lattice.voxels.spacing().minCoeff());
  auto segment = std::make_unique<OtherSegment>(
      OtherSegment{std::move(distance), BodyMap(cells, mesh, beside), other.material->young, {}, at_once});
  for (const hexmesh::ExposedFace& face : faces) segment->touching.push_back(face.neighbour == beside);
  return std::make_unique<PenaltyContact>(contact, cells, mesh, selector.centers_of(faces), is_hard,
                                          std::move(segment));
}

}  // namespace hexsolver
