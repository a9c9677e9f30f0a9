// SPDX-License-Identifier: Apache-2.0
#include "cli/csv.h"

#include <algorithm>
#include <vector>

#include "cli/parse.h"

namespace hextools {

namespace {

/// Source: OWASP, "CSV Injection": what begins with one of these signs, but for numbers and points.
bool is_formula(const std::string& text) {
  if (text.empty() || std::string("=+-@\t\r").find(text[0]) == std::string::npos) return false;
  const std::vector<std::string> parts = split(text, ',');
  return std::any_of(parts.begin(), parts.end(), [](const std::string& part) { return !parse_number<double>(part); });
}

std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) out += c == '"' ? std::string("\"\"") : std::string(1, c);
  return out + "\"";
}

}  // namespace

std::string csv_quoted(const std::string& text) { return quoted(is_formula(text) ? "'" + text : text); }

std::string csv_field(const std::string& text) {
  if (is_formula(text)) return csv_quoted(text);
  return text.find_first_of(",\"\r\n") == std::string::npos ? text : quoted(text);
}

}  // namespace hextools
