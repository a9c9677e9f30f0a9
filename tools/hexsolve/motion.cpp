// SPDX-License-Identifier: Apache-2.0
#include "motion.h"

#include <fmt/format.h>

#include "cli/node_values.h"
#include "hexmesh/core/error.h"
#include "hexmesh/file/result_file.h"
#include "motion_stream.h"
#include "steering.h"

namespace hextools {

hexsolver::Outcome solve_motion(const hexmesh::Lattice& lattice, const hexsolver::Scene& scene, int level, MotionIo& io,
                                const Interruption& interruption, const Console& console) {
  const auto is_interrupted = [&] { return interruption.signal() != 0; };
  std::optional<Steering> steering;
  if (!io.steer.empty()) steering.emplace(io.steer, lattice.surface.points.size(), console, is_interrupted);
  std::optional<MotionStream> stream;
  // A reader that leaves ends the stream; where there is a file to write, not the motion, unless it was a viewer who
  // steered it.
  const auto to_stream = [&](double time, auto&& write) {
    try {
      write();
    } catch (const hexmesh::Error& e) {
      if (!io.writer || e.kind() != hexmesh::ErrorKind::output) throw;
      console.warning(fmt::format("{} at {:.4g} s: the motion {}", e.what(), time,
                                  steering ? "ends there" : "goes on to its file"));
      stream.reset();
      if (steering) steering->end();
    }
  };
  if (io.streamed) stream.emplace(lattice, *io.streamed);
  const auto on_output = [&](const hexsolver::Motion& motion) {
    if (io.writer) io.writer->add_step(motion.time(), motion.state());
    if (stream && motion.counts().steps == 0) to_stream(0, [&] { stream->add(motion); });
  };
  const auto on_step = [&](const hexsolver::Motion& motion) {
    if (stream) to_stream(motion.time(), [&] { stream->add(motion); });
    const double duration = scene.dynamics->duration;
    console.progress(fmt::format("{:.4g} of {:.4g} s, kinetic energy {:.3g} N mm", motion.time(), duration,
                                 motion.energies().kinetic),
                     motion.time() / duration);
  };
  const auto next_step = [&](hexsolver::Motion& motion) {
    if (is_interrupted()) return hexsolver::NextStep::interrupt;
    return steering ? steering->next_step(motion) : hexsolver::NextStep::take;
  };
  hexsolver::Outcome outcome = hexsolver::solve_dynamics(lattice, scene, level, on_output, on_step, next_step);
  if (steering) io.record = steering->record();
  return outcome;
}

}  // namespace hextools
