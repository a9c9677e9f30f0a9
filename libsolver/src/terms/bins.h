// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>
#include <span>
#include <vector>

#include "hexsolver/core/vectors.h"

namespace hexsolver {

/// Which of many boxes reach into the bins of a grid around them.
class Bins {
public:
  /// @param size  of a bin, larger where they would be many more than the boxes [mm]
  void fill(const std::vector<Eigen::AlignedBox3d>& boxes, double size);  ///< empty boxes are nowhere

  /// Numbers of the boxes that reach into the bin of a place, ascending.
  std::span<const std::size_t> at(const Vec3& x) const;

  std::size_t bytes() const;

private:
  using Cell = Eigen::Array<std::int64_t, 3, 1>;
  Cell cell_of(const Vec3& x) const { return ((x - low_).array() / size_).floor().cast<std::int64_t>(); }
  std::size_t number_of(const Cell& c) const {
    return static_cast<std::size_t>(c[0] + num_[0] * (c[1] + num_[1] * c[2]));
  }
  template <class F>
  void for_bins(const Eigen::AlignedBox3d& box, const F& f) const;

  Vec3 low_ = Vec3::Zero();
  double size_ = 1;
  Cell num_ = Cell::Zero();
  std::vector<std::size_t> begin_, boxes_;  ///< those of bin b are boxes_[begin_[b]] to boxes_[begin_[b + 1]]
};

}  // namespace hexsolver
