// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/scan/label_volume.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/LU>
#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "hexmesh/core/error.h"
#include "hexmesh/lattice/shape.h"

namespace hexmesh {
namespace {

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::tolower(c); });
  return text;
}

/// Axis d of the reoriented grid is axis `from[d]` of the stored one, reversed where `flip[d]`.
struct SignedPermutation {
  std::array<int, 3> from;
  std::array<bool, 3> flip;
};

/// Of the 24 right-handed signed permutations of the stored axes, the one nearest to the LPS axes.
SignedPermutation nearest_lps(const Mat3& direction) {
  SignedPermutation best{};
  double best_trace = -4;
  std::array<int, 3> order = {0, 1, 2};
  do {
    for (int signs = 0; signs < 8; ++signs) {
      Mat3 turned;
      for (int d = 0; d < 3; ++d) turned.col(d) = (signs >> d & 1 ? -1.0 : 1.0) * direction.col(order[d]);
      // The tiny bonus makes ties (exactly 45 degrees) independent of the stored order.
      const double trace = turned.trace() + 1e-9 * (turned(0, 1) + 2 * turned(1, 2));
      if (turned.determinant() > 0 && trace > best_trace) {
        best_trace = trace;
        best = {order, {(signs & 1) != 0, (signs & 2) != 0, (signs & 4) != 0}};
      }
    }
  } while (std::next_permutation(order.begin(), order.end()));
  return best;
}

template <class Value>
std::pair<Grid, std::vector<Value>> reorient(const Grid& grid, std::vector<Value> values) {
  const SignedPermutation turn = nearest_lps(grid.direction());
  if (turn.from == std::array<int, 3>{0, 1, 2} && turn.flip == std::array<bool, 3>{}) return {grid, std::move(values)};

  Index3 extent;
  Vec3 spacing, first = Vec3::Zero();
  Mat3 direction;
  for (int d = 0; d < 3; ++d) {
    const int s = turn.from[d];
    extent[d] = grid.extent()[s];
    spacing[d] = grid.spacing()[s];
    direction.col(d) = (turn.flip[d] ? -1.0 : 1.0) * grid.direction().col(s);
    if (turn.flip[d]) first[s] = grid.extent()[s] - 1;
  }
  Grid turned(extent, spacing, grid.position(first), direction);
  std::vector<Value> out(values.size());
  std::size_t n = 0;
  Index3 to;
  for (to[2] = 0; to[2] < extent[2]; ++to[2])
    for (to[1] = 0; to[1] < extent[1]; ++to[1])
      for (to[0] = 0; to[0] < extent[0]; ++to[0]) {
        Index3 stored;
        for (int d = 0; d < 3; ++d) stored[turn.from[d]] = turn.flip[d] ? extent[d] - 1 - to[d] : to[d];
        out[n++] = values[grid.offset(stored)];
      }
  return {std::move(turned), std::move(out)};
}

std::vector<std::string> describe(const std::vector<Segment>& segments) {
  std::vector<std::string> out;
  for (const Segment& s : segments) out.push_back(fmt::format("{}={}", s.label, s.name));
  return out;
}

const Segment& resolve(const std::vector<Segment>& segments, const std::string& what) {
  int label = 0;
  const auto [end, failed] = std::from_chars(what.data(), what.data() + what.size(), label);
  const bool number = failed == std::errc() && end == what.data() + what.size();
  for (const Segment& s : segments)
    if (number && s.label == label) return s;
  if (const Segment* named = find_segment(segments, what)) return *named;
  throw Error(ErrorKind::input,
              fmt::format("unknown segment '{}', expected one of: {}", what, fmt::join(describe(segments), ", ")));
}

}  // namespace

double value_at(const IntensityVolume& volume, const Vec3& position) {
  constexpr double at_center = 1e-3;
  const Grid& grid = volume.grid;
  const Vec3 index = grid.continuous_index(position);
  Index3 base;
  Vec3 s;
  for (std::size_t d = 0; d < 3; ++d) {
    const double i = index[static_cast<Eigen::Index>(d)];
    if (!(i >= -0.5 && i <= grid.extent()[d] - 0.5)) return std::numeric_limits<double>::quiet_NaN();
    const double nearest = std::round(i);
    const double clamped = std::clamp(std::abs(i - nearest) < at_center ? nearest : i, 0.0, grid.extent()[d] - 1.0);
    base[d] = std::min(static_cast<std::int32_t>(clamped), std::max(grid.extent()[d] - 2, 0));
    s[static_cast<Eigen::Index>(d)] = clamped - base[d];
  }
  const NodeWeights weights = shape_functions(s);
  double value = 0;
  for (int a = 0; a < num_cell_nodes; ++a) {
    if (weights[a] == 0) continue;
    Index3 v = base;
    for (std::size_t d = 0; d < 3; ++d)
      v[d] = std::min(v[d] + corner_bit(a, static_cast<int>(d)), grid.extent()[d] - 1);
    value += weights[a] * static_cast<double>(volume.values[grid.offset(v)]);
  }
  return value;
}

std::vector<std::size_t> count_voxels(const LabelVolume& volume) {
  std::vector<std::size_t> by_label(65536);
  for (const std::uint16_t label : volume.labels) ++by_label[label];
  std::vector<std::size_t> counts;
  for (const Segment& s : volume.segments) counts.push_back(by_label[s.label]);
  return counts;
}

const Segment* find_segment(const std::vector<Segment>& segments, const std::string& name) {
  for (const Segment& s : segments)
    if (lower(s.name) == lower(name)) return &s;
  return nullptr;
}

LabelVolume reorient_to_lps(LabelVolume volume) {
  auto [grid, labels] = reorient(volume.grid, std::move(volume.labels));
  return {std::move(grid), std::move(labels), std::move(volume.segments)};
}

IntensityVolume reorient_to_lps(IntensityVolume volume) {
  auto [grid, values] = reorient(volume.grid, std::move(volume.values));
  return {std::move(grid), std::move(values)};
}

LabelVolume select_segments(LabelVolume volume, const std::vector<SegmentChoice>& choices) {
  if (choices.empty()) return volume;
  std::vector<bool> keep(65536);
  std::vector<Segment> kept;
  for (const SegmentChoice& choice : choices) {
    Segment segment = resolve(volume.segments, choice.what);
    if (keep[segment.label])
      throw Error(ErrorKind::usage, fmt::format("segment '{}' is chosen twice, expected each once", choice.what));
    keep[segment.label] = true;
    if (!choice.name.empty()) segment.name = choice.name;
    kept.push_back(std::move(segment));
  }
  std::sort(kept.begin(), kept.end(), [](const Segment& a, const Segment& b) { return a.label < b.label; });
  volume.segments = std::move(kept);
  for (std::uint16_t& label : volume.labels)
    if (!keep[label]) label = 0;
  return volume;
}

LabelVolume overlay(LabelVolume base, const LabelVolume& top, std::size_t& overlap) {
  if (!same_grid(base.grid, top.grid))
    throw Error(ErrorKind::input, "the label volumes lie on different grids, expected the same extent and position");
  std::set<std::uint16_t> used;
  for (const Segment& s : base.segments) used.insert(s.label);
  std::map<std::uint16_t, std::uint16_t> renumbered;
  for (const Segment& s : top.segments) {
    if (const Segment* same = find_segment(base.segments, s.name)) {
      renumbered[s.label] = same->label;
      continue;
    }
    Segment added = s;
    while (added.label == 0 || used.contains(added.label)) ++added.label;
    used.insert(added.label);
    renumbered[s.label] = added.label;
    base.segments.push_back(added);
  }
  std::sort(base.segments.begin(), base.segments.end(),
            [](const Segment& a, const Segment& b) { return a.label < b.label; });
  overlap = 0;
  for (std::size_t n = 0; n < base.labels.size(); ++n) {
    if (top.labels[n] == 0) continue;
    const std::uint16_t label = renumbered.at(top.labels[n]);
    overlap += base.labels[n] != 0 && base.labels[n] != label;
    base.labels[n] = label;
  }
  return base;
}

}  // namespace hexmesh
