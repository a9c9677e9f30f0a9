// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <numeric>

#include "hexmesh/core/error.h"
#include "hexsolver/scene/scene.h"
#include "scene/solid_segments.h"

namespace hexsolver {

using hexmesh::Error;
using hexmesh::ErrorKind;
using hexmesh::Lattice;

const hexmesh::LatticeSegment* find_solid_segment(const Lattice& lattice, const std::string& name) {
  const auto found = std::find_if(lattice.segments.begin(), lattice.segments.end(),
                                  [&](const auto& s) { return s.segment.name == name && s.material; });
  return found == lattice.segments.end() ? nullptr : &*found;
}

std::string names_of_solid_segments(const Lattice& lattice) {
  std::vector<std::string> names;
  for (const hexmesh::LatticeSegment& s : lattice.segments)
    if (s.material) names.push_back(s.segment.name);
  return fmt::format("{}", fmt::join(names, ", "));
}

Lattice with_overrides(Lattice lattice, const Scene& scene) {
  if (scene.materials.empty()) return lattice;
  for (const auto& [name, change] : scene.materials) {
    const hexmesh::LatticeSegment* found = find_solid_segment(lattice, name);
    if (!found)
      throw Error(ErrorKind::input, fmt::format("{}: material.{} is no segment with a material, expected one of: {}",
                                                change.where, name, names_of_solid_segments(lattice)));
    hexmesh::LatticeSegment& segment = lattice.segments[static_cast<std::size_t>(found - lattice.segments.data())];
    const auto apply = [&change = change](hexmesh::Material& m) {
      if (change.young_kpa) m.young = *change.young_kpa * 1e-3;
      if (change.poisson) m.poisson = *change.poisson;
      if (change.density_kg_m3) m.density = *change.density_kg_m3 * 1e-12;
    };
    apply(*segment.material);
    hexmesh::check_material(*segment.material, name);
    for (hexmesh::VoxelMaterial& m : lattice.materials)
      if (m.label == segment.segment.label) apply(m.material);
  }
  for (hexmesh::Level& level : lattice.levels) level.matrices = {};  // of the materials before
  hexmesh::count_mixture(lattice.levels, lattice.materials);
  return lattice;
}

hexmesh::Elements source_of_elements(const Scene& scene) {
  const bool as_stored =
      scene.materials.empty() && !needs_elements(scene.elasticity, scene.stiffness_of_cells(), scene.is_reshaped());
  return as_stored ? hexmesh::Elements::stored : hexmesh::Elements::formed;
}

Lattice read_lattice_for(const Scene& scene, const std::filesystem::path& path, const LatticeNeeds& needs) {
  const bool needs_voxels =
      std::any_of(scene.contacts.begin(), scene.contacts.end(), [](const Contact& c) { return c.is_within_body(); });
  const hexmesh::Voxels voxels = needs.pictures || needs_voxels ? hexmesh::Voxels::read : hexmesh::Voxels::left_out;
  const int coarsest = needs.levels.empty() ? 0 : *std::max_element(needs.levels.begin(), needs.levels.end());
  std::vector<int> levels = needs.levels;
  if (scene.stiffness_of_cells() == Stiffness::condensed && coarsest > 0) {  // from their voxels on
    levels.resize(static_cast<std::size_t>(coarsest) + 1);
    std::iota(levels.begin(), levels.end(), 0);
  }
  Lattice lattice = hexmesh::read_lattice(path, levels, source_of_elements(scene), voxels);
  for (int n = 0; n < coarsest; ++n)
    if (std::find(needs.levels.begin(), needs.levels.end(), n) == needs.levels.end()) lattice.level(n).matrices = {};
  return with_overrides(std::move(lattice), scene);
}

}  // namespace hexsolver
