// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hexmesh/file/result_file.h"
#include "hexmesh/lattice/lattice.h"

namespace testing_support {

/// Two segments with material, one without, in three levels, with a surface of its own.
inline hexmesh::Lattice small_lattice() {
  using namespace hexmesh;
  const Grid grid({5, 4, 3}, {1, 1, 2});
  LabelVolume volume{grid, std::vector<std::uint16_t>(grid.num_voxels()), {{1, "liver"}, {2, "tumour"}}};
  for (std::size_t n = 0; n < volume.labels.size(); ++n) volume.labels[n] = n % 7 == 0 ? 0 : n % 5 == 0 ? 2 : 1;
  const Material soft = material_from_units(5, 0.3, 1000), stiff = material_from_units(50, 0.4, 1100);
  Lattice lattice = build_lattice(volume, {{volume.segments[0], soft, 0, "given"}, {volume.segments[1], stiff, 0, "x"}},
                                  {3, {0, 0, 0}});
  lattice.surface.points = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  lattice.surface.triangles = {{0, 1, 2}};
  lattice.surface.segment = {1};
  lattice.history = {"hexscan a", "hexmesh build b"};
  return lattice;
}

/// A motion of it at level 1 with one state kept and a condition.
inline void write_small_result(const std::filesystem::path& path) {
  using namespace hexmesh;
  Result result = rest_state(small_lattice(), 1);
  result.displacement.assign(result.nodes.size(), Vec3(1, 2, 3));
  result.conditions = {{"held", {{1, 2, 3}}, {{0, 0, 0}}}};
  result.report = "{}";
  result.costs = "{}";
  result.velocity.assign(result.nodes.size(), Vec3(4, 5, 6));
  result.load.assign(result.nodes.size(), Vec3(0, 0, -1));
  result.contact_force.assign(result.nodes.size(), Vec3(0, 1, 0));
  ResultWriter writer(path);
  writer.add_step(0.5, {result.displacement,
                        result.velocity,
                        {result.nodes.size(), Vec3(7, 8, 9)},
                        {{"fill", std::vector<double>(result.cells.size(), 0.25)}}});
  writer.finish(result);
}

}  // namespace testing_support
