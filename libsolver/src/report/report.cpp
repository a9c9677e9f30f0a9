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

BalanceReport::Row BalanceReport::sum() const {
  Row sum{"sum"};
  for (const Row& row : acting) {
    sum.force_n += row.force_n;
    sum.moment_n_mm += row.moment_n_mm;
  }
  return sum;
}

}  // namespace hexsolver
