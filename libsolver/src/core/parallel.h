// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

namespace hexsolver {

/// Vectors shorter than this take less time than the threads to wake up.
inline constexpr Eigen::Index worth_threads = 20000;

/// f(n) for n in [0, size), in parallel: passes over long vectors.
template <class F>
void parallel_for(Eigen::Index size, F&& f) {
#pragma omp parallel for simd schedule(static) if (size >= worth_threads)
  for (Eigen::Index n = 0; n < size; ++n) f(n);
}

/// f(n) for each of `count` nodes, in parallel.
template <class F>
void for_each_node(std::ptrdiff_t count, F&& f) {
#pragma omp parallel for schedule(static) if (3 * count >= worth_threads)
  for (std::ptrdiff_t n = 0; n < count; ++n) f(n);
}

template <class Vector>
void set_zero(Vector& v, Eigen::Index size) {
  v.resize(size);
  auto* data = v.data();
  parallel_for(size, [=](Eigen::Index n) { data[n] = 0; });
}

}  // namespace hexsolver
