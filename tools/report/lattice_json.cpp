// SPDX-License-Identifier: Apache-2.0
#include "report/lattice_json.h"

#include <algorithm>
#include <limits>

#include "hexmesh/lattice/nodes.h"

namespace hextools {
namespace {

using hexmesh::Lattice;
using nlohmann::json;

std::string name_of(const Lattice& lattice, std::uint16_t label) {
  for (const hexmesh::LatticeSegment& s : lattice.segments)
    if (s.segment.label == label) return s.segment.name;
  return {};
}

/// Cells that join what is apart, the worst first.
json joined_cells(const Lattice& lattice, int number) {
  constexpr std::size_t most = 100;
  const hexmesh::Level& level = lattice.levels[static_cast<std::size_t>(number)];
  std::vector<std::size_t> joined;
  for (std::size_t c = 0; c < level.cells.size(); ++c)
    if (level.parts[c] > 1) joined.push_back(c);
  std::stable_sort(joined.begin(), joined.end(),
                   [&](std::size_t a, std::size_t b) { return level.parts[a] > level.parts[b]; });
  json list = json::array();
  for (std::size_t n = 0; n < std::min(joined.size(), most); ++n) {
    const hexmesh::Index3& c = level.cells[joined[n]];
    const hexmesh::Vec3 center =
        lattice.corner() + lattice.cell_edges(number) * hexmesh::Vec3(c[0] + 0.5, c[1] + 0.5, c[2] + 0.5);
    list.push_back({{"parts", level.parts[joined[n]]}, {"center_mm", {center[0], center[1], center[2]}}});
  }
  return list;
}

json describe_level(const Lattice& lattice, int number) {
  const hexmesh::Level& level = lattice.levels[static_cast<std::size_t>(number)];
  const hexmesh::Vec3 size = lattice.cell_size(number);
  std::size_t boundary = 0, joined = 0, split = 0;
  double least = 1;
  for (std::size_t c = 0; c < level.cells.size(); ++c) {
    boundary += level.is_boundary(c);
    joined += level.parts[c] > 1;
    split += c > 0 && level.cells[c] == level.cells[c - 1];
    least = std::min(least, level.fill(c));
  }
  json out = {{"level", number},
              {"cells", level.cells.size()},
              {"nodes", hexmesh::count_nodes(level.cells, level.split)},
              {"boundary_cells", boundary},
              {"unique_matrices", level.filled.size()},
              {"joined_cells", joined},
              {"joined", joined_cells(lattice, number)},
              {"smallest_fill", least},
              {"cell_mm", {size[0], size[1], size[2]}}};
  if (lattice.parting.any()) out["split_cells"] = split;
  return out;
}

json describe_segment(const Lattice& lattice, const hexmesh::LatticeSegment& s) {
  const double voxel_ml = lattice.voxels.voxel_volume() / 1000;
  const double volume = static_cast<double>(s.num_voxels) * voxel_ml;
  json entry = {{"name", s.segment.name}, {"label", s.segment.label}, {"volume_ml", volume}};
  if (!s.material) return entry;
  const hexmesh::Material& m = *s.material;
  entry["young_kpa"] = m.young * 1e3;
  entry["poisson"] = m.poisson;
  entry["density_kg_m3"] = m.density * 1e12;
  entry["mass_g"] = volume * 1e3 * m.density * 1e6;
  entry["source"] = s.source;
  double low = std::numeric_limits<double>::infinity(), high = 0;
  std::size_t count = 0;
  for (const hexmesh::VoxelMaterial& of_voxel : lattice.materials) {
    if (of_voxel.label != s.segment.label) continue;
    low = std::min(low, of_voxel.material.young * 1e3);
    high = std::max(high, of_voxel.material.young * 1e3);
    ++count;
  }
  entry["materials"] = count;
  if (count > 1) entry["young_kpa_range"] = {low, high};
  return entry;
}

/// Voxels of the box by class (see hexmesh::VoxelClass), without their labels: those with material are the cells of
/// level 0.
json describe_voxels(const Lattice& lattice) {
  std::size_t boundary = 0;
  const std::vector<hexmesh::ExposedFace> faces = hexmesh::exposed_faces(lattice);  // sorted by voxel
  for (std::size_t n = 0; n < faces.size(); ++n) boundary += n == 0 || faces[n].voxel != faces[n - 1].voxel;
  const std::size_t cells = lattice.levels.front().cells.size();
  return {{"outside", lattice.voxels.num_voxels() - cells}, {"inside", cells - boundary}, {"boundary", boundary}};
}

}  // namespace

nlohmann::json describe(const Lattice& lattice, const std::vector<bool>& has_matrices) {
  json report;
  for (int n = 0; n < static_cast<int>(lattice.levels.size()); ++n) {
    report["levels"].push_back(describe_level(lattice, n));
    report["levels"].back()["stored_matrices"] = static_cast<bool>(has_matrices[static_cast<std::size_t>(n)]);
  }
  for (const hexmesh::LatticeSegment& s : lattice.segments) report["segments"].push_back(describe_segment(lattice, s));
  report["voxels"] = describe_voxels(lattice);
  const hexmesh::Vec3& spacing = lattice.voxels.spacing();
  report["voxel_mm"] = {spacing[0], spacing[1], spacing[2]};
  for (const hexmesh::LatticeSegment& s : lattice.segments) {
    const hexmesh::TriangleSurface surface = hexmesh::of_segment(lattice.surface, s.segment.label);
    if (surface.triangles.empty()) continue;
    report["surfaces"].push_back({{"segment", s.segment.name},
                                  {"triangles", surface.triangles.size()},
                                  {"open_edges", hexmesh::count_open_edges(surface)},
                                  {"volume_ml", hexmesh::enclosed_volume(surface) / 1000}});
  }
  if (lattice.parting.any()) {
    report["gaps"] = "split";
    report["sliding"] = json::array();
    for (const auto& [one, other] : lattice.parting.sliding)
      report["sliding"].push_back({name_of(lattice, one), name_of(lattice, other)});
  }
  report["history"] = lattice.history;
  return report;
}

}  // namespace hextools
