// SPDX-License-Identifier: Apache-2.0
#include "motions.h"

#include <algorithm>
#include <cmath>

#include "record.h"

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
  if (finished) reason = next.reason;
  finished = finished && next.finished;
  largest_gain = worst(largest_gain, next.largest_gain);
  time.insert(time.end(), next.time.begin(), next.time.end());
  energy.insert(energy.end(), next.energy.begin(), next.energy.end());
}

Run run(Motion& motion, int steps, int keep_every) {
  Run out;
  const auto keep = [&] {
    out.time.push_back(motion.time());
    out.energy.push_back(motion.energies().total());
  };
  out.time.reserve(static_cast<std::size_t>(steps / keep_every + 1));
  out.energy.reserve(out.time.capacity());
  keep();
  double before = out.energy[0], work = motion.work() + motion.work_uncertainty(), largest = std::abs(before);
  for (int n = 0; n < steps; ++n) {
    if (!motion.step()) {
      out.finished = false;
      out.reason = motion.reason();
      break;
    }
    if (!motion.displacement().allFinite() || !motion.velocity().allFinite() ||
        !std::isfinite(motion.energies().total())) {
      out.finished = false;
      out.reason = "not finite";
      break;
    }
    if ((n + 1) % keep_every == 0) keep();
    const double now = motion.energies().total(), given = motion.work() + motion.work_uncertainty() - work;
    largest = std::max({largest, std::abs(now), motion.energies().kinetic + motion.energies().strain});
    if (largest > 0) out.largest_gain = worst(out.largest_gain, (now - before - std::max(given, 0.0)) / largest);
    before = now;
    work = motion.work() + motion.work_uncertainty();
  }
  return out;
}

}  // namespace stability
