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
  std::vector<bool> is_beside(65536, true);
  for (const hexmesh::LatticeSegment& s : lattice.segments) is_beside[s.segment.label] = !s.material;
  is_beside[other] = true;
  std::vector<hexmesh::ExposedFace> out;
  for (std::size_t n = 0; n < lattice.labels.size(); ++n) {
    if (lattice.labels[n] != label) continue;
    const Index3 voxel = lattice.voxels.index(n);
    for (std::uint8_t side = 0; side < 6; ++side) {
      Index3 beyond = voxel;
      beyond[side / 2] += side % 2 ? 1 : -1;
      const std::uint16_t beside =
          lattice.voxels.contains(beyond) ? lattice.labels[lattice.voxels.offset(beyond)] : std::uint16_t{0};
      if (is_beside[beside]) out.push_back({voxel, side, beside});
    }
  }
  return out;
}

bool slide(const hexmesh::Parting& parting, std::uint16_t one, std::uint16_t other) {
  return std::any_of(parting.sliding.begin(), parting.sliding.end(),
                     [&](const auto& pair) { return pair == std::pair(one, other) || pair == std::pair(other, one); });
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
  if (!slide(lattice.parting, label, beside) && (touch || !lattice.parting.any()))
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
