// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/core/interruption.h"

#include <utility>

namespace hexmesh {
namespace {

thread_local const std::function<void()>* check_of_thread = nullptr;

}  // namespace

Interruptible::Interruptible(std::function<void()> check)
    : check_(std::move(check)), before_(std::exchange(check_of_thread, &check_)) {}

Interruptible::~Interruptible() { check_of_thread = before_; }

void interruption_point() {
  if (check_of_thread && *check_of_thread) (*check_of_thread)();
}

}  // namespace hexmesh
