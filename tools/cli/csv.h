// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace hextools {

/// Text in quotation marks, as a field of a CSV file (RFC 4180).
std::string csv_quoted(const std::string& text);

/// Likewise, but without quotation marks where it can do without. A text that a spreadsheet would take for a formula
/// gets an apostrophe before it.
std::string csv_field(const std::string& text);

}  // namespace hextools
