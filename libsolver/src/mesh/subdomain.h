// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "hexsolver/core/vectors.h"
#include "mesh/mesh.h"

namespace hexsolver {

/// Where the mesh of one process hangs together with those of others, each of which has other cells of a body: they
/// have some nodes in common. The functions that say so are called by all of them at once.
class Subdomain {
public:
  virtual ~Subdomain() = default;

  const std::vector<std::int32_t>& shared_nodes() const noexcept { return shared_; }  ///< that other processes have too

  /// Of a node or cell of this process's mesh, its index in the whole.
  Index3 in_whole(const Index3& index) const noexcept {
    return {index[0] + low_[0], index[1] + low_[1], index[2] + low_[2]};
  }

  /// Of what each process has at a node the sum, for all that have the node: the same to the last bit. Called by all.
  virtual void add_up(NodeVector& v) const = 0;
  virtual void add_up(FloatNodeVector& v) const = 0;
  virtual void add_up(std::vector<Mat3>& of_nodes) const = 0;

  /// v <- 0 at nodes that another process owns: add_up() then finds v again, plus what was added in between.
  template <class Vector>
  void keep_own(Vector& v) const {
    for (const std::int32_t n : of_others_) v.template segment<3>(3 * Eigen::Index{n}).setZero();
  }

  /// x . y, each node once. Called by all.
  template <class Vector>
  double dot(const Vector& x, const Vector& y) const {
    double own = x.template cast<double>().dot(y.template cast<double>());
    for (const std::int32_t n : of_others_)
      own -= x.template segment<3>(3 * Eigen::Index{n})
                 .template cast<double>()
                 .dot(y.template segment<3>(3 * Eigen::Index{n}).template cast<double>());
    return sum(own);
  }

  virtual double sum(double value) const = 0;            ///< of all processes; called by all, as those below
  virtual double largest(double value) const = 0;        ///< likewise
  virtual void sum(std::span<double> values) const = 0;  ///< value by value
  virtual void sum(std::span<float> values) const = 0;   ///< likewise

protected:
  explicit Subdomain(const Index3& low) : low_(low) {}

  Index3 low_;                                    ///< where the mesh of this process begins in the whole
  std::vector<std::int32_t> shared_, of_others_;  ///< nodes; of_others_: those of shared_ that another process owns
};

}  // namespace hexsolver
