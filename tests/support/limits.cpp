// SPDX-License-Identifier: Apache-2.0
#include "limits.h"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "files.h"

namespace testing_support {

double limit_of(const std::string& name, const std::string& component) {
  for (const auto& row : nlohmann::json::parse(read_text(HEXTOOLS_SOURCE "/tests/data/limits.json")))
    if (row["name"] == name && row.contains(component)) return row[component]["limit"];
  ADD_FAILURE() << "no limit '" << name << "', '" << component << "'";
  return NAN;
}

}  // namespace testing_support
