// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <utility>
#include <vector>

#include "terms/corotational_frame.h"
#include "terms/elastic.h"

namespace hexsolver {

/// W(x) = 1/2 (R^T x - X)^T K (R^T x - X), R = polar(F), F = grad x averaged over the filled part of the cell.
///
/// In a full cell F is the paper's average of the four edges per direction; in a partly filled one it is the rotation
/// of the material rather than of corners far from it, which the energy is hardly aware of.
/// Gradient and Hessian are exact, with R a function of x, so the forces of a cell have no net force and no net torque.
/// The Hessian is Q^T K Q + E with E of rank 6, three of its eigenvalues negative or zero; projected keeps E's positive
/// part. Derivation: THEORY.md, "Co-rotational cells". Source of W with R held: Nesme, Faure, Payan 2010.
/// Cells that do not rotate, if so chosen, keep R = 1 and cost what Cauchy's do. Where F is flat or turns inside out, R
/// may have no derivative; there a cell can keep an R, and has the W and the forces of that.
class CorotationalCells final : public ElasticCells {
public:
  /// @param rotating      which cells rotate; empty = all
  /// @param saves_memory  keep no frames in double precision: energies, forces and products find them again
  CorotationalCells(const Mesh& mesh, std::vector<std::int32_t> elements, std::vector<ElementModel> models,
                    std::vector<bool> rotating = {}, bool saves_memory = false, std::vector<CellPoints> points = {})
      : ElasticCells(mesh, std::move(elements), std::move(models), std::move(points)),
        rotating_(std::move(rotating)),
        saves_memory_(saves_memory) {}
  explicit CorotationalCells(const ElasticCells& same) : ElasticCells(same) {}

  /// The largest strain that a cell at u would take its rotation for if it did not rotate: w^2 (kappa / (2 mu) + 1/6)
  /// for an angle w, the stress of straight cells over 2 mu (THEORY.md, "Automatic strain").
  double strain_of_rotations(const NodeVector& u) const;
  void set_rotating(std::vector<bool> rotating) {
    rotating_ = std::move(rotating);
    held_.clear();
    forget_state();
  }
  /// Cells keep the R that they have at u where a sum of two of F's singular values, the least negative where F is
  /// inverted, is below `least` there or at `tried`, and where they kept an R in which they hold less; all others
  /// rotate.
  /// @param tried  of a step from u that could not be solved: all that kept an R keep it; null: u is a state reached
  void hold_rotations(const NodeVector& u, const NodeVector* tried, double least);
  std::size_t num_held() const noexcept { return held_.size(); }  ///< cells that keep an R

  bool set_rest(const NodeVector& to_rest) override;
  double energy(const NodeVector& u) const override;
  double cell_energy(std::size_t cell, const NodeVector& u) const override;
  Mat3 stress(std::size_t cell, const NodeVector& u) const override;
  void add_gradient(const NodeVector& u, NodeVector& gradient, NodeVector& magnitude) const override;
  bool is_linear() const override { return false; }
  void move_to(const NodeVector& u) override;
  void linearize(const NodeVector& u, double projection) override;
  void add_product(const NodeVector& x, NodeVector& y) const override;
  void add_product(const FloatNodeVector& x, FloatNodeVector& y) const override;
  void add_cell_hessian(std::size_t cell, CellMatrix& h) const override;
  void add_diagonal(std::size_t cell, NodeBlocks& blocks) const override;  ///< that of R K R^T
  Dilatation dilatation(std::size_t cell) const override;
  std::int32_t shared_hessian(std::size_t cell) const override {
    return is_straight(cell) ? elements_[cell] : own_hessian;
  }
  std::size_t bytes() const override;

private:
  using Rows = Eigen::Matrix<double, 3, 24, Eigen::RowMajor>;
  struct alignas(64) RestOfLanes : std::array<RotatedCells<double>::Lanes, 24> {};

  bool is_at(const NodeVector& u) const { return u.size() == state_.size() && u == state_; }
  void keep_state(const NodeVector& u, bool stressed);
  void forget_state() {
    state_.resize(0);
    positive_.clear();
    single_is_current_ = false;
  }
  void project();
  bool rotates(std::size_t cell) const { return rotating_.empty() || rotating_[cell]; }
  bool is_straight(std::size_t cell) const { return !rotates(cell) && !held_.contains(cell); }  ///< R = 1
  Mat3 kept_rotation(std::size_t cell) const;  ///< of a cell that does not rotate
  bool rotates_somewhere(std::size_t batch) const;
  /// Of a cell whose corners, at rest at `rest`, are displaced by `moved`, before its forces are known.
  static CorotationalFrame place(const NodeGradients& mean_gradient, const CellVector& rest, const CellVector& moved);
  static void add_forces(const CellVector& forces, CorotationalFrame& frame);  ///< f, and what follows from it
  CorotationalFrame frame(std::size_t cell, const NodeVector& u) const;
  static CellVector force(const CorotationalFrame& frame, const NodeGradients& mean_gradient);
  std::optional<CellVector> force_on_lattice(std::size_t cell, const CellVector& to_unstressed) const override;
  Reshaping reshaping() const override { return Reshaping::stiffness; }
  RestOfLanes rest_of_batch(std::size_t batch) const;
  /// Of a cell that does not rotate but has R = r, M^-1 = 0.
  CorotationalFrame unrotated_frame(std::size_t cell, const NodeVector& u, const Mat3& r) const;
  double energy_in(const CorotationalFrame& frame, std::size_t cell) const;  ///< [N mm]
  CorotationalFrame kept_frame(std::size_t cell) const;                      ///< at the state, without s
  CorotationalFrame frame_of_state(std::size_t cell) const;
  void rotate_batch(std::size_t batch, RotatedCells<double>& cells) const;
  void keep_single_frames() const;
  const RotatedCells<double>& rotated(std::size_t batch, RotatedCells<double>& space) const;
  const RotatedCells<float>& rotated(std::size_t batch, RotatedCells<float>& space) const;
  template <class Real>
  const std::vector<RotatedCells<Real>>& kept_frames() const {
    if constexpr (std::is_same_v<Real, double>)
      return frames_;
    else
      return single_frames_;
  }
  template <class Real>
  LaneModels<Real> models_of_batch(std::size_t number) const;
  template <class Vector>
  void add_product_of(const Vector& x, Vector& y) const;

  std::vector<bool> rotating_;
  std::map<std::size_t, Mat3> held_;  ///< R of cells that keep one
  NodeVector state_;         ///< of the last move_to() or linearize(): energy and forces there follow from its frames
  NodeVector moved_;         ///< from rest, at the state, where that is not on the lattice
  bool is_stressed_ = true;  ///< frames have A
  bool saves_memory_ = false;
  std::vector<RotatedCells<double>> frames_;  ///< at the state, by Mesh::batches(); none if memory is saved
  mutable std::vector<RotatedCells<float>> single_frames_;  ///< copies, made when first asked for
  mutable bool single_is_current_ = false;
  std::vector<PositiveParts> positive_;  ///< by Mesh::batches(); empty where the Hessian is not projected
  double projection_ = Hessian::exact;   ///< of the last linearize()
};

}  // namespace hexsolver
