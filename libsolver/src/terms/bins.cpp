// SPDX-License-Identifier: Apache-2.0
#include "terms/bins.h"

#include <numeric>

#include "hexmesh/core/bytes.h"

namespace hexsolver {

template <class F>
void Bins::for_bins(const Eigen::AlignedBox3d& box, const F& f) const {
  if (box.isEmpty()) return;
  const Cell low = cell_of(box.min()), high = cell_of(box.max());
  Cell at;
  for (at[2] = low[2]; at[2] <= high[2]; ++at[2])
    for (at[1] = low[1]; at[1] <= high[1]; ++at[1])
      for (at[0] = low[0]; at[0] <= high[0]; ++at[0]) f(number_of(at));
}

void Bins::fill(const std::vector<Eigen::AlignedBox3d>& boxes, double size) {
  constexpr double most_bins_a_box = 8;
  Eigen::AlignedBox3d all;
  for (const Eigen::AlignedBox3d& box : boxes) all.extend(box);
  num_.setZero();
  begin_.assign(1, 0);
  boxes_.clear();
  if (all.isEmpty()) return;
  low_ = all.min();
  const auto num_bins = [&] { return ((all.sizes().array() / size).floor() + 1).prod(); };
  while (num_bins() > most_bins_a_box * static_cast<double>(boxes.size())) size *= 2;
  size_ = size;
  num_ = cell_of(all.max()) + 1;
  begin_.assign(static_cast<std::size_t>(num_.prod()) + 1, 0);
  for (const Eigen::AlignedBox3d& box : boxes) for_bins(box, [&](std::size_t bin) { ++begin_[bin + 1]; });
  std::partial_sum(begin_.begin(), begin_.end(), begin_.begin());
  boxes_.resize(begin_.back());
  std::vector<std::size_t> next(begin_.begin(), begin_.end() - 1);
  for (std::size_t n = 0; n < boxes.size(); ++n) for_bins(boxes[n], [&](std::size_t bin) { boxes_[next[bin]++] = n; });
}

std::span<const std::size_t> Bins::at(const Vec3& x) const {
  if (!x.allFinite() || num_.isZero()) return {};
  const Eigen::Array3d place = (x - low_).array() / size_;
  if ((place < 0).any() || (place >= num_.cast<double>()).any()) return {};
  const std::size_t bin = number_of(cell_of(x));
  return std::span(boxes_).subspan(begin_[bin], begin_[bin + 1] - begin_[bin]);
}

std::size_t Bins::bytes() const { return hexmesh::bytes_of(begin_) + hexmesh::bytes_of(boxes_); }

}  // namespace hexsolver
