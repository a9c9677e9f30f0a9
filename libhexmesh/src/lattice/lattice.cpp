// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/lattice/lattice.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <unordered_map>

#include "hexmesh/core/error.h"

namespace hexmesh {
namespace {

struct HashChildren {
  std::size_t operator()(const Children& pattern) const noexcept {
    std::uint64_t h = 1469598103934665603ULL;
    for (const std::int32_t id : pattern) h = (h ^ static_cast<std::uint32_t>(id)) * 1099511628211ULL;
    return h ^ (h >> 29);
  }
};

/// Where each label's segment is in the lattice's list, -1 for labels without material.
std::vector<std::int32_t> material_index(const std::vector<LatticeSegment>& segments) {
  std::vector<std::int32_t> index(65536, -1);
  for (std::size_t s = 0; s < segments.size(); ++s)
    if (segments[s].material) index[segments[s].segment.label] = static_cast<std::int32_t>(s);
  return index;
}

/// The part of the volume that holds segments, padded below by `offset`.
std::pair<Grid, std::vector<std::uint16_t>> crop(const LabelVolume& volume, const std::vector<LatticeSegment>& segments,
                                                 const Index3& offset) {
  std::vector<bool> wanted(65536);
  for (const LatticeSegment& s : segments) wanted[s.segment.label] = true;
  const Index3& n = volume.grid.extent();
  Index3 low = n, high = {-1, -1, -1}, v;
  std::size_t position = 0;
  for (v[2] = 0; v[2] < n[2]; ++v[2])
    for (v[1] = 0; v[1] < n[1]; ++v[1])
      for (v[0] = 0; v[0] < n[0]; ++v[0])
        if (wanted[volume.labels[position++]])
          for (int d = 0; d < 3; ++d) {
            low[d] = std::min(low[d], v[d]);
            high[d] = std::max(high[d], v[d]);
          }
  if (high[0] < 0) throw Error(ErrorKind::input, "the label volume has no labelled voxel, expected at least one");

  Index3 extent;
  for (int d = 0; d < 3; ++d) {
    low[d] -= offset[d];
    extent[d] = high[d] - low[d] + 1;
  }
  Grid box(extent, volume.grid.spacing(), volume.grid.position(Vec3(low[0], low[1], low[2])), volume.grid.direction());
  std::vector<std::uint16_t> labels(box.num_voxels());
  std::size_t to = 0;
  for (v[2] = 0; v[2] < extent[2]; ++v[2])
    for (v[1] = 0; v[1] < extent[1]; ++v[1])
      for (v[0] = 0; v[0] < extent[0]; ++v[0], ++to) {
        const Index3 from = {v[0] + low[0], v[1] + low[1], v[2] + low[2]};
        if (!volume.grid.contains(from)) continue;
        const std::uint16_t label = volume.labels[volume.grid.offset(from)];
        if (wanted[label]) labels[to] = label;
      }
  return {std::move(box), std::move(labels)};
}

Level finest_level(const Lattice& lattice) {
  Level level;
  std::vector<std::int32_t> element_of(lattice.segments.size(), -1);
  const std::vector<std::int32_t> segment_of = material_index(lattice.segments);
  for (std::size_t n = 0; n < lattice.labels.size(); ++n) {
    const std::int32_t s = segment_of[lattice.labels[n]];
    if (s < 0) continue;
    if (element_of[s] < 0) {
      element_of[s] = static_cast<std::int32_t>(level.elements.size());
      level.elements.push_back(full_voxel(*lattice.segments[s].material, lattice.voxels.voxel_volume()));
    }
    level.cells.push_back(lattice.voxels.index(n));
    level.element.push_back(element_of[s]);
    level.segment.push_back(lattice.labels[n]);
  }
  if (level.cells.empty()) throw Error(ErrorKind::input, "no voxel has a material, expected a segment with one");
  return level;
}

/// Voxels of each segment in each cell; shape (num_cells, num_segments).
using VoxelCounts = std::vector<std::uint32_t>;

/// @param fine_counts  of the finer level; empty where that is level 0, with one voxel per cell
VoxelCounts merge_counts(const Level& fine, const VoxelCounts& fine_counts, const std::vector<Children>& children,
                         const std::vector<std::int32_t>& segment_of, std::size_t num_segments) {
  VoxelCounts counts(children.size() * num_segments);
  for (std::size_t parent = 0; parent < children.size(); ++parent)
    for (const std::int32_t child : children[parent]) {
      if (child < 0) continue;
      std::uint32_t* row = &counts[parent * num_segments];
      const auto c = static_cast<std::size_t>(child);
      if (fine_counts.empty())
        ++row[segment_of[fine.segment[c]]];
      else
        for (std::size_t s = 0; s < num_segments; ++s) row[s] += fine_counts[c * num_segments + s];
    }
  return counts;
}

Level coarser_level(const Lattice& lattice, const Level& fine, VoxelCounts& counts) {
  const Vec3 size = lattice.voxels.spacing().cwiseProduct(
      Vec3(fine.voxels_per_cell[0], fine.voxels_per_cell[1], fine.voxels_per_cell[2]));
  Merge merge = merge_cells(fine.cells, merge_factor(size));
  Level level;
  level.merge = merge.factor;
  for (int d = 0; d < 3; ++d) level.voxels_per_cell[d] = fine.voxels_per_cell[d] * merge.factor[d];

  std::unordered_map<Children, std::int32_t, HashChildren> known;
  for (const Children& children : merge.children) {
    Children pattern;
    for (int slot = 0; slot < 8; ++slot) pattern[slot] = children[slot] < 0 ? -1 : fine.element[children[slot]];
    const auto [entry, is_new] = known.try_emplace(pattern, static_cast<std::int32_t>(level.elements.size()));
    if (is_new) {
      Element parent;
      for (int slot = 0; slot < 8; ++slot)
        if (pattern[slot] >= 0) add_child(parent, fine.elements[pattern[slot]], slot, merge.factor);
      level.elements.push_back(parent);
    }
    level.element.push_back(entry->second);
  }
  const std::size_t num_segments = lattice.segments.size();
  counts = merge_counts(fine, counts, merge.children, material_index(lattice.segments), num_segments);
  for (auto row = counts.begin(); row != counts.end(); row += static_cast<std::ptrdiff_t>(num_segments)) {
    const auto most = std::max_element(row, row + static_cast<std::ptrdiff_t>(num_segments));
    level.segment.push_back(lattice.segments[static_cast<std::size_t>(most - row)].segment.label);
  }
  level.cells = std::move(merge.parents);
  return level;
}

/// @param num_levels  0: merge until at most 16 cells are left
void make_levels(Lattice& lattice, int num_levels) {
  lattice.levels.assign(1, finest_level(lattice));
  VoxelCounts counts;
  while (num_levels > 0 ? static_cast<int>(lattice.levels.size()) < num_levels
                        : lattice.levels.back().cells.size() > 16)
    lattice.levels.push_back(coarser_level(lattice, lattice.levels.back(), counts));
}

}  // namespace

Vec3 Lattice::cell_size(int level) const {
  const Index3& n = levels.at(static_cast<std::size_t>(level)).voxels_per_cell;
  return voxels.spacing().cwiseProduct(Vec3(n[0], n[1], n[2]));
}

Mat3 Lattice::cell_edges(int level) const { return voxels.direction() * cell_size(level).asDiagonal(); }

std::vector<LatticeSegment> assign_materials(const LabelVolume& volume,
                                             const std::map<std::string, MaterialChoice>& choices,
                                             std::vector<std::string>& notes) {
  std::vector<std::string> names;
  for (const Segment& s : volume.segments) names.push_back(s.name);
  for (const auto& [name, choice] : choices)
    if (name != "*" && !find_segment(volume.segments, name))
      throw Error(ErrorKind::input,
                  fmt::format("material for unknown segment '{}', expected one of: {}", name, fmt::join(names, ", ")));
  const std::vector<std::size_t> counts = count_voxels(volume);
  std::vector<LatticeSegment> out;
  for (std::size_t n = 0; n < volume.segments.size(); ++n) {
    if (counts[n] == 0) continue;
    const Segment& segment = volume.segments[n];
    const auto all = choices.find("*");
    MaterialChoice choice = all == choices.end() ? MaterialChoice{} : all->second;
    for (const auto& [name, asked] : choices)
      if (find_segment({segment}, name)) choice = asked;
    LatticeSegment entry{segment, std::nullopt, counts[n]};
    if (!choice.none) {
      const Tissue* tissue = tissue_of(segment.name);
      if (!tissue && !(choice.young_kpa && choice.poisson))
        throw Error(ErrorKind::input,
                    fmt::format("segment '{0}' has no material and its name no known tissue, expected --material "
                                "{0}:young_kpa=...,poisson=... or {0}:none",
                                segment.name));
      Material material = tissue ? tissue->material : material_from_units(0, 0, 1000);
      if (choice.young_kpa) material.young = *choice.young_kpa * 1e-3;
      if (choice.poisson) material.poisson = *choice.poisson;
      if (choice.density_kg_m3) material.density = *choice.density_kg_m3 * 1e-12;
      check_material(material, segment.name);
      if (!choice.young_kpa || !choice.poisson)
        notes.push_back(fmt::format("segment '{}' takes the default of tissue '{}': {:g} kPa, nu {:g} ({})",
                                    segment.name, tissue->name, material.young * 1e3, material.poisson,
                                    tissue->source));
      entry.material = material;
    }
    out.push_back(std::move(entry));
  }
  return out;
}

Lattice build_lattice(const LabelVolume& volume, std::vector<LatticeSegment> segments, const LatticeOptions& options) {
  auto [box, labels] = crop(volume, segments, options.offset);
  for (int d = 0; d < 3; ++d)
    if (box.extent()[d] >= 65536)
      throw Error(ErrorKind::input,
                  fmt::format("the body spans {} voxels along axis {}, expected fewer than 65536", box.extent()[d], d));
  Lattice lattice{std::move(box), std::move(labels), std::move(segments), {}, {}, {}};
  make_levels(lattice, options.num_levels);
  return lattice;
}

Lattice rebuild_levels(Lattice lattice) {
  make_levels(lattice, static_cast<int>(lattice.levels.size()));
  return lattice;
}

std::vector<ExposedFace> exposed_faces(const Lattice& lattice) {
  const std::vector<std::int32_t> segment_of = material_index(lattice.segments);
  const Grid& grid = lattice.voxels;
  std::vector<ExposedFace> faces;
  for (std::size_t n = 0; n < lattice.labels.size(); ++n) {
    if (segment_of[lattice.labels[n]] < 0) continue;
    const Index3 voxel = grid.index(n);
    for (int side = 0; side < 6; ++side) {
      Index3 beside = voxel;
      beside[side / 2] += side % 2 ? 1 : -1;
      const std::uint16_t label = grid.contains(beside) ? lattice.labels[grid.offset(beside)] : std::uint16_t{0};
      if (segment_of[label] < 0) faces.push_back({voxel, static_cast<std::uint8_t>(side), label});
    }
  }
  return faces;
}

Vec3 face_index(const ExposedFace& face) {
  Vec3 index(face.voxel[0], face.voxel[1], face.voxel[2]);
  index[face.side / 2] += face.side % 2 ? 0.5 : -0.5;
  return index;
}

}  // namespace hexmesh
