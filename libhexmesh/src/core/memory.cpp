// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/core/memory.h"

#include <fmt/format.h>
#include <malloc.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <limits>
#include <memory>
#include <new>
#include <string_view>
#include <system_error>

#include "hexmesh/core/error.h"

namespace hexmesh {
namespace {

/// Beside the limit: buffers of files and heaps of threads, which nothing foresees, and room to say what is lacking.
constexpr double room_beside = 64e6, part_beside = 0.25;
/// ITK, VTK and TBB have threads of their own.
constexpr double stacks_of_libraries = 3, bytes_of_stack = 8e6;

double limit = std::numeric_limits<double>::infinity();         ///< as it was given [bytes]
double data_limit = std::numeric_limits<double>::infinity();    ///< of data_now() [bytes]
double most_in_heap = std::numeric_limits<double>::infinity();  ///< that may be taken before it is needed [bytes]
std::string name_of_limit;
std::string message = "out of memory, expected a machine with more or a smaller input";

/// What malloc() has and has not handed out [bytes].
double free_in_heap() {
#if defined(__GLIBC__) && __GLIBC_PREREQ(2, 33)
  return static_cast<double>(mallinfo2().fordblks);
#else
  return 0;
#endif
}

/// Addresses that may be written to, touched or not: what RLIMIT_DATA counts, less what malloc() has free; 0 = not told
/// here [bytes].
double data_now() {
  std::ifstream file("/proc/self/statm");  // in pages: size resident shared text lib data dt
  double size = 0, resident = 0, shared = 0, text = 0, lib = 0, data = 0;
  file >> size >> resident >> shared >> text >> lib >> data;
  return std::max(0.0, data * static_cast<double>(sysconf(_SC_PAGESIZE)) - free_in_heap());
}

}  // namespace

void limit_memory(double bytes, double wall, const std::string& name) {
  std::atomic<int> threads = 0;
#pragma omp parallel if (std::isfinite(wall))  // they begin here: their stacks count as data, and are hardly touched
  ++threads;
  const double at_start = data_now();
  if (at_start == 0) return;
  limit = bytes;
  name_of_limit = name;
  message =
      fmt::format("out of memory, expected a run that takes at most {:.4g} MB ({}): a smaller input, or more memory",
                  limit / 1e6, name);
  data_limit = at_start + std::max(room_beside, bytes);
  if (wall == 0) wall = (1 + part_beside) * bytes;
  most_in_heap = wall;
  const double most = at_start + wall + room_beside + stacks_of_libraries * bytes_of_stack * threads;
  rlimit of_data{};
  if (getrlimit(RLIMIT_DATA, &of_data) != 0 || !(most < static_cast<double>(of_data.rlim_cur))) return;
  of_data.rlim_cur = static_cast<rlim_t>(most);
  setrlimit(RLIMIT_DATA, &of_data);
}

void use_large_pages() {
#if defined(__GLIBC__) && defined(MADV_HUGEPAGE)
  int overcommit = 0;
  constexpr int never = 2;  // what is asked for counts as taken, see proc_sys_vm(5)
  if (std::ifstream("/proc/sys/vm/overcommit_memory") >> overcommit; overcommit == never) return;
  constexpr double most = 2e9;
  constexpr int usual_pad = 128 << 10;
  constexpr std::size_t more_than_is_left = 1 << 20;
  mallopt(M_MMAP_MAX, 0);
  mallopt(M_TRIM_THRESHOLD, -1);
  mallopt(M_TOP_PAD, static_cast<int>(std::min(most, most_in_heap)));
  void* begin = sbrk(0);
  void* volatile block = std::malloc(more_than_is_left);  // which no compiler leaves out
  std::free(block);
  mallopt(M_TOP_PAD, usual_pad);
  constexpr std::size_t large = 1 << 21;
  auto bytes = static_cast<std::size_t>(static_cast<char*>(sbrk(0)) - static_cast<char*>(begin));
  if (std::align(large, large, begin, bytes)) madvise(begin, bytes, MADV_HUGEPAGE);
#endif
}

double memory_left() { return std::clamp(data_limit - data_now(), 0.0, limit); }

void expect_memory(std::size_t bytes, const std::string& what) {
  constexpr std::size_t worth_asking = 100'000;
  if (bytes < worth_asking) return;
  const auto asked = static_cast<double>(bytes);
  if (const double left = memory_left(); asked > left)
    throw Error(ErrorKind::input, fmt::format("{} takes about {:.3g} MB, expected at most {:.3g} MB, what is left of "
                                              "{:.4g} MB ({})",
                                              what, asked / 1e6, left / 1e6, limit / 1e6, name_of_limit));
}

const std::string& name_of_memory_limit() { return name_of_limit; }

const std::string& out_of_memory_message() { return message; }

bool is_out_of_memory(const std::exception& e) {
  if (dynamic_cast<const std::bad_alloc*>(&e)) return true;
  if (const auto* error = dynamic_cast<const std::system_error*>(&e))
    return error->code() == std::errc::resource_unavailable_try_again || error->code() == std::errc::not_enough_memory;
  const std::string_view what = e.what();
  const auto says = [&](const char* words) { return what.find(words) != std::string_view::npos; };
  return says("Failed to allocate memory") || says("pthread_create") || says("Unable to create a thread");
}

}  // namespace hexmesh
