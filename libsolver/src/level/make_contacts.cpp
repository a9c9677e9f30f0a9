// SPDX-License-Identifier: Apache-2.0
#include "level/make_contacts.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <optional>

#include "hexmesh/core/error.h"
#include "scene/solid_segments.h"

namespace hexsolver {
namespace {

using hexmesh::Error;
using hexmesh::ErrorKind;
using hexmesh::Lattice;

const hexmesh::LatticeSegment& solid_segment(const Contact& contact, const Lattice& lattice, const std::string& name) {
  if (const hexmesh::LatticeSegment* segment = find_solid_segment(lattice, name)) return *segment;
  throw Error(ErrorKind::input, fmt::format("contact '{}' ({}) is {} '{}', expected {} of: {}", contact.name,
                                            contact.where, contact.self ? "of" : "between", name,
                                            contact.self ? "one" : "two", names_of_solid_segments(lattice)));
}

using Labels = std::vector<bool>;  ///< of each label, whether it is meant

Labels labels_of(std::initializer_list<std::uint16_t> labels) {
  Labels out(65536);
  for (const std::uint16_t label : labels) out[label] = true;
  return out;
}

Labels solid_labels(const Lattice& lattice) {
  Labels out(65536);
  for (const hexmesh::LatticeSegment& s : lattice.segments) out[s.segment.label] = s.material.has_value();
  return out;
}

/// What one surface meets the rest shape of another with.
struct Pair {
  Labels first, second;
  double young;  ///< of the second, where it is softest [MPa]
  std::vector<hexmesh::ExposedFace> faces;
};

/// Beside the faces of the first there is the second, or nothing with a material.
Pair pair_of_segments(const Contact& contact, const Lattice& lattice) {
  const auto& [first, second] = *contact.between;
  const hexmesh::LatticeSegment &one = solid_segment(contact, lattice, first),
                                &other = solid_segment(contact, lattice, second);
  const std::uint16_t label = one.segment.label, beside = other.segment.label;
  Pair pair{labels_of({label}), labels_of({beside}), other.material->young, {}};
  Labels towards(65536, true);
  for (const hexmesh::LatticeSegment& s : lattice.segments)
    towards[s.segment.label] = !s.material || s.segment.label == beside;
  pair.faces = faces_between(lattice, pair.first, towards);
  const bool touch =
      std::any_of(pair.faces.begin(), pair.faces.end(), [&](const auto& face) { return face.neighbour == beside; });
  if (!lattice.parting.slide(label, beside) && (touch || !lattice.parting.any()))
    throw Error(ErrorKind::input,
                fmt::format("contact '{}' ({}) is between '{}' and '{}', which the cells of the lattice "
                            "hold together, expected one of hexmesh build --slide {} {}",
                            contact.name, contact.where, first, second, first, second));
  return pair;
}

/// Those that touch it, and what touches these, but for what slides along one of them.
Labels held_together_with(const Lattice& lattice, std::uint16_t label) {
  const Labels solid = solid_labels(lattice);
  Labels out = labels_of({label});
  const auto slides = [&](std::uint16_t other) {
    return std::any_of(lattice.segments.begin(), lattice.segments.end(), [&](const hexmesh::LatticeSegment& s) {
      return out[s.segment.label] && lattice.parting.slide(other, s.segment.label);
    });
  };
  std::vector<std::uint16_t> ahead{label};
  while (!ahead.empty()) {
    const std::uint16_t one = ahead.back();
    ahead.pop_back();
    for (const hexmesh::ExposedFace& face : faces_between(lattice, labels_of({one}), solid))
      if (!out[face.neighbour] && !slides(face.neighbour)) {
        out[face.neighbour] = true;
        ahead.push_back(face.neighbour);
      }
  }
  return out;
}

/// Beside the faces there is what the body does not hold.
Pair body_with_itself(const Contact& contact, const Lattice& lattice) {
  const bool is_whole = contact.self->empty();
  if (is_whole && !lattice.parting.sliding.empty())
    throw Error(
        ErrorKind::input,
        fmt::format("contact '{}' ({}) is of the whole body with itself, whose segments slide along each other, "
                    "expected self = \"NAME\" with one of: {}",
                    contact.name, contact.where, names_of_solid_segments(lattice)));
  const Labels body = is_whole
                          ? solid_labels(lattice)
                          : held_together_with(lattice, solid_segment(contact, lattice, *contact.self).segment.label);
  double young = std::numeric_limits<double>::infinity();
  for (const hexmesh::LatticeSegment& s : lattice.segments)
    if (body[s.segment.label]) young = std::min(young, s.material->young);
  Labels towards = body;
  towards.flip();
  return {body, body, young, faces_between(lattice, body, towards)};
}

constexpr std::uint16_t second = 1, first_alone = 2;  // roles of labels

/// How far a point of a staircase of voxels is outside the smooth surface of its body; 0 where that is less than six
/// voxels thick, of which means over neighbours take off the edges [mm].
double outside_own(const hexmesh::SegmentDistance& own, const Vec3& point, double voxel) {
  const hexmesh::Gap gap = own.gap(point);
  const Vec3 inside = point - 3 * voxel * gap.normal.normalized();
  return own.gap(inside).depth < gap.depth - 2 * voxel ? gap.depth : 0;
}

std::vector<std::uint16_t> roles(const Lattice& lattice, const Pair& pair) {
  std::vector<std::uint16_t> out(lattice.labels.size());
  for (std::size_t n = 0; n < out.size(); ++n)
    out[n] = pair.second[lattice.labels[n]] ? second : pair.first[lattice.labels[n]] ? first_alone : 0;
  return out;
}

SegmentShape make_shape(const Contact& contact, const Lattice& lattice) {
  const Pair pair = contact.self ? body_with_itself(contact, lattice) : pair_of_segments(contact, lattice);
  const std::vector<std::uint16_t> labels = roles(lattice, pair);
  const auto distance = std::make_shared<const hexmesh::SegmentDistance>(lattice.voxels, labels, second, first_alone);
  const double voxel = lattice.voxels.spacing().minCoeff();
  if (distance->thickness() < 1.25 * voxel)
    throw Error(ErrorKind::input,
                fmt::format("contact '{}' ({}) is with what is nowhere three voxels of {:g} mm thick, whose surface is "
                            "told by means over neighbours, expected finer voxels",
                            contact.name, contact.where, voxel));
  std::optional<hexmesh::SegmentDistance> own;
  if (!contact.self) own.emplace(lattice.voxels, labels, first_alone, second);
  SegmentShape out{pair.second, pair.young, pair.faces, {}, {}, distance};
  for (const hexmesh::ExposedFace& face : pair.faces) {
    const bool touches = !contact.self && pair.second[face.neighbour];
    const Vec3 at = lattice.voxels.position(hexmesh::face_index(face));
    out.touching.push_back(touches);
    out.outside.push_back(touches ? 0 : outside_own(own ? *own : *distance, at, lattice.voxels.spacing().maxCoeff()));
  }
  return out;
}

}  // namespace

std::vector<Vec3> places_of_touch(const Contact& contact, const Lattice& lattice) {
  std::vector<Vec3> out;
  if (contact.self) return out;
  const Pair pair = pair_of_segments(contact, lattice);
  for (const hexmesh::ExposedFace& face : pair.faces)
    if (pair.second[face.neighbour]) out.push_back(lattice.voxels.position(hexmesh::face_index(face)));
  return out;
}

const SegmentShape& SegmentShapes::of(const Contact& contact, std::size_t number, const Lattice& lattice) {
  if (number >= shapes_.size()) shapes_.resize(number + 1);
  if (!shapes_[number]) shapes_[number] = std::make_unique<const SegmentShape>(make_shape(contact, lattice));
  return *shapes_[number];
}

std::unique_ptr<PenaltyContact> make_segment_contact(const Contact& contact, const SegmentShape& shape,
                                                     const MeshCells& cells, const Mesh& mesh, Selector& selector,
                                                     bool is_hard) {
  const Lattice& lattice = cells.lattice();
  const bool is_self = contact.self.has_value();
  const double at_once = std::min(shape.distance->thickness() / 4, 2 * lattice.voxels.spacing().minCoeff());
  auto segment = std::make_unique<OtherSegment>(OtherSegment{shape.distance,
                                                             BodyMap(cells, mesh, shape.second),
                                                             shape.young,
                                                             shape.touching,
                                                             shape.outside,
                                                             at_once,
                                                             is_self,
                                                             {}});
  if (!is_self) {
    Labels others = shape.second;
    others.flip();
    segment->surface = selector.centers_of(faces_between(lattice, shape.second, others));
  }
  return std::make_unique<PenaltyContact>(contact, cells, mesh, selector.centers_of(shape.faces), is_hard,
                                          std::move(segment));
}

std::vector<std::unique_ptr<PenaltyContact>> make_contacts(const Scene& scene, const MeshCells& cells, const Mesh& mesh,
                                                           Selector& selector, SegmentShapes& shapes) {
  const bool has_obstacles =
      std::any_of(scene.contacts.begin(), scene.contacts.end(), [](const Contact& c) { return !c.is_within_body(); });
  const std::vector<SurfacePoint> surface = has_obstacles ? selector.whole_surface() : std::vector<SurfacePoint>();
  std::vector<std::unique_ptr<PenaltyContact>> out;
  for (std::size_t n = 0; n < scene.contacts.size(); ++n) {
    const Contact& c = scene.contacts[n];
    const bool hard = is_hard(c, scene);
    out.push_back(c.is_within_body()
                      ? make_segment_contact(c, shapes.of(c, n, cells.lattice()), cells, mesh, selector, hard)
                      : std::make_unique<PenaltyContact>(c, cells, mesh, surface, hard));
    if (scene.dynamics) out.back()->hold_pairs();
  }
  return out;
}

}  // namespace hexsolver
