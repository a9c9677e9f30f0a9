// SPDX-License-Identifier: Apache-2.0
#include "kernels/alike_product.h"

#include "kernels/choose_registers.h"
#include "kernels/gather.h"
#include "kernels/multiply_lanes.h"

namespace hexsolver {
namespace {

template <class Real>
struct AlikeProduct {
  using Number = Real;
  template <int width>
  [[gnu::always_inline]] static void run(const AlikeMatrix<Real>& k, const BatchNodes& nodes, const Real* x, Real* y) {
    alignas(64) Real values[24 * lanes], sums[24 * lanes];
    gather<width>(nodes, x, values);
    for (int first = 0; first < lanes; first += width) {
      const LaneView<width, Real> of_lanes{values + first}, products{sums + first};
      multiply_alike(k, of_lanes, products);
    }
    scatter_add<width>(nodes, sums, y);
  }
};

const auto in_doubles = for_longest_registers<AlikeProduct<double>>();
const auto in_floats = for_longest_registers<AlikeProduct<float>>();

}  // namespace

void add_alike_product(const AlikeMatrix<double>& k, const BatchNodes& nodes, const double* x, double* y) {
  in_doubles(k, nodes, x, y);
}
void add_alike_product(const AlikeMatrix<float>& k, const BatchNodes& nodes, const float* x, float* y) {
  in_floats(k, nodes, x, y);
}

}  // namespace hexsolver
