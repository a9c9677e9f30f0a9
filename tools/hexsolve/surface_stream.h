// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "hexmesh/lattice/embedded_points.h"
#include "hexsolver/dynamics/motion.h"

namespace hextools {

/// The moving surface on standard output, step by step: "Stream" in FORMATS.md.
class SurfaceStream {
public:
  /// Writes the head. @throws Error{output}, as add does
  explicit SurfaceStream(const hexmesh::Lattice& lattice);

  /// Writes the surface as it is now.
  void add(const hexsolver::Motion& motion);

private:
  const hexmesh::Lattice& lattice_;
  std::optional<hexmesh::EmbeddedPoints> embedded_;
  std::vector<hexmesh::Vec3> moved_;
  std::vector<float> positions_;
  std::string frame_;
};

}  // namespace hextools
