// SPDX-License-Identifier: Apache-2.0
#include "statistics.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace hextools {
namespace {

std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) out += c == '"' ? std::string("\"\"") : std::string(1, c);
  return out + "\"";
}

}  // namespace

Distances statistics(const std::vector<double>& values) {
  if (values.empty()) return {};
  Distances d{0, values.front(), values.front(), 0};
  const auto count = static_cast<double>(values.size());
  for (const double v : values) {
    d.mean += v / count;
    d.min = std::min(d.min, v);
    d.max = std::max(d.max, v);
  }
  for (const double v : values) d.deviation += (v - d.mean) * (v - d.mean) / count;
  d.deviation = std::sqrt(d.deviation);
  return d;
}

Distances distances(const std::vector<hexmesh::Vec3>& a, const std::vector<hexmesh::Vec3>& b) {
  std::vector<double> lengths(a.size());
  for (std::size_t n = 0; n < a.size(); ++n) lengths[n] = (a[n] - b[n]).norm();
  return statistics(lengths);
}

void add_to(Row& row, const std::string& prefix, const Distances& d) {
  row[prefix + "_mean"] = d.mean;
  row[prefix + "_min"] = d.min;
  row[prefix + "_max"] = d.max;
  row[prefix + "_std"] = d.deviation;
}

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
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
        text += quoted(found->get<std::string>());
      else if (found != row.end() && !found->is_null())
        text += found->dump();
      end_cell(c);
    }
  return text;
}

}  // namespace hextools
