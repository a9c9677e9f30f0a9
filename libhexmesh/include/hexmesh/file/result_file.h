// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <vector>

#include "hexmesh/result/result.h"

namespace hexmesh {

inline constexpr int result_version = 5;
inline constexpr const char* result_format = "hexmesh result";  ///< as its header says

namespace hdf5 {
class Writer;
}

/// Writes a result file: first the steps of a motion, if there are any, as they come, then the rest.
class ResultWriter {
public:
  /// @throws Error{output}, as all below
  explicit ResultWriter(const std::filesystem::path& path);
  ~ResultWriter();

  /// @param state  its fields are those of every step
  void add_step(double time, const MotionStep& state);

  /// @param result   its times are those of the steps added
  /// @param lattice  the file that voxels and surface are copied from; empty: those of `result`
  void finish(const Result& result, const std::filesystem::path& lattice = {});

private:
  std::filesystem::path path_;
  std::unique_ptr<hdf5::Writer> file_;
  std::vector<double> times_;
};

/// A result without steps; see ResultWriter::finish(). @throws Error{output}
void write_result(const Result& result, const std::filesystem::path& path, const std::filesystem::path& lattice = {});

/// The rows of a result that one of several processes has.
struct ResultRows {
  Result part;                 ///< cells with what belongs to them, nodes with displacement
  std::size_t first_cell = 0;  ///< of the whole
  std::size_t first_node = 0;  ///< likewise; cell_nodes count in the whole
};

/// Begin a result that processes then write one after the other, none of them holding all of it.
/// @param common   what has no rows: segments, level, what parts and which voxels are whose, conditions, report,
///                 history; cell_fields by name, each empty
/// @param lattice  the file that voxels and surface are copied from
/// @throws Error{output}
void begin_result(const Result& common, const std::filesystem::path& lattice, std::size_t num_cells,
                  std::size_t num_nodes, const std::filesystem::path& path);

/// @throws Error{output}
void write_result_rows(const ResultRows& rows, const std::filesystem::path& path);

/// A surface that follows from the voxels is not there yet: see add_surface() in surface/extract.h.
/// @throws Error{input} naming the file and what is wrong with it
Result read_result(const std::filesystem::path& path);

/// One of Result::times. @throws Error{input} likewise
MotionStep read_step(const std::filesystem::path& path, const Result& result, std::size_t number);

}  // namespace hexmesh
