// SPDX-License-Identifier: Apache-2.0
#include "kernels/span_product.h"

#include "kernels/choose_registers.h"
#include "kernels/registers.h"

namespace hexsolver {
namespace {

template <class Real, int columns>
struct PartInSpan {
  using Number = Real;
  template <int width>
  [[gnu::always_inline]] static void run(const Span<Real>& span, const Real* v, Real* part) {
    using Loose = typename LanesOf<Real, width>::Loose;
    using L = Lanes<Real, width>;
    constexpr std::size_t at_once = Span<Real>::at_once;
    const std::size_t steps = span.rows / width;  // registers of a column
    const Loose* of_v = reinterpret_cast<const Loose*>(v);
    Loose* sums = reinterpret_cast<Loose*>(part);
    for (std::size_t n = 0; n < columns * steps; ++n) sums[n] = Loose{};
    for (std::size_t first = 0; first < span.count; first += at_once) {
      const Loose* directions = reinterpret_cast<const Loose*>(span.values.data() + first * span.rows);
      L products[at_once][columns] = {};
      for (std::size_t n = 0; n < steps; ++n)
        for (std::size_t d = 0; d < at_once; ++d)
          for (std::size_t a = 0; a < columns; ++a) products[d][a] += directions[d * steps + n] * of_v[a * steps + n];
      Real along[at_once][columns] = {};
      for (std::size_t d = 0; d < at_once; ++d)
        for (std::size_t a = 0; a < columns; ++a)
          for (int lane = 0; lane < width; ++lane) along[d][a] += products[d][a][lane];
      for (std::size_t n = 0; n < steps; ++n)
        for (std::size_t a = 0; a < columns; ++a) {
          L sum = sums[a * steps + n];
          for (std::size_t d = 0; d < at_once; ++d) sum += along[d][a] * directions[d * steps + n];
          sums[a * steps + n] = sum;
        }
    }
  }
};

template <class Real>
using Function = void (*)(const Span<Real>&, const Real*, Real*);
template <class Real>
const Function<Real> of_columns[3] = {for_longest_registers<PartInSpan<Real, 1>>(),
                                      for_longest_registers<PartInSpan<Real, 2>>(),
                                      for_longest_registers<PartInSpan<Real, 3>>()};

}  // namespace

void part_in_span(const Span<double>& span, int columns, const double* v, double* part) {
  of_columns<double>[columns - 1](span, v, part);
}

void part_in_span(const Span<float>& span, int columns, const float* v, float* part) {
  of_columns<float>[columns - 1](span, v, part);
}

}  // namespace hexsolver
