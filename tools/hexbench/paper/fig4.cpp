// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "hexmesh/lattice/element_tree.h"
#include "measurements.h"

namespace hextools::paper {

using hexmesh::Vec3;

std::vector<Row> fig4(const Console& /*console*/) {
  const hexmesh::Material rubber = hexmesh::material_from_units(100, 0.3, 1000);
  hexmesh::Element quarter;
  hexmesh::add_child(quarter, hexmesh::full_voxel(rubber, 1), 0, {2, 2, 1});
  const hexmesh::ElementMatrices matrices(Vec3(2, 2, 1).asDiagonal());
  const hexmesh::CellMatrix k = matrices.stiffness(quarter);
  const hexmesh::CellMatrix uniform = matrices.stiffness(hexmesh::spread_evenly(quarter));
  // The same four children as elements of their own, condensed onto the corner of the full one: its own stiffness.
  const hexmesh::CellMatrix child =
      hexmesh::ElementMatrices(Vec3(1, 1, 1).asDiagonal()).stiffness(hexmesh::full_voxel(rubber, 1));
  const auto row = [&](const char* where, int dof, double reference, const std::string& reading) {
    return Row{{"case", where},
               {"paper", nullptr},
               {"ours", k(dof, dof)},
               {"reference", reference},
               {"uniform", uniform(dof, dof)},
               {"reading", reading}};
  };
  return {row("one full child of four, at its corner [N/mm]", 0, child(0, 0),
              fmt::format("non-uniform is {:.1f} times the uniform cell there, and near the child's own stiffness",
                          k(0, 0) / uniform(0, 0))),
          row("at the corner across [N/mm]", 9, 0,
              fmt::format("nothing is there: {:.0f} % of the uniform cell's", 100 * k(9, 9) / uniform(9, 9)))};
}

}  // namespace hextools::paper
