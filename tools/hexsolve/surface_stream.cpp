// SPDX-License-Identifier: Apache-2.0
#include "surface_stream.h"

#include <fmt/format.h>

#include <bit>
#include <csignal>
#include <cstdio>

#include "cli/node_values.h"
#include "hexmesh/core/error.h"

namespace hextools {
namespace {

[[noreturn]] void fail() {
  throw hexmesh::Error(hexmesh::ErrorKind::output, "cannot write the stream to standard output");
}

template <class T>
void write(const T* values, std::size_t count) {
  if (std::fwrite(values, sizeof(T), count, stdout) != count) fail();
}

void flush() {
  if (std::fflush(stdout) != 0) fail();
}

}  // namespace

SurfaceStream::SurfaceStream(const hexmesh::Lattice& lattice) : lattice_(lattice) {
  std::signal(SIGPIPE, SIG_IGN);  // a reader that leaves is an error of writing
  static_assert(std::endian::native == std::endian::little);
  const hexmesh::TriangleSurface& surface = lattice.surface;
  fmt::print("hexstream 1\npoints {}\ntriangles {}\nmm LPS\n\n", surface.points.size(), surface.triangles.size());
  for (const auto& t : surface.triangles) write(t.data(), t.size());
  flush();
}

void SurfaceStream::add(const hexsolver::Motion& motion) {
  if (!embedded_) {
    const hexmesh::CellLocator locator(lattice_.voxels, motion.voxels_per_cell(), motion.cells());
    embedded_.emplace(locator, motion.cell_nodes(), lattice_.surface.points);
  }
  embedded_->interpolate(values_of(motion.displacement()), moved_);
  positions_.clear();
  for (std::size_t p = 0; p < moved_.size(); ++p)
    for (int d = 0; d < 3; ++d) positions_.push_back(static_cast<float>(lattice_.surface.points[p][d] + moved_[p][d]));
  const double time = motion.time();
  write(&time, 1);
  write(positions_.data(), positions_.size());
  flush();
}

}  // namespace hextools
