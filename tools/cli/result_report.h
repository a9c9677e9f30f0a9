// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>

#include "hexmesh/result/result.h"

namespace hextools {

/// What a result says of its solution, checked: each key that tools look at has its type, and lists that they walk
/// through are there, empty where the file has none. A result without a report gives an empty one.
struct ResultReport {
  nlohmann::json report;
  nlohmann::json costs;  ///< an object; empty where the file has none

  bool is_preview() const { return report.value("is_preview", false); }  ///< of a scene that is not solved
  bool converged() const { return report.value("converged", true); }
  double load_fraction() const { return number_in(report, "load_fraction", 0); }
  std::string reason() const { return report.value("reason", ""); }

  /// A number of an object, or another where there is none.
  static double number_in(const nlohmann::json& object, const char* key, double otherwise) {
    const auto found = object.find(key);
    return found != object.end() && found->is_number() ? found->get<double>() : otherwise;
  }
};

/// @throws Error{input} naming dataset, key and value
ResultReport report_of(const hexmesh::Result& result);

}  // namespace hextools
