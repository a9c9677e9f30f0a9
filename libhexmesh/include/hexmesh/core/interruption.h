// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>

namespace hexmesh {

/// While it lives, what takes long in this thread calls `check` now and then: a solution before every linear iteration,
/// the making of a lattice between its levels. What that throws ends the call, of which nothing is left. For programs
/// that others can interrupt.
class Interruptible {
public:
  explicit Interruptible(std::function<void()> check);
  ~Interruptible();
  Interruptible(const Interruptible&) = delete;
  Interruptible& operator=(const Interruptible&) = delete;

private:
  std::function<void()> check_;
  const std::function<void()>* before_;
};

/// A place where a call can end; see Interruptible. @pre not inside a parallel region
void interruption_point();

}  // namespace hexmesh
