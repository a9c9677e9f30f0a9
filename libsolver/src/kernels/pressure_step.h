// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "mesh/mesh.h"

namespace hexsolver {

/// Eight places in a row, for cells or for nothing, and what of a matrix between cells that share a node belongs to
/// them.
struct PlaceSegment {
  static constexpr std::size_t lanes = Mesh::batch_size;
  std::int32_t place = 0;  ///< the first
  bool alike = false;      ///< all eight have the same entries
  std::size_t values = 0;  ///< where the entries begin, shape (27, 8), or (27) where they are alike
};

/// One step of an iteration for pressures.
template <class Real>
struct PressureStep {
  Real of_gained, keep, add;
};

/// next <- p + keep (p - next) - add (p + of_gained gained + S p) at the places of segments, S with `values`.
/// @param rows  shape (9): from a place, where the rows of three around it begin
void step_pressures(std::span<const PlaceSegment> segments, const std::ptrdiff_t* rows, const double* values,
                    const PressureStep<double>& step, const double* gained, const double* p, double* next);
void step_pressures(std::span<const PlaceSegment> segments, const std::ptrdiff_t* rows, const float* values,
                    const PressureStep<float>& step, const float* gained, const float* p, float* next);

}  // namespace hexsolver
