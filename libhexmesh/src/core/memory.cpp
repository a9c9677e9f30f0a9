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

/// What is left by the smallest wall, so that a run can say what it lacks.
constexpr double least_room = 16e6;

double limit = std::numeric_limits<double>::infinity();       ///< as it was given [bytes]
double data_limit = std::numeric_limits<double>::infinity();  ///< of Held::data

struct Held {
  double resident = 0;  ///< pages in memory, those of files mapped included [bytes]
  double data = 0;      ///< addresses that may be written to, touched or not: what RLIMIT_DATA counts [bytes]
};

Held held_now() {
  std::ifstream file("/proc/self/statm");  // in pages: size resident shared text lib data dt
  double size = 0, resident = 0, shared = 0, text = 0, lib = 0, data = 0;
  file >> size >> resident >> shared >> text >> lib >> data;
  const auto page = static_cast<double>(sysconf(_SC_PAGESIZE));
  return {resident * page, data * page};
}

}  // namespace

void limit_memory(double expected, double wall) {
#pragma omp parallel  // the threads begin here: their stacks count as data, and are hardly touched
  {}
  const Held now = held_now();
  if (now.data == 0) return;  // not told here
  limit = expected;
  const auto data_of = [&](double bytes, double least) { return now.data + std::max(least, bytes - now.resident); };
  data_limit = data_of(expected, 0);
  rlimit of_data{};
  if (getrlimit(RLIMIT_DATA, &of_data) != 0) return;
  of_data.rlim_cur = std::min(static_cast<rlim_t>(data_of(wall, least_room)), of_data.rlim_max);
  setrlimit(RLIMIT_DATA, &of_data);
}

double memory_left() { return std::max(0.0, data_limit - held_now().data); }

void expect_memory(double bytes, const std::string& what) {
  constexpr double worth_asking = 1e5;
  if (bytes < worth_asking) return;
  if (const double left = memory_left(); bytes > left)
    throw Error(ErrorKind::input,
                fmt::format("{} takes about {:.3g} MB, expected at most {:.3g} MB, what is left of {:.4g} MB "
                            "(--max-memory)",
                            what, bytes / 1e6, left / 1e6, limit / 1e6));
}

std::string out_of_memory_message() {
  return fmt::format(
      "out of memory, expected a run that takes at most {:.4g} MB (--max-memory): a smaller input, or a "
      "larger limit",
      limit / 1e6);
}

}  // namespace hexmesh
