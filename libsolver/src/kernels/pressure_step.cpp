// SPDX-License-Identifier: Apache-2.0
#include "kernels/pressure_step.h"

#include "kernels/choose_registers.h"
#include "kernels/registers.h"

namespace hexsolver {
namespace {

template <class Real>
struct StepOfSegments {
  using Number = Real;
  template <int width>
  [[gnu::always_inline]] static void run(std::span<const PlaceSegment> segments, const std::ptrdiff_t* rows,
                                         const Real* values, const PressureStep<Real>& step, const Real* gained,
                                         const Real* p, Real* next) {
    using L = Lanes<Real, width>;
    using Loose = typename LanesOf<Real, width>::Loose;
    const auto add_row = []<bool alike>(std::bool_constant<alike>, const Real* of, const Real* at, L* sum)
        __attribute__((always_inline)) {
      for (int i = 0; i < 3; ++i) {
        const L x = *reinterpret_cast<const Loose*>(at + i);
        if constexpr (alike)
          sum[i] += of[i] * x;
        else
          sum[i] += *reinterpret_cast<const Loose*>(of + lanes * i) * x;
      }
    };
    for (const PlaceSegment& segment : segments)
      for (int first = 0; first < lanes; first += width) {
        const Real* const at = p + segment.place + first;
        L sum[3] = {};  // that do not wait for each other
        if (segment.alike)
          for (int row = 0; row < 9; ++row)
            add_row(std::true_type{}, values + segment.values + 3 * row, at + rows[row], sum);
        else
          for (int row = 0; row < 9; ++row)
            add_row(std::false_type{}, values + segment.values + first + 3 * lanes * row, at + rows[row], sum);
        const L now = *reinterpret_cast<const Loose*>(at),
                of_gained = step.of_gained * *reinterpret_cast<const Loose*>(gained + segment.place + first);
        Loose& to = *reinterpret_cast<Loose*>(next + segment.place + first);
        to = now + step.keep * (now - to) - step.add * (now + of_gained + (sum[0] + sum[1] + sum[2]));
      }
  }
};

const auto in_doubles = for_longest_registers<StepOfSegments<double>>();
const auto in_floats = for_longest_registers<StepOfSegments<float>>();

}  // namespace

void step_pressures(std::span<const PlaceSegment> segments, const std::ptrdiff_t* rows, const double* values,
                    const PressureStep<double>& step, const double* gained, const double* p, double* next) {
  in_doubles(segments, rows, values, step, gained, p, next);
}

void step_pressures(std::span<const PlaceSegment> segments, const std::ptrdiff_t* rows, const float* values,
                    const PressureStep<float>& step, const float* gained, const float* p, float* next) {
  in_floats(segments, rows, values, step, gained, p, next);
}

}  // namespace hexsolver
