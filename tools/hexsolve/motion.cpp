// SPDX-License-Identifier: Apache-2.0
#include "motion.h"

#include <fmt/format.h>

#include "cli/node_values.h"
#include "hexmesh/core/error.h"
#include "hexmesh/file/result_file.h"
#include "surface_stream.h"

namespace hextools {

hexsolver::Outcome solve_motion(const hexmesh::Lattice& lattice, const hexsolver::Scene& scene, int level,
                                hexmesh::ResultWriter* writer, bool streams, const Interruption& interruption,
                                const Console& console) {
  std::optional<SurfaceStream> stream;
  // A reader that leaves ends the stream; where there is a file to write, not the motion.
  const auto to_stream = [&](double time, auto&& write) {
    try {
      write();
    } catch (const hexmesh::Error& e) {
      if (!writer || e.kind() != hexmesh::ErrorKind::output) throw;
      console.warning(fmt::format("{} at {:.4g} s: the motion goes on to its file", e.what(), time));
      stream.reset();
    }
  };
  if (streams) to_stream(0, [&] { stream.emplace(lattice); });
  const auto on_output = [&](const hexsolver::Motion& motion) {
    if (writer) writer->add_step(motion.time(), motion.state());
    if (stream && motion.counts().steps == 0) to_stream(0, [&] { stream->add(motion); });
  };
  const auto on_step = [&](const hexsolver::Motion& motion) {
    if (stream) to_stream(motion.time(), [&] { stream->add(motion); });
    const double duration = scene.dynamics->duration;
    console.progress(fmt::format("{:.4g} of {:.4g} s, kinetic energy {:.3g} N mm", motion.time(), duration,
                                 motion.energies().kinetic),
                     motion.time() / duration);
  };
  return hexsolver::solve_dynamics(lattice, scene, level, on_output, on_step,
                                   [&] { return interruption.signal() == 0; });
}

}  // namespace hextools
