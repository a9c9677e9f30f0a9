// SPDX-License-Identifier: Apache-2.0
#include "statics.h"

#include "record.h"

namespace stability {

using namespace hexsolver;
using namespace testing_support;

Descent descend(const Lattice& lattice, Body& body, const std::vector<ConstraintPoint>& held, const NodeVector& start,
                int max_iterations, double tolerance) {
  const Hierarchy hierarchy(body.mesh, lattice.corner());
  const Constraints constraints(body.mesh, held);
  Descent out;
  out.u = start;
  out.start_energy = body.potential.energy(start);
  NewtonOptions options;
  options.max_iterations = max_iterations;
  options.tolerance = tolerance;
  options.estimate_error = false;
  double before = -1, largest = out.start_energy;
  out.report = minimize(hierarchy, body.potential, constraints, options, out.u, [&](int, double, int) {
    const double now = body.potential.energy(out.u);
    largest = std::max(largest, now);
    if (before >= 0) out.largest_rise = worst(out.largest_rise, (now - before) / largest);
    before = now;
  });
  out.end_energy = body.potential.energy(out.u);
  return out;
}

}  // namespace stability
