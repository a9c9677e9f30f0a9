// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "cli/tool.h"
#include "hexmesh/file/result_file.h"
#include "hexsolver/dynamics/motion.h"
#include "interruption.h"

namespace hextools {

/// Solves the motion; its steps go to the result's file and to the stream as they come.
/// @param writer   of the result's file; nullptr if there is none
/// @param streams  whether the surface goes to standard output
/// @param interruption  what ends it after the step that it is in
/// @throws Error{output} where the stream cannot be written and there is no file; as solve_dynamics
hexsolver::Outcome solve_motion(const hexmesh::Lattice& lattice, const hexsolver::Scene& scene, int level,
                                hexmesh::ResultWriter* writer, bool streams, const Interruption& interruption,
                                const Console& console);

}  // namespace hextools
