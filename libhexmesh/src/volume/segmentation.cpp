// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/volume/segmentation.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <map>
#include <set>

#include "hexmesh/core/error.h"
#include "reorient.h"

namespace hexmesh {
namespace {

std::vector<std::string> describe(const std::vector<LayeredSegment>& segments) {
  std::vector<std::string> out;
  for (const LayeredSegment& s : segments) out.push_back(fmt::format("{}={}", s.segment.label, s.segment.name));
  return out;
}

/// "SCT:10200004" is one of the SCHEME^CODE^MEANING triplets of a terminology entry.
bool has_code(const Segment& segment, const std::string& what) {
  const std::size_t colon = what.find(':');
  if (colon == std::string::npos) return false;
  const std::string triplet = fmt::format("~{}^{}^", what.substr(0, colon), what.substr(colon + 1));
  return segment.terminology.find(triplet) != std::string::npos;
}

bool is_called(const Segment& segment, const std::string& what) {
  int label = 0;
  const auto [end, failed] = std::from_chars(what.data(), what.data() + what.size(), label);
  const bool number = failed == std::errc() && end == what.data() + what.size();
  return (number && segment.label == label) || find_segment({segment}, what) || has_code(segment, what);
}

/// The labels of the segments that `what` stands for.
std::set<std::uint16_t> resolve(const std::vector<LayeredSegment>& segments, const std::string& what) {
  std::set<std::uint16_t> labels;
  for (const LayeredSegment& s : segments)
    if (is_called(s.segment, what)) labels.insert(s.segment.label);
  if (labels.empty())
    throw Error(ErrorKind::input,
                fmt::format("unknown segment '{}', expected one of: {}", what, fmt::join(describe(segments), ", ")));
  return labels;
}

/// Offset of the voxel of `from` at the centre of each voxel of `to`, or -1, a row of `to` at a time.
class NearestVoxels {
public:
  NearestVoxels(const Grid& from, const Grid& to) : from_(from), to_(to) {}

  /// @param row  receives extent()[0] offsets
  void row(std::int32_t j, std::int32_t k, std::vector<std::ptrdiff_t>& row) const {
    const Vec3 start = from_.continuous_index(to_.position(Vec3(0, j, k)));
    const Vec3 step = from_.continuous_index(to_.position(Vec3(1, j, k))) - start;
    row.resize(as_size(to_.extent()[0]));
    for (std::size_t i = 0; i < row.size(); ++i) {
      const Vec3 at = (start + static_cast<double>(i) * step).array().round();
      const bool inside = (at.array() >= 0).all() && at[0] < from_.extent()[0] && at[1] < from_.extent()[1] &&
                          at[2] < from_.extent()[2];
      row[i] = !inside ? -1
                       : static_cast<std::ptrdiff_t>(
                             from_.offset({static_cast<std::int32_t>(at[0]), static_cast<std::int32_t>(at[1]),
                                           static_cast<std::int32_t>(at[2])}));
    }
  }

private:
  const Grid& from_;
  const Grid& to_;
};

}  // namespace

Segmentation to_segmentation(LabelVolume volume) {
  Segmentation out{std::move(volume.grid), {}, {}};
  out.layers.push_back(std::move(volume.labels));
  for (Segment& s : volume.segments) out.segments.push_back({s, 0, s.label});
  return out;
}

std::uint16_t free_label(const Segmentation& segmentation, std::uint16_t wanted) {
  std::vector<bool> used(65536);
  used[0] = true;
  for (const LayeredSegment& s : segmentation.segments) used[s.segment.label] = true;
  if (!used[wanted]) return wanted;
  const auto first = std::find(used.begin(), used.end(), false);
  if (first == used.end()) throw Error(ErrorKind::input, "more than 65535 segments, expected fewer");
  return static_cast<std::uint16_t>(first - used.begin());
}

void add_segment(Segmentation& to, Segment segment, const std::vector<std::size_t>& voxels) {
  const auto is_free = [&](const std::vector<std::uint16_t>& layer) {
    return std::all_of(voxels.begin(), voxels.end(), [&](std::size_t n) { return layer[n] == 0; });
  };
  auto layer = std::find_if(to.layers.begin(), to.layers.end(), is_free);
  if (layer == to.layers.end()) layer = to.layers.emplace(layer, to.grid.num_voxels());
  for (const std::size_t n : voxels) (*layer)[n] = segment.label;
  const auto number = static_cast<std::size_t>(layer - to.layers.begin());
  const std::uint16_t value = segment.label;
  to.segments.push_back({std::move(segment), number, value});
}

std::vector<std::size_t> count_voxels(const Segmentation& segmentation) {
  std::vector<std::vector<std::size_t>> by_value;
  for (const auto& layer : segmentation.layers) {
    by_value.emplace_back(65536);
    for (const std::uint16_t value : layer) ++by_value.back()[value];
  }
  std::vector<std::size_t> counts;
  for (const LayeredSegment& s : segmentation.segments) counts.push_back(by_value[s.layer][s.value]);
  return counts;
}

Segmentation select_segments(Segmentation segmentation, const std::vector<SegmentChoice>& choices) {
  if (choices.empty()) return segmentation;
  std::map<std::uint16_t, std::string> chosen;  // new names by label
  for (const SegmentChoice& choice : choices)
    for (const std::uint16_t label : resolve(segmentation.segments, choice.what))
      if (!chosen.emplace(label, choice.name).second)
        throw Error(ErrorKind::usage, fmt::format("segment '{}' is chosen twice, expected each once", choice.what));
  std::set<std::string> names;
  for (const SegmentChoice& choice : choices)
    if (!choice.name.empty() && !names.insert(choice.name).second)
      throw Error(ErrorKind::usage,
                  fmt::format("the name '{}' is given to two segments, expected each once", choice.name));
  std::vector<LayeredSegment> kept;
  for (LayeredSegment& s : segmentation.segments) {
    const auto choice = chosen.find(s.segment.label);
    if (choice == chosen.end()) continue;
    if (!choice->second.empty()) s.segment.name = choice->second;
    kept.push_back(std::move(s));
  }
  segmentation.segments = std::move(kept);
  return segmentation;
}

Segmentation combine(Segmentation base, Segmentation more) {
  const std::size_t first_layer = base.layers.size();
  const auto known = static_cast<std::ptrdiff_t>(base.segments.size());
  std::map<std::uint16_t, Segment> renamed;  // by label in `more`
  for (LayeredSegment& s : more.segments) {
    if (!renamed.contains(s.segment.label)) {
      Segment segment = s.segment;
      const auto same = std::find_if(
          base.segments.begin(), base.segments.begin() + known,
          [&](const LayeredSegment& other) { return find_segment({other.segment}, segment.name) != nullptr; });
      if (same != base.segments.begin() + known)
        segment = same->segment;
      else
        segment.label = free_label(base, segment.label);
      renamed.emplace(s.segment.label, segment);
    }
    base.segments.push_back({renamed.at(s.segment.label), first_layer + s.layer, s.value});
  }
  for (auto& layer : more.layers) base.layers.push_back(std::move(layer));
  return base;
}

Segmentation join(std::vector<Segmentation> parts, const std::vector<Grid>& also,
                  const std::function<void(const std::string&)>& warn) {
  Grid grid = parts.front().grid;
  for (const Grid& other : also) grid = extend_over(grid, other);
  for (const Segmentation& part : parts) {
    if (!same_lattice_of_voxels(grid, part.grid))
      warn(fmt::format(
          "voxels of {:.4g} x {:.4g} x {:.4g} mm do not coincide with the first input's of {:.4g} x {:.4g} x "
          "{:.4g} mm: labels are taken from the nearest voxel",
          part.grid.spacing()[0], part.grid.spacing()[1], part.grid.spacing()[2], grid.spacing()[0], grid.spacing()[1],
          grid.spacing()[2]));
    grid = extend_over(grid, part.grid);
  }
  Segmentation out{grid, {}, {}};
  for (Segmentation& part : parts) {
    for (const LayeredSegment& s : part.segments)
      if (std::any_of(out.segments.begin(), out.segments.end(), [&](const LayeredSegment& known) {
            return find_segment({known.segment}, s.segment.name) != nullptr;
          }))
        warn(fmt::format("'{}' is in several inputs: its voxels are taken together", s.segment.name));
    if (!same_grid(part.grid, grid)) part = place_on(part, grid);
    out = combine(std::move(out), std::move(part));
  }
  return out;
}

LabelVolume flatten(Segmentation segmentation, const std::vector<std::string>& priority,
                    std::vector<Overlap>& overlaps) {
  // Painted in order: those without priority as they come, then those with it, the first of them last.
  std::map<std::uint16_t, std::size_t> rank;
  for (std::size_t n = 0; n < priority.size(); ++n)
    for (const std::uint16_t label : resolve(segmentation.segments, priority[n]))
      rank.emplace(label, priority.size() - n);
  std::vector<LayeredSegment> order = segmentation.segments;
  std::stable_sort(order.begin(), order.end(), [&](const LayeredSegment& a, const LayeredSegment& b) {
    const auto of = [&](const LayeredSegment& s) {
      return rank.contains(s.segment.label) ? rank.at(s.segment.label) : 0;
    };
    return of(a) < of(b);
  });

  LabelVolume out{segmentation.grid, std::vector<std::uint16_t>(segmentation.grid.num_voxels()), {}};
  std::map<std::pair<std::uint16_t, std::uint16_t>, std::size_t> shared;  // (winner, loser)
  std::vector<std::uint16_t> label_of(65536);                             // by value in the layer at hand
  for (std::size_t n = 0; n < order.size();) {
    // Neighbours in the order that share a layer are painted together.
    const std::size_t layer = order[n].layer;
    std::fill(label_of.begin(), label_of.end(), std::uint16_t{0});
    for (; n < order.size() && order[n].layer == layer; ++n) label_of[order[n].value] = order[n].segment.label;
    const auto& values = segmentation.layers[layer];
    for (std::size_t v = 0; v < values.size(); ++v) {
      const std::uint16_t label = label_of[values[v]];
      if (label == 0) continue;
      if (out.labels[v] != 0 && out.labels[v] != label) ++shared[{label, out.labels[v]}];
      out.labels[v] = label;
    }
  }
  std::map<std::uint16_t, Segment> by_label;
  for (LayeredSegment& s : segmentation.segments) by_label.emplace(s.segment.label, std::move(s.segment));
  for (const auto& [pair, voxels] : shared)
    overlaps.push_back({by_label.at(pair.first).name, by_label.at(pair.second).name, voxels});
  for (auto& [label, segment] : by_label) out.segments.push_back(std::move(segment));
  return out;
}

bool same_lattice_of_voxels(const Grid& base, const Grid& other) {
  for (int n = 0; n < 8; ++n) {
    const Vec3 at = base.continuous_index(other.position(other.corner(n)));
    if ((at.array() - at.array().round()).abs().maxCoeff() > 0.01) return false;
  }
  return (base.spacing() - other.spacing()).cwiseAbs().maxCoeff() < 0.01 * base.spacing().minCoeff() &&
         (base.direction() - other.direction()).norm() < 1e-3;
}

Grid extend_over(const Grid& base, const Grid& other) {
  Vec3 low = Vec3::Zero(), high = base.corner(7);
  for (int n = 0; n < 8; ++n) {
    const Vec3 at = base.continuous_index(other.position(other.corner(n)));
    low = low.cwiseMin((at.array() + 0.01).floor().matrix());
    high = high.cwiseMax((at.array() - 0.01).ceil().matrix());
  }
  const Vec3 extent = high - low + Vec3::Ones();
  if (!(extent.maxCoeff() < 65536 && extent.prod() < 4294967296.0))
    throw Error(ErrorKind::input, fmt::format("the inputs lie so far apart that a common grid needs {:g} x {:g} x {:g} "
                                              "voxels, expected at most 2^32",
                                              extent[0], extent[1], extent[2]));
  return Grid({static_cast<std::int32_t>(extent[0]), static_cast<std::int32_t>(extent[1]),
               static_cast<std::int32_t>(extent[2])},
              base.spacing(), base.position(low), base.direction());
}

Segmentation place_on(const Segmentation& segmentation, const Grid& grid) {
  Segmentation out{grid, {}, segmentation.segments};
  for (std::size_t n = 0; n < segmentation.layers.size(); ++n) out.layers.emplace_back(grid.num_voxels());
  const NearestVoxels nearest(segmentation.grid, grid);
  std::vector<std::ptrdiff_t> from;
  std::size_t to = 0;
  for (std::int32_t k = 0; k < grid.extent()[2]; ++k)
    for (std::int32_t j = 0; j < grid.extent()[1]; ++j) {
      nearest.row(j, k, from);
      for (std::size_t layer = 0; layer < out.layers.size(); ++layer)
        for (std::size_t i = 0; i < from.size(); ++i)
          if (from[i] >= 0) out.layers[layer][to + i] = segmentation.layers[layer][from[i]];
      to += from.size();
    }
  return out;
}

IntensityVolume place_on(const IntensityVolume& volume, const Grid& grid) {
  if (same_grid(volume.grid, grid)) return {grid, volume.values};
  const float lowest = volume.values.empty() ? 0 : *std::min_element(volume.values.begin(), volume.values.end());
  IntensityVolume out{grid, std::vector<float>(grid.num_voxels(), lowest)};
  const Index3& extent = grid.extent();
  for (std::int32_t k = 0; k < extent[2]; ++k)
    for (std::int32_t j = 0; j < extent[1]; ++j)
      for (std::int32_t i = 0; i < extent[0]; ++i) {
        const double value = value_at(volume, grid.center({i, j, k}));
        if (!std::isnan(value)) out.values[grid.offset({i, j, k})] = static_cast<float>(value);
      }
  return out;
}

Segmentation reorient_to_lps(Segmentation segmentation) {
  const Reorientation turn(segmentation.grid);
  for (auto& layer : segmentation.layers) layer = turn.apply(std::move(layer));
  segmentation.grid = turn.grid();
  return segmentation;
}

std::array<double, 3> distinct_color(std::size_t n) {
  const double hue = std::fmod(0.02 + 0.618034 * static_cast<double>(n), 1.0) * 6;
  const auto channel = [&](double shift) {
    constexpr double least = 0.42, most = 0.82;  // far from saturated
    return least + (most - least) * std::clamp(std::abs(std::fmod(hue + shift, 6) - 3) - 1, 0.0, 1.0);
  };
  return {channel(0), channel(4), channel(2)};
}

}  // namespace hexmesh
