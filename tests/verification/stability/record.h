// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "mesh/mesh.h"
#include "support/forms.h"

/// What the cases of the suite measure: held against its limit, and kept for the table and the pictures.
namespace stability {

using testing_support::is_full;
using testing_support::whole_or;

/// The larger of the two; what is not a number counts as largest.
inline double worst(double a, double b) { return std::isnan(a) || a > b ? a : b; }

/// One case: figures with their limits, and what its picture shows. At its end a line of JSON is added to the file that
/// HEXTOOLS_STABILITY_RECORDS names, if it is set.
class Case {
public:
  /// @param family  number and name, e.g. "01 inversion"
  Case(std::string family, std::string name);
  Case(const Case&) = delete;
  Case& operator=(const Case&) = delete;
  ~Case();

  void at_most(const std::string& what, double measured, double limit);
  void at_least(const std::string& what, double measured, double limit);
  void note(const std::string& what, double measured);         ///< reported, without a limit
  void note(const std::string& what, const std::string& how);  ///< in words

  /// A curve of the picture of that title; all curves of one title share their axes.
  struct Axes {
    std::string title, x, y;
    bool log_x = false, log_y = false;
  };
  void curve(const Axes& axes, const std::string& label, const std::vector<double>& x, const std::vector<double>& y);

  /// The edges of the cells of a body, displaced.
  void body(const std::string& label, const hexsolver::Mesh& mesh, const hexsolver::NodeVector& u);

private:
  void add(const std::string& what, double measured, const char* relation, double limit, bool holds);

  nlohmann::ordered_json record_;
  int failures_before_;  ///< of the test, by cases before
  int missed_figures_ = 0;
};

}  // namespace stability
