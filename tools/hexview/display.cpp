// SPDX-License-Identifier: Apache-2.0
#include "display.h"

#include <X11/Xlib.h>
#include <fmt/format.h>

#include <cstdlib>

#include "hexmesh/core/error.h"

namespace hextools {

void expect_display() {
  const char* name = std::getenv("DISPLAY");
  const bool is_named = name && *name != 0;
  Display* display = is_named ? XOpenDisplay(name) : nullptr;
  if (!display)
    throw hexmesh::Error(
        hexmesh::ErrorKind::output,
        fmt::format("no window can be opened: DISPLAY is {}, expected an X server (without a screen: xvfb-run "
                    "hexview ...)",
                    is_named ? fmt::format("'{}', which does not answer", name) : "not set"));
  XCloseDisplay(display);
}

}  // namespace hextools
