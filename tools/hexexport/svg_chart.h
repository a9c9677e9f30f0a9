// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace hextools {

struct ChartAxis {
  std::string title;  ///< with its unit
  bool logarithmic = false;
};

struct ChartSeries {
  std::string name;
  std::vector<std::pair<double, double>> points;
  std::vector<std::string> labels;  ///< of the points; none = no labels
};

/// Lines with markers over two axes as one <svg> element; series differ in dashes and markers too, to be told apart in
/// grey. Points that a logarithmic axis cannot show are left out.
std::string svg_chart(const ChartAxis& x, const ChartAxis& y, const std::vector<ChartSeries>& series);

/// Text with &, <, >, " as entities.
std::string escaped_html(const std::string& text);

}  // namespace hextools
