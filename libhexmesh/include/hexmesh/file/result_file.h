// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "hexmesh/lattice/lattice.h"
#include "hexmesh/lattice/nodes.h"

namespace hexmesh {

inline constexpr int result_version = 4;
inline constexpr const char* result_format = "hexmesh result";  ///< as its header says

/// The points that one condition of the scene holds.
struct ConditionPoints {
  std::string name;
  std::vector<Vec3> points;                       ///< rest positions [mm]
  std::vector<Vec3> displacement;                 ///< [mm]
  std::array<bool, 3> axes = {true, true, true};  ///< which components it prescribes
};

/// A level at rest or solved: all that is needed to export pictures without the lattice file.
struct Result {
  Grid voxels;                        ///< the lattice's box at scan resolution
  std::vector<std::uint16_t> labels;  ///< shape (voxels.num_voxels())
  std::vector<LatticeSegment> segments;
  int level = 0;  ///< the mechanical level
  Index3 voxels_per_cell = {1, 1, 1};
  std::vector<Index3> cells;                               ///< shape (num_cells)
  std::vector<CellNodes> cell_nodes;                       ///< shape (num_cells, 8), node order of shape.h
  std::vector<Vec3> nodes;                                 ///< rest positions [mm]
  std::vector<Vec3> displacement;                          ///< per node [mm]; empty at rest
  std::vector<Vec3> velocity;                              ///< per node [mm/s]; empty if nothing moves
  std::vector<std::uint16_t> segment;                      ///< label of each cell
  std::map<std::string, std::vector<double>> cell_fields;  ///< e.g. fill [1], strain_energy_density [N/mm^2]
  TriangleSurface surface;                                 ///< rest positions
  std::vector<Vec3> surface_displacement;                  ///< per surface point [mm]
  std::vector<ConditionPoints> conditions;
  std::vector<double> times;         ///< of the steps of a motion that the file keeps [s]
  std::string report;                ///< JSON
  std::string costs;                 ///< JSON: seconds and memory, which differ from run to run; may be empty
  std::vector<std::string> history;  ///< command lines, oldest first
};

/// A level before anything is solved: geometry, segments, surface and the cell fields fill and parts (see parts.h).
Result rest_state(const Lattice& lattice, int level);

/// A state of a motion.
struct MotionStep {
  std::vector<Vec3> displacement, velocity;  ///< per node [mm], [mm/s]
};

namespace hdf5 {
class Writer;
}

/// Writes a result file: first the steps of a motion, if there are any, as they come, then the rest.
class ResultWriter {
public:
  /// @throws Error{output}, as all below
  explicit ResultWriter(const std::filesystem::path& path);
  ~ResultWriter();

  /// @param displacement, velocity  (x, y, z) of node 0, of node 1, ...
  void add_step(double time, std::span<const double> displacement, std::span<const double> velocity);

  /// @param result  its times are those of the steps added
  void finish(const Result& result);

private:
  std::unique_ptr<hdf5::Writer> file_;
  std::vector<double> times_;
};

/// A result without steps. @throws Error{output}
void write_result(const Result& result, const std::filesystem::path& path);

/// The rows of a result that one of several processes has.
struct ResultRows {
  Result part;                  ///< cells with what belongs to them, nodes with displacement, surface_displacement
  std::size_t first_cell = 0;   ///< of the whole
  std::size_t first_node = 0;   ///< likewise; cell_nodes count in the whole
  std::size_t first_point = 0;  ///< of the surface, likewise
};

/// Begin a result that processes then write one after the other, none of them holding all of it.
/// @param common   what has no rows: level, conditions, report, history; cell_fields by name, each empty
/// @param lattice  the file that voxels, segments and surface are copied from
/// @throws Error{output}
void begin_result(const Result& common, const std::filesystem::path& lattice, std::size_t num_cells,
                  std::size_t num_nodes, std::size_t num_surface_points, const std::filesystem::path& path);

/// @throws Error{output}
void write_result_rows(const ResultRows& rows, const std::filesystem::path& path);

/// @throws Error{input} naming the file and what is wrong with it
Result read_result(const std::filesystem::path& path);

/// One of Result::times. @throws Error{input} likewise
MotionStep read_step(const std::filesystem::path& path, const Result& result, std::size_t number);

}  // namespace hexmesh
