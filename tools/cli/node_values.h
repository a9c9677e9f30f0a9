// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>

namespace hextools {

/// A vector of the solver as libhexmesh takes it: (x, y, z) of node 0, of node 1, ...
inline std::span<const double> values_of(const Eigen::VectorXd& nodal) {
  return {nodal.data(), static_cast<std::size_t>(nodal.size())};
}

}  // namespace hextools
