// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "cli/tool.h"

namespace hextools {

/// The subcommands of hexbench.
Declare declare_machine, declare_lattice, declare_solver, declare_effects, declare_motion, declare_accuracy,
    declare_estimates, declare_paper, declare_compare;

}  // namespace hextools
