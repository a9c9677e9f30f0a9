// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>

#include "hexmesh/geometry/shape_functions.h"
#include "hexmesh/lattice/material.h"

namespace hexmesh {

/// Size of the tensor-product rule {-1, 0, 1}^3; point (i, j, k) has number i + 3 (j + 3 k).
inline constexpr int num_rule_points = 27;

/// What a cell is made of: the exact integrals of its material against the 27 triquadratic Lagrange polynomials l_q of
/// the points {-1, 0, 1}^3,
///
///     w_q = int_filled c(x) l_q(x) dV,      c = mu, kappa, rho or 1.
///
/// Products of trilinear functions and of their gradients are triquadratic, so each element integral is the sum
/// int c f dV = sum_q w_q f(x_q), exact whatever part of the cell is filled and however the material varies in it.
/// (Derivation: libsolver/THEORY.md, "Elements as 27 integrals"; it equals K_parent = sum L^T K_child L of the paper.)
struct Element {
  using Weights = std::array<double, num_rule_points>;
  Weights shear{};    ///< mu    [N mm]
  Weights bulk{};     ///< kappa [N mm]
  Weights density{};  ///< rho   [tonne]
  Weights fill{};     ///< 1     [mm^3]

  double volume() const;       ///< filled volume [mm^3]
  double mass() const;         ///< [tonne]
  double total_shear() const;  ///< int mu dV [N mm]
  double total_bulk() const;   ///< int kappa dV [N mm]
};

/// A full voxel of one material.
/// @param volume  of the voxel [mm^3]
Element full_voxel(const Material& material, double volume);

/// Add a child to its parent: w_parent += T w_child with T the triquadratic interpolation from the child's points.
/// @param slot    which child: bit d = upper half along axis d; 0 along axes that are not merged
/// @param factor  children per parent along each axis, 1 or 2
void add_child(Element& parent, const Element& child, int slot, const Index3& factor);

/// The averaged law that the paper compares with: shear, bulk and fill of the element spread evenly over its cell,
/// which makes K the fill-weighted stiffness of the full cell. The density stays where it is.
Element spread_evenly(const Element& element);

/// K = A + (kappa_mean / V) b b^T, see ElementMatrices.
/// @param bulk  int kappa dV [N mm]
CellMatrix mean_dilatation_stiffness(const CellMatrix& deviatoric, const CellVector& divergence, double bulk,
                                     double volume);

/// Forms the matrices of the elements of one level, whose cells all have the same edges.
class ElementMatrices {
public:
  /// @param edges  columns = the cell's edge vectors in patient space [mm]
  explicit ElementMatrices(const Mat3& edges);

  /// A = int 2 mu dev(eps) : dev(eps) dV  [N/mm]
  CellMatrix deviatoric(const Element& element) const;
  /// int kappa (div u)^2 dV  [N/mm]
  CellMatrix volumetric(const Element& element) const;
  /// The paper's stiffness, K = A + volumetric  [N/mm]
  CellMatrix stiffness(const Element& element) const { return deviatoric(element) + volumetric(element); }
  /// b with b . u = int_filled div u dV  [mm^2]
  CellVector divergence(const Element& element) const;
  /// What incompatible modes take off the stiffness: K_ue K_ee^-1 K_eu for nine modes e, each component of the
  /// displacement bent along each axis of the cell, (xi_j - c_j)^2 with c the centroid of the filled part, so that
  /// their mean strain over it is zero and constant stresses do no work in them (Taylor, Beresford, Wilson 1976).
  /// Zero for linear fields of one material. Off the mean dilatation less is taken: with modes it counts how the
  /// dilatation varies linearly in the cell, int kappa (d . (xi - c))^2 dV with d = d(div u)/d(xi) at c, since bending
  /// whose only strain is a dilatation of mean zero would store nothing.
  /// @param counts_dilatation  of what it is taken: A + volumetric, or the mean dilatation
  CellMatrix relaxation(const Element& element, bool counts_dilatation) const;
  /// Mean dilatation, K = A + (kappa_mean / V) b b^T  [N/mm]
  CellMatrix mean_dilatation_stiffness(const Element& element) const;
  /// Consistent mass, scalar part: M_ab = int rho N_a N_b dV  [tonne], shape (8, 8)
  Eigen::Matrix<double, 8, 8> mass(const Element& element) const;
  /// Row sums of mass()  [tonne], shape (8)
  NodeWeights lumped_mass(const Element& element) const;
  /// int_filled N_a dV  [mm^3]
  NodeWeights shape(const Element& element) const;
  /// shape() / V: the mean of a field over the filled part is the sum of these times its nodal values
  NodeWeights mean_shape(const Element& element) const;

private:
  /// d(div)/d(xi_j) at the centroid = of_nodes^T u + of_modes^T e, and int kappa (xi_i - c_i)(xi_j - c_j) dV.
  struct LinearDilatation {
    Eigen::Matrix<double, 24, 3> of_nodes = Eigen::Matrix<double, 24, 3>::Zero();
    Eigen::Matrix<double, 9, 3> of_modes = Eigen::Matrix<double, 9, 3>::Zero();
    Mat3 moments = Mat3::Zero();  ///< [N mm]
  };
  LinearDilatation linear_dilatation(const Element& element, const Vec3& centroid) const;

  std::array<NodeGradients, num_rule_points> gradients_;  ///< of N_a in patient space [1/mm]
  Mat3 axis_gradients_;                                   ///< rows: of the cell's coordinates xi_j [1/mm]
};

}  // namespace hexmesh
