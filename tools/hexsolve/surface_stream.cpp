// SPDX-License-Identifier: Apache-2.0
#include "surface_stream.h"

#include <fmt/format.h>

#include <bit>

#include "cli/node_values.h"
#include "hexmesh/file/atomic_file.h"

namespace hextools {
namespace {

template <class T>
void append(std::string& bytes, const T* values, std::size_t count) {
  bytes.append(reinterpret_cast<const char*>(values), sizeof(T) * count);
}

}  // namespace

SurfaceStream::SurfaceStream(const hexmesh::Lattice& lattice) : lattice_(lattice) {
  static_assert(std::endian::native == std::endian::little);
  const hexmesh::TriangleSurface& surface = lattice.surface;
  std::string head =
      fmt::format("hexstream 1\npoints {}\ntriangles {}\nmm LPS\n\n", surface.points.size(), surface.triangles.size());
  for (const auto& t : surface.triangles) append(head, t.data(), t.size());
  hexmesh::write_standard_output(head);
}

void SurfaceStream::add(const hexsolver::Motion& motion) {
  if (!embedded_) {
    const hexmesh::CellLocator locator = motion.locator();
    embedded_.emplace(locator, motion.cell_nodes(), lattice_.surface, lattice_.parting, lattice_.labels);
  }
  embedded_->interpolate(values_of(motion.displacement()), moved_);
  positions_.clear();
  for (std::size_t p = 0; p < moved_.size(); ++p)
    for (int d = 0; d < 3; ++d) positions_.push_back(static_cast<float>(lattice_.surface.points[p][d] + moved_[p][d]));
  const double time = motion.time();
  frame_.clear();
  append(frame_, &time, 1);
  append(frame_, positions_.data(), positions_.size());
  hexmesh::write_standard_output(frame_);
}

}  // namespace hextools
