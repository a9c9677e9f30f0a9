// SPDX-License-Identifier: Apache-2.0
#include "states.h"

#include <fmt/format.h>

#include "cli/result_state.h"
#include "hexmesh/core/error.h"

namespace hextools {

StatesOfFile::StatesOfFile(std::filesystem::path path) : path_(std::move(path)), result_(read_with_surface(path_)) {
  if (result_.times.empty()) return;
  steps_.emplace(path_, result_);
  go_to(result_.times.size() - 1);
}

void StatesOfFile::go_to(std::size_t n) {
  if (!steps_) return;
  now_ = &steps_->at(n);
  number_ = n;
}

LiveStates::LiveStates(hexmesh::Result at_rest)
    : now_(std::move(at_rest)),
      surface_(hexmesh::locator_of(now_), now_.cell_nodes, now_.surface, now_.parting, now_.labels) {
  now_.displacement.assign(now_.nodes.size(), hexmesh::Vec3::Zero());
  now_.surface_displacement.assign(now_.surface.points.size(), hexmesh::Vec3::Zero());
}

void LiveStates::take(const Frame& frame) {
  if (frame.displacement.size() != 3 * now_.nodes.size())
    throw hexmesh::Error(hexmesh::ErrorKind::output, fmt::format("hexsolve sends {} nodes, expected {}",
                                                                 frame.displacement.size() / 3, now_.nodes.size()));
  time_ = frame.time;
  nodal_.assign(frame.displacement.begin(), frame.displacement.end());
  for (std::size_t n = 0; n < now_.nodes.size(); ++n)
    now_.displacement[n] = {nodal_[3 * n], nodal_[3 * n + 1], nodal_[3 * n + 2]};
  surface_.interpolate(nodal_, now_.surface_displacement);
}

}  // namespace hextools
