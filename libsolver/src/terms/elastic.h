// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "core/rigid_fit.h"
#include "hexmesh/lattice/condensed_cells.h"
#include "hexmesh/lattice/element.h"
#include "hexmesh/lattice/subcells.h"
#include "hexsolver/scene/law.h"
#include "kernels/mirrored_matrix.h"
#include "terms/cell_jacobians.h"
#include "terms/cell_points.h"
#include "terms/term.h"

namespace hexsolver {

/// What condensed cells have of their own.
struct CondensedModel {
  double bulk = 0;             ///< that resists the mean dilatation [MPa]
  NodeGradients gradient;      ///< b / V, of that [1/mm]
  hexmesh::CellWeight weight;  ///< see hexmesh::CondensedElement [t]
};

/// What cells alike share.
struct ElementModel {
  CellMatrix stiffness;                                    ///< K [N/mm]
  std::shared_ptr<const MirroredMatrix<double>> mirrored;  ///< K again, where it is the same mirrored
  NodeGradients mean_gradient;              ///< of N_a over the filled part, b / V; see condensed() [1/mm]
  NodeWeights mean_shape;                   ///< N_a over the filled part
  double volume = 0;                        ///< of the filled part [mm^3]
  double shear = 0, bulk = 0;               ///< mean moduli over the filled part [MPa]
  bool mean_dilatation = false;             ///< K resists change of volume by (bulk / volume) b b^T
  std::optional<CondensedModel> condensed;  ///< of condensed cells: bulk, b and weight are these
  hexmesh::SubcellMask subcells = 0;        ///< where the material is; 0 = not known

  void set_stiffness(const CellMatrix& k);
  AlikeMatrix<double> alike() const { return {stiffness.data(), mirrored.get()}; }
};

/// sigma = 2 mu dev(strain) + kappa tr(strain)  [MPa]
Mat3 hooke_stress(const ElementModel& model, const Mat3& strain);

/// Cauchy stress from Kirchhoff's, tau / J  [MPa]. Where a cell is inside out the area that bears it is that of |J|;
/// flat ones have J = 1e-6, so that it stays a number.
Mat3 cauchy_stress(const Mat3& kirchhoff, double jacobian);

/// @param edges  columns = the cell's edge vectors [mm]
/// @param bends  whether incompatible modes relax the stiffness
ElementModel make_element_model(const hexmesh::ElementMatrices& matrices, const hexmesh::Element& element,
                                const Mat3& edges, Volumetric volumetric, bool bends = false);

/// The same, to the last digit, from the matrices that the lattice file holds.
ElementModel make_element_model(const hexmesh::StoredMatrices& matrices, std::size_t element, const Mat3& edges,
                                Volumetric volumetric);

/// A cell's model with the stiffness that it has condensed. Its mean gradient is that of the linear field next to where
/// the corners are, w_a |y_a - F x_a - c|^2 least in all with w_a = tr K_aa: a corner that hardly carries tells nothing
/// of how the material turns. A full cell's is as before.
/// @param edges  columns = its edge vectors [mm]
ElementModel condensed(ElementModel model, const hexmesh::CondensedElement& element, const Mat3& edges);

/// The elastic energy of all cells of one level.
///
/// Displacements are measured from the lattice, where cells are at rest unless set_rest() says otherwise, and free of
/// stress there unless set_prestretch() does.
class ElasticCells : public Term {
public:
  /// @param mesh      must outlive this
  /// @param elements  number of the model of each cell
  /// @param points    of the models; may be left out by laws that do not integrate at points, unless set_rest() is used
  ElasticCells(const Mesh& mesh, std::vector<std::int32_t> elements, std::vector<ElementModel> models,
               std::vector<CellPoints> points = {});

  /// Let cells be stretched where they are at rest, each by its own F0: what stores no energy is F0^-1 of its shape at
  /// rest, for itself. set_rest() forms them.
  /// @param of_cells  F0; empty: none
  /// @param part      of F0 - 1 that there is
  void set_prestretch(const std::vector<Mat3>& of_cells, double part = 1);
  bool is_prestretched() const noexcept { return !to_unstressed_.empty(); }

  /// Let the cells be at rest elsewhere: their models are formed anew, each for itself.
  /// @param to_rest  displacement of all nodes from the lattice [mm]
  /// @returns false where material would be inside out; nothing has changed then
  virtual bool set_rest(const NodeVector& to_rest);

  /// Add the forces on the nodes that cells exert at u = 0 if they are at rest elsewhere, as add_gradient() does after
  /// set_rest().
  /// @returns false where material would be inside out
  bool add_gradient_on_lattice(const NodeVector& to_rest, NodeVector& gradient, NodeVector& magnitude) const;

  EffectKind effect() const override { return EffectKind::elasticity; }
  double energy(const NodeVector& u) const override;
  double rounding() const override { return rounding_; }                ///< 50 eps |sum over cells of |K| |X||
  double energy_rounding() const override { return energy_rounding_; }  ///< 4 eps sum over cells of |X| |K| |X|
  std::size_t bytes() const override;
  std::size_t model_bytes() const;  ///< of these shared with those made of these cells
  virtual double cell_energy(std::size_t cell, const NodeVector& u) const = 0;  ///< [N mm]

  struct Size {
    double mean = 0, largest = 0;
  };
  /// Length of a field [its unit], averaged over the filled part of each cell first: nodes of slivers, which move
  /// without meaning, count as little as their material.
  /// @param left_out  cells that do not count; empty = none
  Size size_in_material(const NodeVector& field, const std::vector<bool>& left_out = {}) const;

  /// Add the filled part of each cell, in its mean, to the rigid motion next to a displacement.
  void add_to(RigidFit& fit, const NodeVector& u) const;
  /// Length of a displacement beside a rigid motion, averaged likewise [mm].
  double deformation_in_material(const NodeVector& u, const RigidFit& fit) const;

  /// What the law cannot bear in a state; empty if it can.
  /// @param nearly  also where it is close to that, for one who asks why there is no solution
  virtual std::string limit_reached(const NodeVector& /*u*/, bool /*nearly*/) const { return {}; }

  /// det F at the centres of the subcells of a cell that hold material; of its mean gradient where these are not known.
  Jacobians jacobians(std::size_t cell, const NodeVector& u) const;

  /// Mean Cauchy stress [MPa]; small strain knows no other (THEORY.md, "Stress and pressure").
  virtual Mat3 stress(std::size_t cell, const NodeVector& u) const = 0;
  Mat3 mean_gradient(std::size_t cell, const NodeVector& u) const;  ///< F from rest, over the filled part
  /// F over the filled part, from where it is free of stress.
  Mat3 mean_elastic_gradient(std::size_t cell, const NodeVector& u) const;

  const Mesh& mesh() const noexcept { return mesh_; }
  const ElementModel& model(std::size_t cell) const { return (*models_)[elements_[cell]]; }

protected:
  /// What of the models of cells depends on where they are at rest, beside their means.
  enum class Reshaping { nothing, stiffness, points };
  virtual Reshaping reshaping() const { return Reshaping::nothing; }

  /// Forces at u = 0 of a cell whose corners are free of stress where displaced by `to_unstressed`; nothing if it is
  /// inside out there, or of laws that know no such thing.
  virtual std::optional<CellVector> force_on_lattice(std::size_t /*cell*/, const CellVector& /*to_unstressed*/) const {
    return {};
  }

  /// What products in single precision take from the models, made when it is first asked for.
  struct SingleModels;
  const SingleModels& single_models() const;

  Dilatation rotated_dilatation(std::size_t cell, const Mat3& rotation) const;

  const Mesh& mesh_;
  std::vector<std::int32_t> elements_;
  std::shared_ptr<const std::vector<ElementModel>> models_;
  const CellPoints& points(std::size_t cell) const { return (*points_)[elements_[cell]]; }
  const CellPoints& points_on_lattice(std::size_t cell) const {
    return on_lattice_ ? (*on_lattice_->points)[on_lattice_->elements[cell]] : points(cell);
  }

  bool is_at_rest_on_lattice() const { return to_rest_.size() == 0; }
  const NodeVector& to_rest() const { return to_rest_; }
  /// Corners relative to the centre of the cell of the lattice.
  const CellVector& corners(std::size_t cell) const { return corners_[mesh_.size_of(cell)]; }
  /// X, where these are free of stress.
  CellVector unstressed(std::size_t cell) const {
    return is_at_rest_on_lattice() ? corners(cell) : CellVector(corners(cell) + to_unstressed(cell, to_rest_));
  }
  /// By how much the corners are displaced from there.
  CellVector moved(std::size_t cell, const NodeVector& u) const {
    return is_at_rest_on_lattice() ? mesh_.gather(cell, u)
                                   : CellVector(mesh_.gather(cell, u) - to_unstressed(cell, to_rest_));
  }

  double sum_of_energies() const;
  mutable std::vector<double> energies_;  ///< space for energy(): parts to be summed up in this order

private:
  /// Small strain, which forms no cell anew, knows the sum of two and not their product.
  bool adds_stretches() const { return reshaping() == Reshaping::nothing; }
  void measure_rounding();
  /// From the corners on the lattice to where they are free of stress, of cells at rest elsewhere.
  CellVector to_unstressed(std::size_t cell, const NodeVector& to_rest) const;

  std::vector<CellVector> corners_;  ///< of each size of cells
  std::shared_ptr<const std::vector<CellPoints>> points_;
  NodeVector to_rest_;               ///< empty: at rest on the lattice
  std::vector<Mat3> to_unstressed_;  ///< F0^-1 of each cell; empty: no stress at rest
  struct OnLattice {
    std::vector<std::int32_t> elements;
    std::shared_ptr<const std::vector<ElementModel>> models;
    std::shared_ptr<const std::vector<CellPoints>> points;
  };
  std::optional<OnLattice> on_lattice_;  ///< what there was before set_rest()

  /// f(cell, volume, rest position relative to node (0, 0, 0), field): means over the filled part of each cell.
  template <class F>
  void for_each_mean(const NodeVector& field, F&& f) const;

  double rounding_ = 0, energy_rounding_ = 0;
  mutable std::shared_ptr<const SingleModels> single_models_;
};

}  // namespace hexsolver
