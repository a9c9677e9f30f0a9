// SPDX-License-Identifier: Apache-2.0
#include "motions.h"

#include <algorithm>
#include <cmath>

namespace stability {

using namespace hexsolver;

Scene starved(Rotation rotation, int iterations, double step) {
  Scene scene;
  scene.rotation = rotation;
  Dynamics d;
  d.step = step;
  d.duration = 1000 * step;
  d.solver = StepSolver::cg;
  d.solver_iterations = iterations;
  d.newton_iterations = 1;
  scene.dynamics = d;
  return scene;
}

void Run::append(const Run& next) {
  finished = next.finished;
  reason = next.reason;
  largest_gain = std::max(largest_gain, next.largest_gain);
  time.insert(time.end(), next.time.begin(), next.time.end());
  energy.insert(energy.end(), next.energy.begin(), next.energy.end());
}

Run run(Motion& motion, int steps) {
  Run out;
  const auto keep = [&] {
    out.time.push_back(motion.time());
    out.energy.push_back(motion.energies().total());
  };
  keep();
  double before = out.energy[0], work = motion.work() + motion.work_uncertainty(), largest = std::abs(before);
  for (int n = 0; n < steps; ++n) {
    if (!motion.step()) {
      out.finished = false;
      out.reason = motion.reason();
      break;
    }
    if (!motion.displacement().allFinite() || !motion.velocity().allFinite()) {
      out.finished = false;
      out.reason = "not finite";
      break;
    }
    keep();
    const double now = out.energy.back(), given = motion.work() + motion.work_uncertainty() - work;
    largest = std::max({largest, std::abs(now), motion.energies().kinetic + motion.energies().strain});
    if (largest > 0) out.largest_gain = std::max(out.largest_gain, (now - before - std::max(given, 0.0)) / largest);
    before = now;
    work = motion.work() + motion.work_uncertainty();
  }
  return out;
}

}  // namespace stability
