// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hexsolver/newton.h"
#include "shared_level.h"

namespace hexsolver::mpi {

/// minimize() of newton.h by PETSc: SNES with the exact Hessian, clamped where it has to be, a line search on the
/// energy, conjugate gradients, and multigrid on the levels (PCMG) unless PETSc's options say otherwise.
///
/// @param remaining  receives what one more step would add, by one cycle, where it converged (NewtonReport::remaining)
NewtonReport minimize(SharedLevel& level, const NewtonOptions& options, Vec u, Vec remaining,
                      const NewtonProgress& progress);

/// What our levels are smoothed by, where PETSc's options do not say otherwise.
void set_default_options();

}  // namespace hexsolver::mpi
