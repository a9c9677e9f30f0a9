// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <vector>

#include "hexmesh/lattice/lattice.h"

namespace hexmesh {

/// A point inside the material, and what it stands for. Weights are integrals over a part of the cell, >= 0.
struct MaterialPoint {
  Vec3 local;         ///< position in the cell, [0, 1]^3
  double volume = 0;  ///< [mm^3]
  double shear = 0;   ///< int mu dV [N mm]
  double bulk = 0;    ///< int kappa dV [N mm]
};

/// Gauss points 2x2x2 of a cell filled evenly with the given integrals, which integrate cubic polynomials exactly.
std::vector<MaterialPoint> gauss_points(double volume, double shear, double bulk);

/// Fewer of the same points with other weights, >= 0, and the same integrals of 1, mu and kappa against the 27
/// triquadratic polynomials (those of element.h), to rounding: at most 27 points, or twice and three times as many
/// where mu is not in proportion to the volume, nor kappa to mu.
/// Each step changes the weights along the null space of the moments until one is used up.
/// Source: Caratheodory's theorem; Tchernychova, Caratheodory cubature measures (thesis, Oxford 2015), for the steps.
std::vector<MaterialPoint> thinned(const std::vector<MaterialPoint>& points);

/// Forms the quadrature points of elements, for laws that are not quadratic: 2x2x2 where a cell is full of one
/// material, else the points of its children, thinned.
class QuadratureTree {
public:
  /// @param lattice  must outlive the tree; its levels' children must be there up to the levels asked for
  explicit QuadratureTree(const Lattice& lattice) : lattice_(lattice), known_(lattice.levels.size()) {}

  std::vector<MaterialPoint> form(int level, std::int32_t element);

private:
  /// The material that fills a whole element; nothing if there is none.
  std::optional<std::int32_t> only_material(int level, std::int32_t element) const;

  const Lattice& lattice_;
  std::vector<std::map<std::int32_t, std::vector<MaterialPoint>>> known_;  ///< per level
};

}  // namespace hexmesh
