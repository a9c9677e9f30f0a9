// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

namespace hexmesh {

/// A text from a file as a terminal, an XML file or a log may have it: control characters, signs that turn the
/// direction of writing, and bytes that are no UTF-8 as \x1b, \u202e, ...; line ends stay.
std::string printable(std::string_view text);

/// Likewise on one line.
std::string printable_line(std::string_view text);

}  // namespace hexmesh
