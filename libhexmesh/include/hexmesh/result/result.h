// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>
#include <vector>

#include "hexmesh/lattice/lattice.h"
#include "hexmesh/lattice/locator.h"
#include "hexmesh/lattice/nodes.h"

namespace hexmesh {

/// The points that one condition of the scene holds.
struct ConditionPoints {
  std::string name;
  std::vector<Vec3> points;                       ///< rest positions [mm]
  std::vector<Vec3> displacement;                 ///< [mm]
  std::array<bool, 3> axes = {true, true, true};  ///< which components it prescribes
};

/// A level at rest or solved: all that is needed to export pictures without the lattice file. One that a solution made
/// may be without labels and surface; its file gets those of the lattice file.
struct Result {
  Grid voxels;                        ///< the lattice's box at scan resolution
  std::vector<std::uint16_t> labels;  ///< shape (voxels.num_voxels())
  std::vector<LatticeSegment> segments;
  int level = 0;  ///< the mechanical level
  Index3 voxels_per_cell = {1, 1, 1};
  std::vector<Index3> cells;           ///< shape (num_cells)
  Parting parting;                     ///< what the cells keep apart
  VoxelOwners owners;                  ///< where several cells stand at one index
  std::vector<CellNodes> cell_nodes;   ///< shape (num_cells, 8), node order of shape.h
  std::vector<Vec3> nodes;             ///< rest positions [mm]
  std::vector<Vec3> displacement;      ///< per node [mm]; empty at rest
  std::vector<Vec3> displacement_raw;  ///< as solved, where displacement has been continued (NodeExtension); else empty
  std::vector<Vec3> rest_displacement;  ///< per node, to where the body is without load [mm]; empty: `nodes`
  std::vector<Vec3> velocity;           ///< per node [mm/s]; empty if nothing moves
  std::vector<Vec3> load;               ///< per node, of forces and gravity [N]; empty without or in a motion
  std::vector<Vec3> contact_force;      ///< per node, of obstacles [N]; empty without
  std::vector<std::uint16_t> segment;   ///< label of each cell
  std::map<std::string, std::vector<double>> cell_fields;  ///< e.g. fill [1], strain_energy_density [N/mm^2]
  TriangleSurface surface;                                 ///< rest positions; see surface_of_voxels
  std::vector<Vec3> surface_displacement;                  ///< per surface point [mm]
  std::vector<ConditionPoints> conditions;
  std::vector<double> times;         ///< of the steps of a motion that the file keeps [s]
  std::string report;                ///< JSON
  std::string costs;                 ///< JSON: seconds and memory, which differ from run to run; may be empty
  std::vector<std::string> history;  ///< command lines, oldest first
  bool surface_of_voxels = false;    ///< files leave `surface` out: add_surface() makes it (see surface/extract.h)
};

/// Finds its cells. The result must outlive it and keep its cells.
CellLocator locator_of(const Result& result);

/// A level before anything is solved: geometry, segments, surface and the cell fields fill and parts (see parts.h).
Result rest_state(const Lattice& lattice, int level);

/// Of a result with a rest_displacement: how far its nodes are displaced from there [mm].
std::vector<Vec3> displacement_from_rest(const Result& result);

/// Move the surface with the cells: surface_displacement from displacement.
void move_surface(Result& result);

/// A state of a motion.
struct MotionStep {
  std::vector<Vec3> displacement, velocity;                     ///< per node [mm], [mm/s]
  std::vector<Vec3> contact_force;                              ///< as Result's
  std::map<std::string, std::vector<double>> cell_fields = {};  ///< of Result's those that change; may be none
};

}  // namespace hexmesh
