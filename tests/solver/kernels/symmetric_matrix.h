// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "support/bodies.h"

namespace testing_support {

/// A random symmetric matrix of a cell, the same for the same seed.
inline hexsolver::CellMatrix symmetric(unsigned seed) {
  const hexsolver::NodeVector numbers = noise(576, 1, seed);
  const Eigen::Map<const hexsolver::CellMatrix> m(numbers.data());
  return m + m.transpose();
}

}  // namespace testing_support
