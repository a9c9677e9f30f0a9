// SPDX-License-Identifier: Apache-2.0
#include "machine.h"

#include <omp.h>

#include <nlohmann/json.hpp>
#include <vector>

#include "cli/json_text.h"
#include "commands.h"
#include "scene_options.h"
#include "statistics.h"

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__)
#define HEXTOOLS_CHOOSES
#endif

namespace hextools {
namespace {

constexpr int chains = 12;  // of operations that do not wait for each other; their sums stay in registers

/// `rounds` fused multiply-adds in each lane of each chain.
template <class Real, int bytes>
[[gnu::always_inline]] inline Real multiply_and_add(long rounds, Real factor) {
  typedef Real Vector __attribute__((vector_size(bytes)));  // NOLINT(modernize-use-using)
  Vector sum[chains];
  for (int n = 0; n < chains; ++n) sum[n] = static_cast<Real>(n) - Vector{};
  const Vector by = factor - Vector{}, plus = Real(1) - factor - Vector{};
  for (long r = 0; r < rounds; ++r)
    for (int n = 0; n < chains; ++n) sum[n] = sum[n] * by + plus;
  Real all = 0;
  for (int n = 0; n < chains; ++n) all += sum[n][0];
  return all;
}

#ifdef HEXTOOLS_CHOOSES
#define HEXTOOLS_WIDE(bytes, architecture)                                                                \
  template <class Real>                                                                                   \
  __attribute__((target("arch=" architecture))) Real multiply_and_add_##bytes(long rounds, Real factor) { \
    return multiply_and_add<Real, bytes>(rounds, factor);                                                 \
  }
HEXTOOLS_WIDE(64, "x86-64-v4")
HEXTOOLS_WIDE(32, "x86-64-v3")
#undef HEXTOOLS_WIDE
#endif

/// How many bytes a register has.
int register_bytes() {
#ifdef HEXTOOLS_CHOOSES
  if (__builtin_cpu_supports("x86-64-v4")) return 64;
  if (__builtin_cpu_supports("x86-64-v3")) return 32;
#endif
  return 16;
}

template <class Real>
Real run_chains(long rounds, Real factor) {
#ifdef HEXTOOLS_CHOOSES
  if (register_bytes() == 64) return multiply_and_add_64(rounds, factor);
  if (register_bytes() == 32) return multiply_and_add_32(rounds, factor);
#endif
  return multiply_and_add<Real, 16>(rounds, factor);
}

template <class Real>
double peak_flops(int repeats, int threads) {
  constexpr long rounds = 20'000'000;
  const double lanes = double(register_bytes()) / sizeof(Real);
  Real sum = 0;
  const double seconds = median_seconds_of(repeats, [&] {
#pragma omp parallel num_threads(threads) reduction(+ : sum)
    sum += run_chains(rounds, Real(0.999));
  });
  volatile Real kept = sum;  // or nothing would be computed
  static_cast<void>(kept);
  return 2.0 * lanes * chains * rounds * threads / seconds;
}

void triad(const double* b, const double* c, double* a, std::ptrdiff_t first, std::ptrdiff_t last) {
  for (std::ptrdiff_t n = first; n < last; ++n) a[n] = b[n] + 3.0 * c[n];
}

double triad_bandwidth(int repeats) {
  constexpr std::ptrdiff_t size = std::ptrdiff_t{1} << 25;  // 256 MB each
  std::vector<double> a(size), b(size), c(size);
  double *of_b = b.data(), *of_c = c.data();
#pragma omp parallel for schedule(static)
  for (std::ptrdiff_t n = 0; n < size; ++n) of_b[n] = of_c[n] = 1;
  const double seconds = median_seconds_of(repeats, [&] {
#pragma omp parallel
    {
      const std::ptrdiff_t part = size / omp_get_num_threads(), first = omp_get_thread_num() * part;
      triad(b.data(), c.data(), a.data(), first, first + part);
    }
  });
  return 24.0 * static_cast<double>(size) / seconds;
}

}  // namespace

MachineLimits measure_machine(int repeats) {
  const int threads = omp_get_max_threads();
  return {triad_bandwidth(repeats), peak_flops<double>(repeats, threads), peak_flops<float>(repeats, threads)};
}

double double_flops_of_a_thread() { return peak_flops<double>(5, 1); }

std::function<int()> declare_machine(CLI::App& app, const CommonOptions& common, const Console& /*console*/) {
  const auto o = std::make_shared<SceneOptions>();
  add_repeats(app, o->repeats);
  add_report(app, o->output);
  return [o, &common] {
    RunFiles files(common);
    Output& output = files.output(o->output, Content::text);
    const MachineLimits limits = measure_machine(o->repeats);
    const nlohmann::json report = {{"threads", omp_get_max_threads()},
                                   {"triad_gb_s", limits.triad / 1e9},
                                   {"double_gflops", limits.double_flops / 1e9},
                                   {"single_gflops", limits.single_flops / 1e9}};
    output.write(json_text(report));
    files.commit();
    return 0;
  };
}

}  // namespace hextools
