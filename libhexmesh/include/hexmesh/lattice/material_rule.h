// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "hexmesh/lattice/material.h"
#include "hexmesh/volume/intensity_volume.h"

namespace hexmesh {

/// A quantity that follows from the scan voxel by voxel. x = grey value, or the density found before.
struct GreyLaw {
  enum class Shape {
    linear,    ///< offset + slope x
    power,     ///< offset + factor max(x, 0)^exponent
    piecewise  ///< straight between the points, constant beyond the first and the last
  };
  Shape shape = Shape::linear;
  bool of_density = false;  ///< x = density [kg/m^3] instead of the grey value
  double offset = 0;
  double factor = 0;  ///< or slope
  double exponent = 1;
  std::vector<std::pair<double, double>> points;  ///< (x, value), ascending by x
  std::optional<double> min, max;                 ///< the value is clamped to these

  double operator()(double x) const;
};

/// A number, the same in every voxel, or a law.
using Quantity = std::variant<double, GreyLaw>;

/// What a segment is made of, in the users' units.
struct MaterialRule {
  Quantity young_kpa, poisson, density_kg_m3;

  bool varies() const;
  /// The material of a voxel. @param grey  its grey value; not looked at by numbers
  Material at(double grey) const;
};

/// Materials that follow the grey values of a scan.
struct GreyMaterials {
  const IntensityVolume* intensity = nullptr;
  std::map<std::uint16_t, MaterialRule> rules;  ///< by label
};

/// What a segment is made of, as asked by the user; without a value the named tissue's is taken.
struct MaterialChoice {
  bool none = false;   ///< the segment only serves boundary conditions
  std::string tissue;  ///< of known_tissues(); empty: told by the segment's name
  std::optional<Quantity> young_kpa, poisson, density_kg_m3;
};

}  // namespace hexmesh
