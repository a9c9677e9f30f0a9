// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace hextools {

/// How many threads a tool starts unless it is told: what OMP_NUM_THREADS says, else as many as it may run on at once,
/// by its affinity (taskset) and by the processor time that its control groups have (containers), rounded up.
int default_threads();

/// The processors' worth of time that control groups allow this process, from files of cgroup v2 and v1; 0 = no limit.
/// @param proc, sys  the folders /proc and /sys
double processors_of_control_group(const char* proc = "/proc", const char* sys = "/sys");

/// Memory that they allow [bytes]; 0 = no limit, or a number that no machine has.
double memory_of_control_group(const char* proc = "/proc", const char* sys = "/sys");

/// What this process can have: the machine's memory, or what control groups and ulimit leave of it [bytes].
double memory_of_machine();

/// Peak memory of this process [MB].
double peak_memory_mb();

}  // namespace hextools
