// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <random>

#include "constraints/constraints.h"
#include "hexmesh/lattice/lattice.h"
#include "hexmesh/result/result.h"
#include "mesh/mesh_cells.h"
#include "terms/elastic.h"
#include "terms/potential.h"

/// Small bodies and fields that the tests share.
namespace testing_support {

using hexmesh::Index3;
using hexmesh::Lattice;
using hexmesh::Mat3;
using hexmesh::Vec3;

/// A label volume from a function of the voxel index.
hexmesh::LabelVolume make_volume(const Index3& extent, const Vec3& spacing,
                                 const std::function<int(const Index3&)>& label,
                                 const Mat3& direction = Mat3::Identity(), const Vec3& origin = Vec3::Zero());

/// The same body stored with its axes permuted and those flipped whose bit is set.
hexmesh::LabelVolume stored_as(const hexmesh::LabelVolume& volume, const std::array<int, 3>& order, int flips);

/// Two materials in a ball with a bite taken out, cells partly filled at every level.
Lattice bitten_ball(const Vec3& spacing, const Index3& offset = {0, 0, 0}, const Mat3& direction = Mat3::Identity());

/// The same ball with stiffness, Poisson's ratio and density that follow grey values, different in every voxel.
Lattice grey_ball(const Vec3& spacing, const Index3& offset = {0, 0, 0}, const Mat3& direction = Mat3::Identity());

/// A body of one material, in three levels.
Lattice one_material(const Index3& extent, const Vec3& spacing, const std::function<bool(const Index3&)>& is_filled,
                     double young_kpa = 100, double poisson = 0.3);

/// A solid box of one material.
Lattice box(const Index3& extent, const Vec3& spacing, double young_kpa = 100, double poisson = 0.3);

/// A level with its nodes and surface displaced by `field` of the rest position, as if it had been solved.
hexmesh::Result displaced(const Lattice& lattice, int level, const std::function<Vec3(const Vec3&)>& field);

/// The mechanical mesh and the elastic energy of one level, or of graded cells.
struct Body {
  Body(const Lattice& lattice, int level, hexsolver::Elasticity elasticity,
       hexsolver::Volumetric volumetric = hexsolver::Volumetric::mean,
       hexsolver::Rotation rotation = hexsolver::Rotation::polar)
      : Body(hexsolver::MeshCells(lattice, level), elasticity, volumetric, rotation) {}
  Body(const hexsolver::MeshCells& cells, hexsolver::Elasticity elasticity,
       hexsolver::Volumetric volumetric = hexsolver::Volumetric::mean,
       hexsolver::Rotation rotation = hexsolver::Rotation::polar);
  hexsolver::Mesh mesh;
  hexsolver::Potential potential;
  const hexsolver::ElasticCells* elastic = nullptr;  ///< in the potential
};

/// u(node) = field(rest position).
hexsolver::NodeVector sample(const hexsolver::Mesh& mesh, const std::function<Vec3(const Vec3&)>& field);

/// Uniform in [-size, size], the same for the same seed.
hexsolver::NodeVector noise(std::size_t dofs, double size, unsigned seed = 1);

/// |H x in single precision - H x| / |H x| of a potential that is linearized.
double error_of_single_precision(const hexsolver::Potential& potential, const hexsolver::NodeVector& x);

/// A random proper rotation.
Mat3 random_rotation(unsigned seed);

/// Displacements of places inside the cells of a result [mm].
std::vector<Vec3> displacement_inside(const hexmesh::Result& result, const std::vector<Vec3>& places);
double mean_distance(const std::vector<Vec3>& a, const std::vector<Vec3>& b);

/// Constraint points at all nodes for which `where` holds, displaced by `field`.
std::vector<hexsolver::ConstraintPoint> hold_nodes(const hexsolver::Mesh& mesh,
                                                   const std::function<bool(const Vec3&)>& where,
                                                   const std::function<Vec3(const Vec3&)>& field);

}  // namespace testing_support
