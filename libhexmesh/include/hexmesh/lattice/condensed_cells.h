// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "hexmesh/lattice/lattice.h"

namespace hexmesh {

/// What a cell's corners get of an acceleration, rows 3 a + i of a = 0..7.
using CellWeight = Eigen::Matrix<double, 24, 3>;

/// A cell in which the nodes of its children move nearly freely, where they are nodes of this cell alone.
///
/// With A and b of the children over their nodes, E(u) = 1/2 u^T A u + e / (2 V^2) (b . u)^2: inner nodes, which no
/// other cell has and on which nothing acts, go `relaxing` of the way from u_0, where the corners put them by trilinear
/// interpolation, to where E is least. That is linear in the corners, u = T u_corners, and A' = T^T A T, b' = T^T b. It
/// is again an interpolation that agrees across faces: with the dilatation counted in full K' is an upper bound of what
/// the voxels resist, and below K_parent = sum L^T K_child L, which it is without inner nodes. What the weight does to
/// inner nodes goes the same way, f' = f_parent - relaxing (2 - relaxing) F^T M^-1 f: what hangs free in a cell is as
/// soft as it is light, and moves as it would without. (Derivation: libsolver/THEORY.md, "Condensed cells".)
struct CondensedElement {
  CellMatrix stiffness = CellMatrix::Zero();   ///< A, all but what resists the mean dilatation with `excess` [N/mm]
  CellVector divergence = CellVector::Zero();  ///< b with b . u = int_filled div u dV [mm^2]
  double excess = 0;                           ///< e, K = A + e / V^2 b b^T [N mm]
  double volume = 0;                           ///< V, of the filled part [mm^3]
  CellWeight weight = CellWeight::Zero();      ///< forces on the corners of a unit acceleration of the material [t]
};

/// Those of a level. Cells of a kind are alike in all that they hold.
struct CondensedLevel {
  std::vector<std::int32_t> kind;           ///< shape (num_cells)
  std::vector<std::int32_t> element;        ///< shape (num_kinds), the element that cells of a kind share
  std::vector<CondensedElement> condensed;  ///< shape (num_kinds)
};

/// How much of the way inner nodes go. At 1 a corner that little material reaches would have no stiffness at all, but
/// loads that are handed to it by trilinear interpolation.
inline constexpr double relaxing = 2.0 / 3;

/// What resists the change of volume of a condensed cell.
enum class CondensedDilatation : std::uint8_t {
  mean,  ///< of each voxel's mean dilatation min(kappa, 2/3 mu), so that A is of a Poisson's ratio of 0, and of the
         ///< cell's what is left
  full   ///< of the dilatation everywhere, kappa
};

/// Where a condition or a force acts: nodes by which it does are none of the inner ones.
struct ActingPoint {
  std::int32_t cell = 0;  ///< of level 0, on which it acts
  Vec3 index;             ///< its place, as a continuous index of the voxels

  bool operator==(const ActingPoint&) const = default;
};

/// The condensed cells of a lattice, level by level from the voxels on, found when first asked for.
class Condensation {
public:
  /// @param lattice  must outlive this
  Condensation(const Lattice& lattice, std::vector<ActingPoint> acting, CondensedDilatation dilatation);

  /// Whether it is of that.
  bool is_of(const Lattice& lattice, const std::vector<ActingPoint>& acting, CondensedDilatation dilatation) const;

  /// @pre level > 0; it and all finer ones are in the lattice
  const CondensedLevel& level(int level);
  /// The same, which is not kept, nor any coarser one.
  CondensedLevel take(int level);

private:
  const Lattice* lattice_;
  std::vector<ActingPoint> acting_;
  CondensedDilatation dilatation_;
  std::vector<CondensedLevel> levels_;  ///< from the voxels on
};

}  // namespace hexmesh
