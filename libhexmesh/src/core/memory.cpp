// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/core/memory.h"

#include <fmt/format.h>
#include <omp.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <limits>

#include "hexmesh/core/error.h"

namespace hexmesh {
namespace {

/// The smallest limits leave so much [bytes]: buffers of files and heaps of threads, which nothing foresees, and room to
/// say what is lacking.
constexpr double least_room = 64e6;

double limit = std::numeric_limits<double>::infinity();       ///< as it was given [bytes]
double data_limit = std::numeric_limits<double>::infinity();  ///< of data_now() [bytes]

/// Addresses that may be written to, touched or not: what RLIMIT_DATA counts; 0 = not told here [bytes].
double data_now() {
  std::ifstream file("/proc/self/statm");  // in pages: size resident shared text lib data dt
  double size = 0, resident = 0, shared = 0, text = 0, lib = 0, data = 0;
  file >> size >> resident >> shared >> text >> lib >> data;
  return data * static_cast<double>(sysconf(_SC_PAGESIZE));
}

}  // namespace

void limit_memory(double expected, double wall) {
#pragma omp parallel  // the threads begin here: their stacks count as data, and are hardly touched
  {}
  const double at_start = data_now();
  if (at_start == 0) return;
  limit = expected;
  data_limit = at_start + std::max(least_room, expected);
  rlimit of_data{};
  if (getrlimit(RLIMIT_DATA, &of_data) != 0) return;
  of_data.rlim_cur = std::min(static_cast<rlim_t>(at_start + std::max(least_room, wall)), of_data.rlim_max);
  setrlimit(RLIMIT_DATA, &of_data);
}

double memory_left() { return std::clamp(data_limit - data_now(), 0.0, limit); }

void expect_memory(double bytes, const std::string& what) {
  constexpr double worth_asking = 1e5;
  if (bytes < worth_asking) return;
  if (const double left = memory_left(); bytes > left)
    throw Error(ErrorKind::input, fmt::format("{} takes about {:.3g} MB, expected at most {:.3g} MB, what is left of "
                                              "{:.4g} MB (--max-memory)",
                                              what, bytes / 1e6, left / 1e6, limit / 1e6));
}

std::string out_of_memory_message() {
  return fmt::format(
      "out of memory, expected a run that takes at most {:.4g} MB (--max-memory): a smaller input, or a "
      "larger limit",
      limit / 1e6);
}

}  // namespace hexmesh
