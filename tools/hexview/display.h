// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace hextools {

/// VTK ends the program where there is no X server. @throws Error{output}
void expect_display();

}  // namespace hextools
