// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "cli/tool.h"

namespace hextools {

/// hexslice volume: adds its options. @returns what to run once they are parsed
std::function<int()> declare_volume(CLI::App& app, const CommonOptions& common, const Console& console);

}  // namespace hextools
