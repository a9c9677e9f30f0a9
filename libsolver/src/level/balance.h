// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "hexmesh/lattice/lattice.h"
#include "hexsolver/report/report.h"
#include "hexsolver/scene/scene.h"
#include "mesh/mesh.h"

namespace hexsolver {

/// Where forces act on a body, from the point that moments are about; see BalanceReport.
class Arms {
public:
  Arms(const hexmesh::Lattice& lattice, Elasticity elasticity)
      : about_((lattice.corner() + lattice.voxels.position(opposite(lattice))) / 2),
        moves_(elasticity != Elasticity::cauchy) {}

  const Vec3& about() const noexcept { return about_; }

  /// Of a point that was at `rest` and is displaced by `u` [mm].
  Vec3 of(const Vec3& rest, const Vec3& u) const { return rest - about_ + (moves_ ? u : Vec3::Zero()); }

private:
  static Vec3 opposite(const hexmesh::Lattice& lattice) {
    const Index3& n = lattice.voxels.extent();
    return Vec3(n[0], n[1], n[2]) - Vec3::Constant(0.5);
  }

  Vec3 about_;
  bool moves_;
};

/// The resultant of forces on the nodes of a mesh.
/// @param counts  which nodes; empty: all
BalanceReport::Row resultant(const std::string& name, const NodeVector& forces, const Mesh& mesh, const NodeVector& u,
                             const Arms& arms, const std::vector<bool>& counts = {});

/// Fill report.balance from what the report says of its conditions and from the loads, and the moments of forces and
/// contacts from these.
/// @param loads  all other forces, each by the name of its term
void report_balance(const Scene& scene, const Arms& arms, const std::vector<BalanceReport::Row>& loads,
                    SolveReport& report);

}  // namespace hexsolver
