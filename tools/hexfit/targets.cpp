// SPDX-License-Identifier: Apache-2.0
#include "targets.h"

#include <fmt/format.h>

#include <algorithm>

#include "hexmesh/core/error.h"
#include "hexmesh/file/markup_file.h"
#include "hexmesh/surface/extract.h"
#include "hexmesh/surface/surface_file.h"
#include "hexmesh/volume/region.h"
#include "segments/segment_reader.h"

namespace hextools {

using hexmesh::Error;
using hexmesh::ErrorKind;
using hexsolver::Match;

Targets::Targets(FitOptions& o, RunFiles& files, const Console& console) : o_(o), console_(console) {
  const auto is_surface = [](const std::string& name) { return hexmesh::is_surface_name(name); };
  std::vector<std::string>& inputs = o.segments.inputs;
  for (const std::string& name : inputs)
    if (is_surface(name)) surfaces_.push_back(&files.input(name));
  inputs.erase(std::remove_if(inputs.begin(), inputs.end(), is_surface), inputs.end());
  if (o.segments.has_inputs()) segments_ = std::make_unique<SegmentReader>(o.segments, files, console);
  for (const std::string& name : o.landmarks) landmarks_.push_back(&files.input(name));
  const SegmentOptions& s = o.segments;
  const bool asks_segments = !s.segments.empty() || !s.priority.empty() || !s.label_names.empty() || !s.roi.empty() ||
                             !s.roi_markup.empty() || s.margin >= 0 || s.open > 0 || s.close > 0 || s.specks_ml > 0 ||
                             s.isotropic >= 0 || s.fill_cavities || s.largest_component;
  if (!segments_ && asks_segments)
    throw Error(ErrorKind::usage, "--segment and what else is of segmentations goes with one, but no target is one");
  if (surfaces_.empty() && !segments_ && landmarks_.empty())
    throw Error(ErrorKind::usage,
                "no target, expected a surface, a segmentation or --landmarks BEFORE NOW of what is seen now");
}

Targets::~Targets() = default;

std::vector<const Input*> Targets::files() const {
  std::vector<const Input*> out = surfaces_;
  if (segments_) {
    const std::vector<const Input*> of_segments = segments_->files();
    out.insert(out.end(), of_segments.begin(), of_segments.end());
  }
  out.insert(out.end(), landmarks_.begin(), landmarks_.end());
  return out;
}

std::string Targets::body_segment(const std::string& of_target,
                                  const std::vector<hexmesh::LatticeSegment>& segments) const {
  if (!o_.body_segment.empty()) return o_.body_segment;
  const bool is_there = std::any_of(segments.begin(), segments.end(), [&](const hexmesh::LatticeSegment& s) {
    return s.material && s.segment.name == of_target;
  });
  return is_there ? of_target : "";
}

std::vector<Match> Targets::read(const std::vector<hexmesh::LatticeSegment>& segments) const {
  std::vector<Match> out;
  const auto add = [&](const std::string& name, hexmesh::TriangleSurface target, const std::string& segment) {
    Match m;
    m.name = name;
    for (int n = 2; std::any_of(out.begin(), out.end(), [&](const Match& other) { return other.name == m.name; }); ++n)
      m.name = fmt::format("{} {}", name, n);
    m.where = "a target";
    m.target = std::move(target);
    m.segment = segment;
    if (o_.is_part) m.is_partial = true;
    m.outliers = o_.outliers;
    m.trust = o_.trust;
    out.push_back(std::move(m));
  };
  for (const Input* file : surfaces_) {
    hexmesh::TriangleSurface surface = hexmesh::read_surface(file->path());
    for (hexmesh::Vec3& p : surface.points) p *= o_.segments.scale;
    add(file->name(), std::move(surface), body_segment("", segments));
  }
  if (segments_) {
    // Cut as lattices are, so that the surface of the same voxels is the same to the last digit.
    const hexmesh::LabelVolume volume = hexmesh::crop_to_segments(segments_->read(), 0);
    if (!o_.body_segment.empty() && volume.segments.size() > 1)
      throw Error(ErrorKind::usage, fmt::format("--body is '{}' and the segmentation has {} segments, expected one of "
                                                "them by --segment",
                                                o_.body_segment, volume.segments.size()));
    for (const hexmesh::Segment& s : volume.segments) {
      const std::string of_body = body_segment(s.name, segments);
      if (of_body.empty() && volume.segments.size() > 1) {
        console_.warning(fmt::format("segment '{}' of the segmentation is none of the lattice's: left out", s.name));
        continue;
      }
      add(s.name, hexmesh::extract_surface(volume.grid, volume.labels, s.label), of_body);
    }
    if (out.empty())
      throw Error(ErrorKind::input, "no segment of the segmentation is one of the lattice's, expected --segment");
  }
  if (!landmarks_.empty()) {
    Match m;
    m.name = "landmarks";
    m.where = fmt::format("{}, {}", landmarks_[0]->name(), landmarks_[1]->name());
    m.from = hexmesh::read_markup(landmarks_[0]->path()).points;
    m.to = hexmesh::read_markup(landmarks_[1]->path()).points;
    m.trust = o_.trust;
    if (m.from.empty() || m.from.size() != m.to.size())
      throw Error(ErrorKind::input,
                  fmt::format("--landmarks: {} points in '{}' and {} in '{}', expected as many, and "
                              "one at least",
                              m.from.size(), landmarks_[0]->name(), m.to.size(), landmarks_[1]->name()));
    out.push_back(std::move(m));
  }
  return out;
}

}  // namespace hextools
