// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "hexmesh/lattice/embedded_points.h"
#include "hexsolver/dynamics/motion.h"

namespace hextools {

/// What of a motion is streamed: the picture surface, or the nodes that results have.
enum class Streamed { surface, nodes };

/// A motion on standard output, step by step: "Stream" in FORMATS.md.
class MotionStream {
public:
  MotionStream(const hexmesh::Lattice& lattice, Streamed what);

  /// Writes the state as it is now, the first time after the head. @throws Error{output}
  void add(const hexsolver::Motion& motion);

private:
  void write_head(const hexsolver::Motion& motion);

  const hexmesh::Lattice& lattice_;
  Streamed what_;
  bool has_begun_ = false;
  std::optional<hexmesh::EmbeddedPoints> embedded_;
  std::vector<hexmesh::Vec3> moved_;
  std::vector<float> values_;
  std::string frame_;
};

}  // namespace hextools
