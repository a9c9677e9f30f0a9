// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

namespace hexsolver {

/// f(n) for n in [0, size), in parallel: passes over long vectors.
template <class F>
void parallel_for(Eigen::Index size, F&& f) {
#pragma omp parallel for simd schedule(static)
  for (Eigen::Index n = 0; n < size; ++n) f(n);
}

template <class Vector>
void set_zero(Vector& v, Eigen::Index size) {
  v.resize(size);
  auto* data = v.data();
  parallel_for(size, [=](Eigen::Index n) { data[n] = 0; });
}

}  // namespace hexsolver
