// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "hexsolver/scene/scene.h"
#include "mesh/mesh_cells.h"
#include "terms/elastic.h"

namespace hexsolver {

/// Cauchy stress along the axes of a stretch [MPa].
/// @param shear, bulk  mu and kappa [MPa]
Vec3 principal_stress(Elasticity law, double shear, double bulk, const Vec3& stretches);

/// The stretch, symmetric, under which material has a Cauchy stress, symmetric [MPa]; nothing where none is found.
/// Newton's method on the three stretches along the axes of the stress, in parts of it.
std::optional<Mat3> stretch_under(Elasticity law, double shear, double bulk, const Mat3& stress);

/// The stretch F0 of each cell in the shape that the lattice shows, see ElasticCells::set_prestretch(). Cells that
/// several segments share have the mean stretch of those by their stiffness, and the mean stress of those by their
/// volume, borne by their mean moduli.
/// @param elastic  cells of the law, at rest on the lattice
/// @throws Error{input} for an unknown segment, one without material, or a stress that the law does not bear
std::vector<Mat3> find_prestretches(const MeshCells& cells, const std::vector<Prestress>& prestresses,
                                    const ElasticCells& elastic, Elasticity law);

}  // namespace hexsolver
