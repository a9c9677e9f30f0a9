// SPDX-License-Identifier: Apache-2.0
#include "cli/machine.h"

#include <omp.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

namespace hextools {
namespace {

/// Of one group; 0 = no limit.
using LimitIn = double (*)(const std::filesystem::path& group);

/// Quota over period.
double processors_in(const std::filesystem::path& group) {
  std::string quota;
  double period = 0;
  if (std::ifstream both(group / "cpu.max"); both >> quota >> period)  // version 2: "max 100000" or "50000 100000"
    return period > 0 ? std::max(0, std::atoi(quota.c_str())) / period : 0;
  double of_quota = 0;
  std::ifstream first(group / "cpu.cfs_quota_us"), second(group / "cpu.cfs_period_us");  // version 1: -1 for no limit
  return first >> of_quota && second >> period && of_quota > 0 && period > 0 ? of_quota / period : 0;
}

double memory_in(const std::filesystem::path& group) {
  double bytes = 0;
  if (std::ifstream file(group / "memory.max"); file >> bytes) return std::max(0.0, bytes);  // version 2: not "max"
  std::ifstream file(group / "memory.limit_in_bytes");  // version 1: huge for no limit
  return file >> bytes ? std::max(0.0, bytes) : 0;
}

/// The limits of all groups around count. In a container the path may not be there, but the root is the group.
double tightest_limit(const char* proc, const char* sys, const std::string& controller, LimitIn limit_in) {
  namespace fs = std::filesystem;
  double least = 0;
  std::ifstream groups(fs::path(proc) / "self/cgroup");
  for (std::string line; std::getline(groups, line);) {  // "0::/path" or "4:cpu,cpuacct:/path"
    std::istringstream fields(line);
    std::string number, controllers, path;
    std::getline(fields, number, ':');
    std::getline(fields, controllers, ':');
    std::getline(fields, path);
    const bool is_unified = controllers.empty();
    if (!is_unified && ("," + controllers + ",").find("," + controller + ",") == std::string::npos) continue;
    const fs::path root = fs::path(sys) / "fs/cgroup" / (is_unified ? "" : controllers);
    for (fs::path group = fs::path(path).relative_path();; group = group.parent_path()) {
      const double limit = limit_in(root / group);
      if (limit > 0 && (least == 0 || limit < least)) least = limit;
      if (group.empty()) break;
    }
  }
  return least;
}

}  // namespace

double processors_of_control_group(const char* proc, const char* sys) {
  return tightest_limit(proc, sys, "cpu", processors_in);
}

double memory_of_control_group(const char* proc, const char* sys) {
  return tightest_limit(proc, sys, "memory", memory_in);
}

double memory_of_machine() {
  double most = static_cast<double>(sysconf(_SC_PHYS_PAGES)) * static_cast<double>(sysconf(_SC_PAGESIZE));
  if (const double allowed = memory_of_control_group(); allowed > 0) most = std::min(most, allowed);
  for (const auto resource : {RLIMIT_DATA, RLIMIT_AS})  // as ulimit sets them
    if (rlimit of{}; getrlimit(resource, &of) == 0) most = std::min(most, static_cast<double>(of.rlim_cur));
  return most;
}

int default_threads() {
  const int most = omp_get_max_threads();
  const double allowed = std::getenv("OMP_NUM_THREADS") ? 0 : processors_of_control_group();
  return allowed > 0 ? std::clamp(static_cast<int>(std::ceil(allowed)), 1, most) : most;
}

double peak_memory_mb() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024;
}

}  // namespace hextools
