// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "cli/run_files.h"
#include "hexmesh/result/result.h"
#include "hexmesh/view/vtk_export.h"

namespace hextools {

/// node,x,y,z,ux,uy,uz [mm, LPS] of the lattice nodes.
std::string nodes_csv(const hexmesh::Result& result);

/// The report as it is, and its numbers and texts as key,value.
std::string report_json(const hexmesh::Result& result);
std::string report_csv(const hexmesh::Result& result);

/// Reactions by the report, in the order of the conditions.
std::vector<hexmesh::ConditionForce> condition_forces(const hexmesh::Result& result);

/// A point whose way is asked for.
struct Probe {
  std::string name;
  hexmesh::Vec3 position;  ///< at rest [mm, LPS]
};

/// @param texts  "x,y,z", or markup files
/// @throws Error{usage}, Error{input}
std::vector<Probe> read_probes(const std::vector<std::string>& texts, RunFiles& files);

/// probe,time_s,x,y,z,ux,uy,uz,segment as CSV: a row for each probe, and of a motion for each state it keeps; the
/// segment is empty where the point is not in the material.
/// @param path  of the result
/// @throws Error{geometry} naming a probe that no cell holds
std::string probe_table(const std::filesystem::path& path, const hexmesh::Result& result,
                        const std::vector<Probe>& probes);

}  // namespace hextools
