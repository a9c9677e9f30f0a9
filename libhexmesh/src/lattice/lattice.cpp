// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/lattice/lattice.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <bit>
#include <unordered_map>

#include "hexmesh/core/bytes.h"
#include "hexmesh/core/error.h"
#include "hexmesh/core/interruption.h"
#include "hexmesh/core/memory.h"
#include "hexmesh/lattice/gap_ends.h"
#include "parts.h"
#include "splitter.h"

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
  Grid box(extent, volume.grid.spacing(), volume.grid.center(low), volume.grid.direction());
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

/// The materials of one segment's voxels, each distinct one once.
class VoxelMaterials {
public:
  VoxelMaterials(Lattice& lattice, LatticeSegment& segment, const MaterialRule* rule, const IntensityVolume* intensity)
      : lattice_(lattice), segment_(segment), rule_(rule), intensity_(intensity) {}

  /// Number of the voxel's material in the lattice's list.
  std::int32_t of(const Index3& voxel) {
    const float grey = rule_ ? grey_value(voxel) : 0.0F;
    const auto [entry, is_new] =
        number_.try_emplace(std::bit_cast<std::uint32_t>(grey), static_cast<std::int32_t>(lattice_.materials.size()));
    if (is_new) lattice_.materials.push_back({segment_.segment.label, rule_ ? material_at(grey) : *segment_.material});
    if (rule_) {
      const Material& m = lattice_.materials[entry->second].material;
      sum_.young += m.young;
      sum_.poisson += m.poisson;
      sum_.density += m.density;
    }
    ++count_;
    return entry->second;
  }

  void finish() {
    const auto n = static_cast<double>(count_);
    if (rule_ && count_ > 0) segment_.material = Material{sum_.young / n, sum_.poisson / n, sum_.density / n};
    segment_.num_voxels = count_;
  }

private:
  float grey_value(const Index3& voxel) const {
    const Vec3 position = lattice_.voxels.center(voxel);
    const double value = value_at(*intensity_, position);
    if (!std::isfinite(value))
      throw Error(ErrorKind::input,
                  fmt::format("segment '{}' has a voxel at ({:.1f}, {:.1f}, {:.1f}) mm where the scan has no grey "
                              "value, expected a scan that covers it",
                              segment_.segment.name, position[0], position[1], position[2]));
    return static_cast<float>(value);
  }

  Material material_at(float grey) const {
    const Material m = rule_->at(grey);
    if (const std::string problem = material_problem(m); !problem.empty())
      throw Error(ErrorKind::input,
                  fmt::format("material of segment '{}' at grey value {}: {}", segment_.segment.name, grey, problem));
    return m;
  }

  Lattice& lattice_;
  LatticeSegment& segment_;
  const MaterialRule* rule_;
  const IntensityVolume* intensity_;
  std::unordered_map<std::uint32_t, std::int32_t> number_;  ///< by the bits of the grey value
  Material sum_;
  std::size_t count_ = 0;
};

/// Level 0, and the lattice's materials.
Level finest_level(Lattice& lattice, const GreyMaterials* grey) {
  const std::vector<std::int32_t> segment_of = material_index(lattice.segments);
  std::vector<VoxelMaterials> materials;
  for (LatticeSegment& s : lattice.segments) {
    const bool varies = grey && grey->rules.contains(s.segment.label);
    materials.emplace_back(lattice, s, varies ? &grey->rules.at(s.segment.label) : nullptr,
                           varies ? grey->intensity : nullptr);
  }
  Level level;
  const auto count = static_cast<std::size_t>(std::count_if(
      lattice.labels.begin(), lattice.labels.end(), [&](std::uint16_t label) { return segment_of[label] >= 0; }));
  constexpr std::size_t bytes_per_voxel = 43;  // at the peak, when levels are merged or written; measured
  expect_memory(bytes_per_voxel * count, fmt::format("a lattice of {} voxels", count));
  level.cells.reserve(count);
  level.element.reserve(count);
  level.segment.reserve(count);
  for (std::size_t n = 0; n < lattice.labels.size(); ++n) {
    const std::int32_t s = segment_of[lattice.labels[n]];
    if (s < 0) continue;
    const Index3 voxel = lattice.voxels.index(n);
    level.cells.push_back(voxel);
    level.element.push_back(materials[s].of(voxel));
    level.segment.push_back(lattice.labels[n]);
  }
  if (level.cells.empty()) throw Error(ErrorKind::input, "no voxel has a material, expected a segment with one");
  for (std::size_t s = 0; s < materials.size(); ++s)
    if (lattice.segments[s].material) materials[s].finish();
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
      if (fine_counts.empty())
        ++row[segment_of[fine.segment[child]]];
      else
        for (std::size_t s = 0; s < num_segments; ++s) row[s] += fine_counts[as_size(child) * num_segments + s];
    }
  return counts;
}

/// @param splitter  that has come to the finer level; none: what cells hold is merged by place
Level coarser_level(const Lattice& lattice, const Level& fine, VoxelCounts& counts, Splitter* splitter) {
  const Vec3 size = lattice.voxels.spacing().cwiseProduct(
      Vec3(fine.voxels_per_cell[0], fine.voxels_per_cell[1], fine.voxels_per_cell[2]));
  const Index3 factor = merge_factor(size);
  Merge merge = splitter ? splitter->merge(fine.cells, factor) : merge_cells(fine.cells, factor);
  Level level;
  level.merge = merge.factor;
  for (int d = 0; d < 3; ++d) level.voxels_per_cell[d] = fine.voxels_per_cell[d] * merge.factor[d];

  std::unordered_map<Children, std::int32_t, HashChildren> known;
  for (const Children& children : merge.children) {
    Children pattern;
    for (std::size_t slot = 0; slot < 8; ++slot) pattern[slot] = children[slot] < 0 ? -1 : fine.element[children[slot]];
    const auto [entry, is_new] = known.try_emplace(pattern, static_cast<std::int32_t>(level.children.size()));
    if (is_new) level.children.push_back(pattern);
    level.element.push_back(entry->second);
  }
  const std::size_t num_segments = lattice.segments.size();
  counts = merge_counts(fine, counts, merge.children, material_index(lattice.segments), num_segments);
  for (auto row = counts.begin(); row != counts.end(); row += static_cast<std::ptrdiff_t>(num_segments)) {
    const auto most = std::max_element(row, row + static_cast<std::ptrdiff_t>(num_segments));
    level.segment.push_back(lattice.segments[most - row].segment.label);
  }
  level.cells = std::move(merge.parents);
  if (splitter) level.split = splitter->split(level.cells);
  return level;
}

/// The faces of voxels with material beside which there is none.
std::vector<ExposedFace> find_faces(const Lattice& lattice) {
  const std::vector<std::int32_t> segment_of = material_index(lattice.segments);
  std::vector<bool> has_material(segment_of.size()), has_none;
  for (std::size_t label = 1; label < segment_of.size(); ++label) has_material[label] = segment_of[label] >= 0;
  has_none = has_material;
  has_none.flip();
  return faces_between(lattice, has_material, has_none);
}

/// All that follows from the voxels and level 0.
/// @param num_levels  0: merge until at most 16 cells are left
void add_levels(Lattice& lattice, int num_levels) {
  VoxelCounts counts;
  std::optional<Splitter> splitter;
  if (lattice.parting.any()) {
    splitter.emplace(lattice);
    lattice.levels.front().split = splitter->split(lattice.levels.front().cells);
  }
  const auto may_merge = [](const Level& level) {  // cells at one index, parted by gaps, stay apart
    return level.cells.size() > 16 && level.cells.front() != level.cells.back();
  };
  while (num_levels > 0 ? lattice.num_levels() < num_levels : may_merge(lattice.levels.back())) {
    interruption_point();
    lattice.levels.push_back(coarser_level(lattice, lattice.levels.back(), counts, splitter ? &*splitter : nullptr));
  }
  const auto is_split = [](const Level& level) { return !level.split.empty(); };
  if (lattice.parting.sliding.empty() && std::none_of(lattice.levels.begin(), lattice.levels.end(), is_split))
    lattice.parting.gaps = false;
  interruption_point();
  count_filled(lattice.levels, lattice.materials.size());
  count_mixture(lattice.levels, lattice.materials);
  measure_open_gaps(lattice);
  count_parts(lattice);
  lattice.faces = std::make_shared<const FacesInMemory>(find_faces(lattice));
}

}  // namespace

const LatticeSegment& segment_named(const std::vector<LatticeSegment>& segments, const std::string& name) {
  std::vector<std::string> names;
  for (const LatticeSegment& s : segments) {
    if (find_segment({s.segment}, name)) return s;
    names.push_back(s.segment.name);
  }
  throw Error(ErrorKind::input, fmt::format("unknown segment '{}', expected one of: {}", name, fmt::join(names, ", ")));
}

Vec3 Lattice::cell_size(int level) const {
  const Index3& n = levels.at(as_size(level)).voxels_per_cell;
  return voxels.spacing().cwiseProduct(Vec3(n[0], n[1], n[2]));
}

Mat3 Lattice::cell_edges(int level) const { return voxels.direction() * cell_size(level).asDiagonal(); }

Lattice build_lattice(const LabelVolume& volume, std::vector<LatticeSegment> segments, const LatticeOptions& options,
                      const GreyMaterials* grey) {
  for (const LatticeSegment& s : segments) {
    const bool follows_grey = grey && grey->rules.contains(s.segment.label);
    if (s.material && !follows_grey) check_material(*s.material, s.segment.name);
  }
  auto [box, labels] = crop(volume, segments, options.offset);
  for (int d = 0; d < 3; ++d)
    if (box.extent()[d] >= 65536)
      throw Error(ErrorKind::input,
                  fmt::format("the body spans {} voxels along axis {}, expected fewer than 65536", box.extent()[d], d));
  Lattice lattice{std::move(box), std::move(labels), std::move(segments), {}, {}, {}, {}};
  lattice.parting = options.parting;
  lattice.levels.push_back(finest_level(lattice, grey));
  add_levels(lattice, options.num_levels);
  return lattice;
}

Lattice build_levels(Lattice lattice) {
  const int num_levels = lattice.num_levels();
  const std::vector<std::int32_t> segment_of = material_index(lattice.segments);
  Level finest;
  finest.element = std::move(lattice.levels.front().element);
  for (std::size_t n = 0; n < lattice.labels.size(); ++n) {
    if (segment_of[lattice.labels[n]] < 0) continue;
    finest.cells.push_back(lattice.voxels.index(n));
    finest.segment.push_back(lattice.labels[n]);
  }
  finest.element.resize(finest.cells.size());
  lattice.levels.clear();
  lattice.levels.push_back(std::move(finest));
  add_levels(lattice, num_levels);
  return lattice;
}

Lattice without_cells(Lattice lattice, int level, const std::vector<std::int32_t>& cells) {
  std::vector<bool> is_gone(lattice.level(level).cells.size());
  for (const std::int32_t c : cells) is_gone[as_size(c)] = true;
  const std::vector<std::int32_t> cell_of = coarser_cells_of(lattice, 0, level);
  Level& finest = lattice.levels.front();
  std::vector<std::int32_t> kept;
  for (std::size_t v = 0; v < finest.cells.size(); ++v) {
    const Index3& voxel = finest.cells[v];
    if (is_gone[as_size(cell_of[v])])
      lattice.labels[lattice.voxels.offset(voxel)] = 0;
    else
      kept.push_back(finest.element[v]);
  }
  finest.element = std::move(kept);
  return build_levels(std::move(lattice));
}

void count_filled(std::vector<Level>& levels, std::size_t num_materials) {
  for (std::size_t l = 0; l < levels.size(); ++l) {
    Level& level = levels[l];
    level.filled.assign(l == 0 ? num_materials : level.children.size(), l == 0 ? 1 : 0);
    level.subcells.assign(level.filled.size(), all_subcells);
    for (std::size_t e = 0; e < level.children.size(); ++e) {
      for (const std::int32_t child : level.children[e])
        if (child >= 0) level.filled[e] += levels[l - 1].filled[child];
      level.subcells[e] = subcells_of(level.children[e], levels[l - 1].subcells, level.merge);
    }
  }
}

void count_mixture(std::vector<Level>& levels, const std::vector<VoxelMaterial>& materials) {
  struct Sums {
    double stiff = 0, soft = 0;  ///< of mu and 1 / mu over an element's voxels
  };
  std::vector<Sums> finer, sums;
  for (std::size_t l = 0; l < levels.size(); ++l) {
    Level& level = levels[l];
    sums.assign(l == 0 ? materials.size() : level.children.size(), {});
    for (std::size_t e = 0; l == 0 && e < sums.size(); ++e) {
      const double shear = materials[e].material.shear_modulus();
      sums[e] = {shear, 1 / shear};
    }
    for (std::size_t e = 0; e < level.children.size(); ++e)
      for (const std::int32_t child : level.children[e])
        if (child >= 0) {
          sums[e].stiff += finer[child].stiff;
          sums[e].soft += finer[child].soft;
        }
    double mixture = 0, voxels = 0;
    for (const std::int32_t e : level.element) {
      const double count = static_cast<double>(level.filled[e]);
      mixture += std::max(0.0, sums[e].stiff * sums[e].soft / count - count);
      voxels += count;
    }
    constexpr double rounding = 1e-12;
    if (voxels > 0) level.mixture = mixture > rounding * voxels ? mixture / voxels : 0;
    finer.swap(sums);
  }
}

std::vector<VoxelClass> classify_voxels(const Lattice& lattice) {
  std::vector<VoxelClass> classes(lattice.labels.size(), VoxelClass::outside);
  const std::vector<std::int32_t> segment_of = material_index(lattice.segments);
  for (std::size_t n = 0; n < classes.size(); ++n)
    if (segment_of[lattice.labels[n]] >= 0) classes[n] = VoxelClass::inside;
  for (const ExposedFace& face : exposed_faces(lattice))
    classes[lattice.voxels.offset(face.voxel)] = VoxelClass::boundary;
  return classes;
}

std::size_t bytes_of(const Lattice& lattice) {
  std::size_t sum = bytes_of(lattice.labels) + bytes_of(lattice.materials) + bytes_of(lattice.surface.points) +
                    bytes_of(lattice.surface.triangles) + bytes_of(lattice.surface.segment) +
                    (lattice.faces ? lattice.faces->bytes() : 0);
  for (const Level& l : lattice.levels)
    sum += bytes_of(l.cells) + bytes_of(l.element) + bytes_of(l.segment) + bytes_of(l.parts) + bytes_of(l.children) +
           bytes_of(l.filled) + bytes_of(l.subcells) + bytes_of(l.matrices);
  return sum;
}

std::shared_ptr<const SurfaceFaces> faces_of(const Lattice& lattice) {
  return lattice.faces ? lattice.faces : std::make_shared<const FacesInMemory>(find_faces(lattice));
}

std::vector<ExposedFace> exposed_faces(const Lattice& lattice) { return faces_of(lattice)->all(); }

}  // namespace hexmesh
