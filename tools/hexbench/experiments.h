// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>
#include <vector>

#include "hexmesh/file/result_file.h"
#include "hexmesh/lattice/lattice.h"
#include "hexmesh/volume/label_volume.h"
#include "hexsolver/scene/scene.h"

/// The paper's experiments as bodies and conditions: what hexbench measures and the tests verify.
namespace hextools {

/// "beam", "cylinder", ...: a solid phantom centred at the origin.
/// @param spacing  of its voxels [mm]
/// @param size     by name, e.g. radius [mm]; what is not named has its default
hexmesh::LabelVolume solid(const std::string& name, double spacing, const std::map<std::string, double>& size);

/// A lattice of the first segment alone, of 1000 kg/m^3.
hexmesh::Lattice lattice_of(hexmesh::LabelVolume volume, double young_kpa, double poisson,
                            const hexmesh::LatticeOptions& options = {});

/// The phantom's liver with its tumour and vessel as one body, E = 100 kPa.
hexmesh::Lattice liver_of_phantom(double spacing, double poisson, const hexmesh::Index3& offset = {0, 0, 0});

/// A condition on the places within `radius` of `center` [mm]: they move by `by` [mm].
hexsolver::Condition patch(const std::string& name, const hexmesh::Vec3& center, double radius, const hexmesh::Vec3& by,
                           hexsolver::SurfacePoints on = hexsolver::SurfacePoints::faces);

/// A condition on the places with (p - point) . normal >= 0: they move by `by` [mm].
hexsolver::Condition beyond(const std::string& name, const hexmesh::Vec3& point, const hexmesh::Vec3& normal,
                            const hexmesh::Vec3& by, hexsolver::SurfacePoints on = hexsolver::SurfacePoints::faces);

/// The ends z = -half and z = half clamped and moved together by `press` [mm].
std::vector<hexsolver::Condition> pressed_ends(double half, double press, hexsolver::SurfacePoints on);

/// Three places of the phantom's liver held, the fourth pulled by 40 mm, as in the example scene.
std::vector<hexsolver::Condition> phantom_patches(double radius);

/// 360 points on the circle around z at z = 0 [mm].
std::vector<hexmesh::Vec3> circle(double radius);

/// Centres of all voxels with material [mm].
std::vector<hexmesh::Vec3> material_points(const hexmesh::Lattice& lattice);

/// Displacements of a result at places of the body at rest [mm]; zero where no cell is near.
std::vector<hexmesh::Vec3> displacement_at(const hexmesh::Result& result, const std::vector<hexmesh::Vec3>& places);

}  // namespace hextools
