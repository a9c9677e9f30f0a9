// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/lattice/material_rule.h"

#include <algorithm>
#include <cmath>

namespace hexmesh {
namespace {

double interpolate(const std::vector<std::pair<double, double>>& points, double x) {
  if (x <= points.front().first) return points.front().second;
  if (x >= points.back().first) return points.back().second;
  const auto after = std::upper_bound(points.begin(), points.end(), x,
                                      [](double value, const auto& point) { return value < point.first; });
  const auto& [x0, y0] = *(after - 1);
  const auto& [x1, y1] = *after;
  return y0 + (y1 - y0) * (x - x0) / (x1 - x0);
}

double value_of(const Quantity& quantity, double grey, double density_kg_m3) {
  if (const double* number = std::get_if<double>(&quantity)) return *number;
  const GreyLaw& law = std::get<GreyLaw>(quantity);
  return law(law.of_density ? density_kg_m3 : grey);
}

}  // namespace

double GreyLaw::operator()(double x) const {
  double value = 0;
  switch (shape) {
    case Shape::linear:
      value = offset + factor * x;
      break;
    case Shape::power:
      value = offset + factor * std::pow(std::max(x, 0.0), exponent);
      break;
    case Shape::piecewise:
      value = interpolate(points, x);
      break;
  }
  if (min) value = std::max(value, *min);
  if (max) value = std::min(value, *max);
  return value;
}

bool MaterialRule::varies() const {
  return std::holds_alternative<GreyLaw>(young_kpa) || std::holds_alternative<GreyLaw>(poisson) ||
         std::holds_alternative<GreyLaw>(density_kg_m3);
}

Material MaterialRule::at(double grey) const {
  const double density = value_of(density_kg_m3, grey, 0);
  return material_from_units(value_of(young_kpa, grey, density), value_of(poisson, grey, density), density);
}

}  // namespace hexmesh
