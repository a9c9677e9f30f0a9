// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "hexmesh/core/bytes.h"
#include "terms/load.h"

namespace hexsolver {

/// Forces that keep their size and direction while the body moves, W = -sum_d factor_d f_d . u_d: forces and pressures
/// on the embedded surface, f(q) = H^T f(p), and gravity.
class DeadLoad final : public Load {
public:
  struct NodeForce {
    std::int32_t node = 0;
    Vec3 force = Vec3::Zero();  ///< [N]
  };

  /// @param effect  force or gravity
  DeadLoad(EffectKind effect, std::string name, std::vector<NodeForce> forces)
      : effect_(effect), name_(std::move(name)), forces_(std::move(forces)) {}

  EffectKind effect() const override { return effect_; }
  std::string name() const override { return name_; }
  void set_factor(const Vec3& factor) override { factor_ = factor; }
  double energy(const NodeVector& u) const override;
  void add_gradient(const NodeVector& u, NodeVector& gradient, NodeVector& magnitude) const override;

  std::size_t bytes() const override { return hexmesh::bytes_of(forces_); }

  Vec3 total(const NodeVector& u) const override;

private:
  EffectKind effect_;
  std::string name_;
  std::vector<NodeForce> forces_;
  Vec3 factor_ = Vec3::Ones();
};

}  // namespace hexsolver
