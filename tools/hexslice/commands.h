// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "cli/tool.h"

namespace hextools {

/// The subcommands of hexslice.
Declare declare_planes, declare_steps, declare_volume;

}  // namespace hextools
