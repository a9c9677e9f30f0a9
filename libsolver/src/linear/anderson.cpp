// SPDX-License-Identifier: Apache-2.0
#include "linear/anderson.h"

#include <Eigen/QR>

namespace hexsolver {

NodeVector Anderson::next(const NodeVector& x, const NodeVector& r) {
  if (last_x_.size() > 0) {
    of_x_.push_back(x - last_x_);
    of_r_.push_back(r - last_r_);
    if (of_x_.size() > most_) {
      of_x_.erase(of_x_.begin());
      of_r_.erase(of_r_.begin());
    }
  }
  last_x_ = x;
  last_r_ = r;
  NodeVector out = x + r;
  if (of_r_.empty()) return out;
  Eigen::MatrixXd changes(r.size(), static_cast<Eigen::Index>(of_r_.size()));
  for (std::size_t n = 0; n < of_r_.size(); ++n) changes.col(static_cast<Eigen::Index>(n)) = of_r_[n];
  const Eigen::VectorXd part = changes.colPivHouseholderQr().solve(r);
  for (std::size_t n = 0; n < of_r_.size(); ++n) out -= part[static_cast<Eigen::Index>(n)] * (of_x_[n] + of_r_[n]);
  return out;
}

}  // namespace hexsolver
