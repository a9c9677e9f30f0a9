// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "statistics.h"

namespace hextools {

/// Keeps the order of its keys, which becomes that of the columns of a table.
using Row = nlohmann::ordered_json;

/// PREFIX_mean, PREFIX_min, PREFIX_max, PREFIX_std.
void add_to(Row& row, const std::string& prefix, const Distances& d);

/// Rows as comma-separated values. The columns are those of all rows, in the order in which they come.
std::string to_csv(const std::vector<Row>& rows);

}  // namespace hextools
