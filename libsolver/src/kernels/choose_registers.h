// SPDX-License-Identifier: Apache-2.0
#pragma once

// The one place that chooses registers. A kernel is compiled for registers of every length, and the longest that the
// machine has is taken when the program is loaded; sanitizers run before that can happen.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__)
#define HEXSOLVER_CHOOSES
/// Before a function: one clone for each machine, for loops that the compiler makes vectors of by itself.
#define HEXSOLVER_CLONES __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default")))
#else
#define HEXSOLVER_CLONES
#endif

namespace hexsolver {

/// Kernel::run<width>(arguments...), always inlined, compiled for registers of each length; width = numbers in one.
template <class Kernel, class Result, class... Arguments>
struct InRegisters {
  using Function = Result (*)(Arguments...);
  using Real = typename Kernel::Number;

  static Result of_16_bytes(Arguments... arguments) { return Kernel::template run<16 / sizeof(Real)>(arguments...); }
#ifdef HEXSOLVER_CHOOSES
  __attribute__((target("arch=x86-64-v3"))) static Result of_32_bytes(Arguments... arguments) {
    return Kernel::template run<32 / sizeof(Real)>(arguments...);
  }
  /// Of a batch of doubles; a batch of floats takes half of them, of which there are twice as many as of the above.
  __attribute__((target("arch=x86-64-v4"))) static Result of_64_bytes(Arguments... arguments) {
    return Kernel::template run<8>(arguments...);
  }
#endif

  static Function longest() {
#ifdef HEXSOLVER_CHOOSES
    if (__builtin_cpu_supports("x86-64-v4")) return of_64_bytes;
    if (__builtin_cpu_supports("x86-64-v3")) return of_32_bytes;
#endif
    return of_16_bytes;
  }
};

template <class Kernel, class Result, class... Arguments>
InRegisters<Kernel, Result, Arguments...> in_registers(Result (*)(Arguments...));

/// The function Kernel::run for the longest registers of the machine.
/// @tparam Kernel  has Number, float or double, and a static template <int width> run(...)
template <class Kernel>
auto for_longest_registers() {
  return decltype(in_registers<Kernel>(&Kernel::template run<1>))::longest();
}

}  // namespace hexsolver
