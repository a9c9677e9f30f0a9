// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <pybind11/pybind11.h>

#include "arrays.h"
#include "hexmesh/core/grid.h"
#include "hexmesh/geometry/triangle_surface.h"
#include "hexmesh/lattice/lattice.h"

// The parts of the module `_core`. Its docstrings are in hextools/_core.pyi.

namespace hextools::python {

namespace py = pybind11;

void bind_lattice(py::module_& module);
void bind_result(py::module_& module);
void bind_solutions(py::module_& module);

/// {"points": (n, 3) [mm], "triangles": (m, 3), "segment": (m)}, views into the owner's.
py::dict surface_dict(const hexmesh::TriangleSurface& surface, const py::capsule& owner);

/// @throws Error{input} for what is no grid
hexmesh::Grid grid_of(const py::array& values, const Numbers& spacing, const Numbers& origin, const Axes& direction);

/// Rows of a grid's direction.
py::tuple direction_tuple(const hexmesh::Grid& grid);

py::tuple vector_tuple(const hexmesh::Vec3& v);

/// Of the nodes of a level, at rest [mm].
std::vector<hexmesh::Vec3> node_positions(const hexmesh::Lattice& lattice, int level);

}  // namespace hextools::python
