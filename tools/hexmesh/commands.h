// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "cli/tool.h"

namespace hextools {

/// The subcommands of hexmesh.
Declare declare_build, declare_info, declare_check, declare_surface;

}  // namespace hextools
