// SPDX-License-Identifier: Apache-2.0
#include "hexsolver/report/report.h"

namespace hexsolver {

NewtonSeconds& NewtonSeconds::operator+=(const NewtonSeconds& other) {
  forces += other.forces;
  linearize += other.linearize;
  set_up += other.set_up;
  cycles += other.cycles;
  products += other.products;
  return *this;
}

}  // namespace hexsolver
