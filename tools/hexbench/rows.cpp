// SPDX-License-Identifier: Apache-2.0
#include "rows.h"

#include <fmt/format.h>

#include <algorithm>

#include "cli/csv.h"

namespace hextools {

void add_to(Row& row, const std::string& prefix, const Distances& d) {
  row[prefix + "_mean"] = d.mean;
  row[prefix + "_min"] = d.min;
  row[prefix + "_max"] = d.max;
  row[prefix + "_std"] = d.deviation;
}

std::string to_csv(const std::vector<Row>& rows) {
  std::vector<std::string> columns;
  for (const Row& row : rows)
    for (const auto& [key, value] : row.items())
      if (std::find(columns.begin(), columns.end(), key) == columns.end()) columns.push_back(key);
  std::string text;
  const auto end_cell = [&](std::size_t c) { text += c + 1 < columns.size() ? ',' : '\n'; };
  for (std::size_t c = 0; c < columns.size(); ++c) {
    text += columns[c];
    end_cell(c);
  }
  for (const Row& row : rows)
    for (std::size_t c = 0; c < columns.size(); ++c) {
      const auto found = row.find(columns[c]);
      if (found != row.end() && found->is_number_float())
        text += fmt::format("{:.6g}", found->get<double>());
      else if (found != row.end() && found->is_string())
        text += csv_quoted(found->get<std::string>());
      else if (found != row.end() && !found->is_null())
        text += found->dump();
      end_cell(c);
    }
  return text;
}

}  // namespace hextools
