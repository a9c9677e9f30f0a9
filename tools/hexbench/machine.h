// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace hextools {

/// What the machine can do at most, with the threads of OpenMP: what speeds are held against.
struct MachineLimits {
  double triad = 0;         ///< a = b + s c over arrays larger than the caches, 24 bytes an entry [bytes/s]
  double double_flops = 0;  ///< fused multiply-adds in registers, two operations each [1/s]
  double single_flops = 0;  ///< likewise, in single precision [1/s]
};
MachineLimits measure_machine(int repeats);

double double_flops_of_a_thread();  ///< as double_flops, of one thread

}  // namespace hextools
