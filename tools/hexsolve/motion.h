// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "cli/interruption.h"
#include "cli/tool.h"
#include "hexmesh/file/result_file.h"
#include "hexsolver/dynamics/motion.h"
#include "motion_stream.h"

namespace hextools {

/// What goes in and out while a motion is solved.
struct MotionIo {
  hexmesh::ResultWriter* writer = nullptr;  ///< of the result's file, if there is one
  std::optional<Streamed> streamed;         ///< to standard output
  std::string steer;                        ///< where commands come from; empty: nowhere
  std::string record;                       ///< becomes what was carried out
};

/// Solves the motion; its steps go to the result's file and to the stream as they come.
/// @param interruption  what ends it after the step that it is in
/// @throws Error{output} where the stream cannot be written and there is no file; as Steering, solve_dynamics
hexsolver::Outcome solve_motion(const hexmesh::Lattice& lattice, const hexsolver::Scene& scene, int level, MotionIo& io,
                                const Interruption& interruption, const Console& console);

}  // namespace hextools
