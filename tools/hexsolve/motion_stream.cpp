// SPDX-License-Identifier: Apache-2.0
#include "motion_stream.h"

#include <fmt/format.h>

#include <bit>
#include <utility>

#include "cli/node_values.h"
#include "hexmesh/file/atomic_file.h"

namespace hextools {
namespace {

template <class T>
void append(std::string& bytes, const T* values, std::size_t count) {
  bytes.append(reinterpret_cast<const char*>(values), sizeof(T) * count);
}

}  // namespace

MotionStream::MotionStream(const hexmesh::Lattice& lattice, Streamed what) : lattice_(lattice), what_(what) {
  static_assert(std::endian::native == std::endian::little);
}

void MotionStream::write_head(const hexsolver::Motion& motion) {
  const hexmesh::TriangleSurface& surface = lattice_.surface;
  std::string head = "hexstream 1\n";
  if (what_ == Streamed::nodes) {
    head += fmt::format("nodes {}\nmm LPS\n\n", motion.displacement().size() / 3);
  } else {
    head += fmt::format("points {}\ntriangles {}\nmm LPS\n\n", surface.points.size(), surface.triangles.size());
    for (const auto& t : surface.triangles) append(head, t.data(), t.size());
    const hexmesh::CellLocator locator = motion.locator();
    embedded_.emplace(locator, motion.cell_nodes(), surface, lattice_.parting, lattice_.labels);
  }
  hexmesh::write_standard_output(head);
}

void MotionStream::add(const hexsolver::Motion& motion) {
  if (!std::exchange(has_begun_, true)) write_head(motion);
  values_.clear();
  if (what_ == Streamed::nodes) {
    for (const double u : motion.displacement()) values_.push_back(static_cast<float>(u));
  } else {
    embedded_->interpolate(values_of(motion.displacement()), moved_);
    for (std::size_t p = 0; p < moved_.size(); ++p)
      for (int d = 0; d < 3; ++d) values_.push_back(static_cast<float>(lattice_.surface.points[p][d] + moved_[p][d]));
  }
  const double time = motion.time();
  frame_.clear();
  append(frame_, &time, 1);
  append(frame_, values_.data(), values_.size());
  hexmesh::write_standard_output(frame_);
}

}  // namespace hextools
