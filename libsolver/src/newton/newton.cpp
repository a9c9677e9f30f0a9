// SPDX-License-Identifier: Apache-2.0
#include "newton/newton.h"

namespace hexsolver {

const char* reason_of(NewtonEnd end, bool is_conservative) {
  switch (end) {
    case NewtonEnd::converged:
      return "residual below tolerance";
    case NewtonEnd::accurate:
      return "the error of the equations is small beside that of the cells";
    case NewtonEnd::interrupted:
      return "interrupted";
    case NewtonEnd::start_is_inside_out:
      return "points of the body are inside out at the start";
    case NewtonEnd::too_many_iterations:
      return "too many Newton iterations (does the body buckle or fold there?)";
    case NewtonEnd::not_positive:
      return "the stiffness matrix is not positive definite (does the body buckle there, or bend too easily?)";
    case NewtonEnd::supports_turn_inside_out:
      return "under the prescribed displacements points of the body would turn inside out";
    case NewtonEnd::no_descent:
      return is_conservative ? "no step lowers the energy"
                             : "no step lowers the residual (its forces are no gradient; rotation = \"polar\" has one)";
    case NewtonEnd::too_many_linear_iterations:
      return "too many iterations of the linear equations (are stiffnesses too far apart?)";
    case NewtonEnd::not_finite:
      return "the displacement is not finite";
    case NewtonEnd::not_accepted:
      return "the state is not accepted";
  }
  return "";
}

}  // namespace hexsolver
