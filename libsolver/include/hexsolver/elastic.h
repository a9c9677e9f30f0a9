// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "hexmesh/lattice/element.h"
#include "hexsolver/rotation.h"
#include "hexsolver/term.h"

namespace hexsolver {

/// The law of the cells: the measure of strain, and what energy it stores.
enum class Elasticity {
  cauchy,        ///< small strain, Hooke
  corotational,  ///< small strain in a frame that turns with the cell, Hooke
  green_lagrange,
  neo_hookean,
  stable_neo_hookean
};

/// Whether the law is made for large strain, and integrated at points.
inline constexpr bool is_hyperelastic(Elasticity e) { return e != Elasticity::cauchy && e != Elasticity::corotational; }
enum class Rotation {
  polar,  ///< of the mean gradient over the filled part; exact gradient and Hessian
  edges   ///< the paper's: orthonormalised averages of the cell's edges, held while forces are taken
};
enum class Volumetric { mean, full };

enum class Stiffness {
  exact,   ///< K_parent = sum L^T K_child L: soft where a cell is empty
  uniform  ///< the fill-weighted full cell, for comparison
};

/// What decides how cells store energy.
struct ElasticSettings {
  Elasticity elasticity = Elasticity::corotational;
  Rotation rotation = Rotation::polar;
  Volumetric volumetric = Volumetric::mean;
  Stiffness stiffness = Stiffness::exact;
  std::vector<bool> turning;  ///< which co-rotational cells turn; empty = all
  bool saves_memory = false;  ///< co-rotational cells keep frames in single precision only
};

/// What cells alike share.
struct ElementModel {
  CellMatrix stiffness;          ///< K [N/mm]
  NodeGradients mean_gradient;   ///< of N_a over the filled part, b / V [1/mm]
  NodeWeights mean_shape;        ///< N_a over the filled part
  double volume = 0;             ///< of the filled part [mm^3]
  double shear = 0, bulk = 0;    ///< mean moduli over the filled part [MPa]
  bool mean_dilatation = false;  ///< K resists change of volume by (bulk / volume) b b^T
};

/// sigma = 2 mu dev(strain) + kappa tr(strain)  [MPa]
Mat3 hooke_stress(const ElementModel& model, const Mat3& strain);

ElementModel make_element_model(const hexmesh::ElementMatrices& matrices, const hexmesh::Element& element,
                                Volumetric volumetric);

/// The elastic energy of all cells of one level.
class ElasticCells : public Term {
public:
  /// @param mesh      must outlive this
  /// @param elements  number of the model of each cell
  ElasticCells(const Mesh& mesh, std::vector<std::int32_t> elements, std::vector<ElementModel> models);

  std::string name() const override { return "elasticity"; }
  double energy(const NodeVector& u) const override;
  double rounding() const override { return rounding_; }  ///< 50 eps |sum over cells of |K| |X||
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

  /// What the law cannot bear in a state; empty if it can.
  /// @param nearly  also where it is close to that, for one who asks why there is no solution
  virtual std::string limit_reached(const NodeVector& /*u*/, bool /*nearly*/) const { return {}; }

  /// det F of a cell, F the mean gradient over its filled part; the least of its points where it has them.
  virtual double least_jacobian(std::size_t cell, const NodeVector& u) const;

  virtual Mat3 stress(std::size_t cell, const NodeVector& u) const = 0;  ///< mean Cauchy stress [MPa]
  Mat3 mean_gradient(std::size_t cell, const NodeVector& u) const;       ///< F over the filled part

  const Mesh& mesh() const noexcept { return mesh_; }
  const ElementModel& model(std::size_t cell) const { return (*models_)[static_cast<std::size_t>(elements_[cell])]; }

protected:
  /// What products in single precision take from the models, made when it is first asked for.
  struct SingleModels;
  const SingleModels& single_models() const;

  Dilatation dilatation_turned(std::size_t cell, const Mat3& rotation) const;

  const Mesh& mesh_;
  std::vector<std::int32_t> elements_;
  std::shared_ptr<const std::vector<ElementModel>> models_;
  CellVector rest_;  ///< X, corners relative to the cell's centre

  double sum_of_energies() const;
  mutable std::vector<double> energies_;  ///< space for energy(): parts to be summed up in this order

private:
  double rounding_ = 0;
  mutable std::shared_ptr<const SingleModels> single_models_;
};

/// Small strain: W(u) = 1/2 u^T K u.
class CauchyCells final : public ElasticCells {
public:
  using ElasticCells::ElasticCells;
  explicit CauchyCells(const ElasticCells& same) : ElasticCells(same) {}
  double cell_energy(std::size_t cell, const NodeVector& u) const override;
  Mat3 stress(std::size_t cell, const NodeVector& u) const override;
  void add_gradient(const NodeVector& u, NodeVector& gradient, NodeVector& magnitude) const override;
  void add_product(const NodeVector& x, NodeVector& y) const override;
  void add_product(const FloatNodeVector& x, FloatNodeVector& y) const override;
  void add_cell_hessian(std::size_t cell, CellMatrix& h) const override { h += model(cell).stiffness; }
  void add_diagonal(std::size_t cell, NodeBlocks& blocks) const override;
  Dilatation dilatation(std::size_t cell) const override { return dilatation_turned(cell, Mat3::Identity()); }
  std::int32_t shared_hessian(std::size_t cell) const override { return elements_[cell]; }
};

/// Up to eight co-rotational cells at one state, side by side, for products with their Hessians; the letters are those
/// of THEORY.md. R by columns, of the symmetric M^-1 and A the upper triangles by rows; what has a vector for each node
/// holds that of node 0, of node 1, ...
template <class Real>
struct alignas(8 * sizeof(Real)) TurnedCells {
  static constexpr std::size_t lanes = 8;
  using Lanes = std::array<Real, lanes>;
  std::array<Lanes, 24> y, f;
  std::array<Lanes, 9> r;
  std::array<Lanes, 6> inverse_m, a;
  std::array<Lanes, 3> h;
};

template <class Real>
struct LaneModels;
template <class Real>
class CellMatrices;

/// What a clamped Hessian has in place of E of each of these: Z Z^T with Z = T^T B + L^T C, B and C of shape (3, 3) by
/// columns. It need not be exact.
struct alignas(32) PositiveParts {
  using Lanes = std::array<float, TurnedCells<float>::lanes>;
  std::array<Lanes, 9> b, c;
};

/// W(x) = 1/2 (R^T x - X)^T K (R^T x - X), R = polar(F), F = grad x averaged over the filled part of the cell.
///
/// In a full cell F is the paper's average of the four edges per direction; in a partly filled one it is the rotation
/// of the material rather than of corners far from it, which the energy is hardly aware of.
/// Gradient and Hessian are exact, with R a function of x, so the forces of a cell have no net force and no net torque.
/// The Hessian is Q^T K Q + E with E of rank 6, three of its eigenvalues negative or zero; clamped keeps E's positive
/// part. Derivation: THEORY.md, "Co-rotational cells". Source of W with R held: Nesme, Faure, Payan 2010.
/// Cells that do not turn, if so chosen, keep R = 1 and cost what Cauchy's do.
class CorotationalCells final : public ElasticCells {
public:
  /// @param turning       which cells turn; empty = all
  /// @param saves_memory  keep no frames in double precision: energies, forces and products find them again
  CorotationalCells(const Mesh& mesh, std::vector<std::int32_t> elements, std::vector<ElementModel> models,
                    std::vector<bool> turning = {}, bool saves_memory = false)
      : ElasticCells(mesh, std::move(elements), std::move(models)),
        turning_(std::move(turning)),
        saves_memory_(saves_memory) {}
  explicit CorotationalCells(const ElasticCells& same) : ElasticCells(same) {}

  /// Let cells turn that are turned by more than `on` [rad], and no longer those turned by less than `off`.
  /// @returns how many turn
  std::size_t choose_turning(const NodeVector& u, double on, double off);
  const std::vector<bool>& turning() const noexcept { return turning_; }
  void set_turning(const std::vector<bool>& turning) {
    turning_ = turning;
    forget_state();
  }

  double energy(const NodeVector& u) const override;
  double cell_energy(std::size_t cell, const NodeVector& u) const override;
  Mat3 stress(std::size_t cell, const NodeVector& u) const override;
  void add_gradient(const NodeVector& u, NodeVector& gradient, NodeVector& magnitude) const override;
  bool is_linear() const override { return false; }
  void move_to(const NodeVector& u) override;
  void linearize(const NodeVector& u, double clamping) override;
  void add_product(const NodeVector& x, NodeVector& y) const override;
  void add_product(const FloatNodeVector& x, FloatNodeVector& y) const override;
  void add_cell_hessian(std::size_t cell, CellMatrix& h) const override;
  void add_diagonal(std::size_t cell, NodeBlocks& blocks) const override;  ///< that of R K R^T
  Dilatation dilatation(std::size_t cell) const override;
  std::int32_t shared_hessian(std::size_t cell) const override { return turns(cell) ? own_hessian : elements_[cell]; }
  std::size_t bytes() const override;

private:
  /// A cell in its rotated frame at one state; the letters are those of THEORY.md.
  struct Frame {
    Mat3 r, s, inverse_m;
    Mat3 a = Mat3::Zero();  ///< of the stress term, where it is asked for
    CellVector y, f;        ///< R^T (x - mean x); K (y - X)
    Vec3 h;                 ///< M^-1 sum y_a x f_a
  };
  /// The stress term E = T^T A T + T^T L + L^T T, with w = T v the rotation that v causes.
  struct StressTerm {
    Eigen::Matrix<double, 3, 24> t, l;
    Mat3 a;
  };
  using Rows = Eigen::Matrix<double, 3, 24, Eigen::RowMajor>;
  /// Z^T Z is E's positive part, Z = b^T T + c^T L.
  struct PositivePart {
    Mat3 b = Mat3::Zero(), c = Mat3::Zero();
  };

  bool is_at(const NodeVector& u) const { return u.size() == state_.size() && u == state_; }
  void keep_state(const NodeVector& u, bool stressed);
  void forget_state() {
    state_.resize(0);
    positive_.clear();
    single_is_current_ = false;
  }
  void clamp();
  bool turns(std::size_t cell) const { return turning_.empty() || turning_[cell]; }
  bool turns_somewhere(std::size_t batch) const;
  Frame frame(std::size_t cell, const NodeVector& u) const;
  Frame still_frame(std::size_t cell, const NodeVector& u) const;  ///< of a cell that does not turn, R = 1 and M^-1 = 0
  static Mat3 stress_matrix(const Frame& f);                       ///< A
  static void pack(const Frame& f, TurnedCells<double>& cells, std::size_t lane);
  Frame kept_frame(std::size_t cell) const;  ///< at the state, without s
  static Frame unpacked(const TurnedCells<double>& cells, std::size_t lane);
  static StressTerm stress_term(const Frame& f, const NodeGradients& gradient);
  static PositivePart positive_part(const StressTerm& e);
  Frame frame_of_state(std::size_t cell) const;
  void turn(std::size_t batch, TurnedCells<double>& cells) const;
  void keep_single_frames() const;
  const TurnedCells<double>& turned(std::size_t batch, TurnedCells<double>& space) const;
  const TurnedCells<float>& turned(std::size_t batch, TurnedCells<float>& space) const;
  template <class Real>
  const std::vector<TurnedCells<Real>>& kept_frames() const {
    if constexpr (std::is_same_v<Real, double>)
      return frames_;
    else
      return single_frames_;
  }
  template <class Real>
  LaneModels<Real> models_of_batch(std::size_t number) const;
  template <class Vector>
  void add_product_of(const Vector& x, Vector& y) const;

  std::vector<bool> turning_;
  NodeVector state_;         ///< of the last move_to() or linearize(): energy and forces there follow from its frames
  bool is_stressed_ = true;  ///< frames have A
  bool saves_memory_ = false;
  std::vector<TurnedCells<double>> frames_;  ///< at the state, by Mesh::batches(); none if memory is saved
  mutable std::vector<TurnedCells<float>> single_frames_;  ///< copies, made when first asked for
  mutable bool single_is_current_ = false;
  std::vector<PositiveParts> positive_;  ///< by Mesh::batches(); empty where the Hessian is not clamped
  double clamping_ = Hessian::exact;     ///< of the last linearize()
};

/// The paper's co-rotational cell: force R K (R^T x - X) with R from the averaged edges, and R K R^T for its
/// derivative. That force is no gradient of any energy; its cells have a net torque, and equilibrium is approached
/// linearly or not at all. For reproduction and comparison. Source: Nesme, Faure, Payan 2010.
class EdgeRotatedCells final : public ElasticCells {
public:
  using ElasticCells::ElasticCells;
  double cell_energy(std::size_t cell, const NodeVector& u) const override;
  Mat3 stress(std::size_t cell, const NodeVector& u) const override;
  void add_gradient(const NodeVector& u, NodeVector& gradient, NodeVector& magnitude) const override;
  bool is_conservative() const override { return false; }
  bool is_linear() const override { return false; }
  void linearize(const NodeVector& u, double clamping) override;
  void add_product(const NodeVector& x, NodeVector& y) const override;
  void add_product(const FloatNodeVector& x, FloatNodeVector& y) const override;
  void add_cell_hessian(std::size_t cell, CellMatrix& h) const override;
  void add_diagonal(std::size_t cell, NodeBlocks& blocks) const override;
  Dilatation dilatation(std::size_t cell) const override { return dilatation_turned(cell, rotations_[cell]); }
  std::int32_t shared_hessian(std::size_t /*cell*/) const override { return own_hessian; }
  std::size_t bytes() const override;

private:
  template <class Vector>
  void add_product_of(const Vector& x, Vector& y) const;
  Mat3 rotation(const CellVector& moved) const;  ///< of a cell whose corners are displaced by `moved`

  std::vector<Mat3> rotations_;  ///< of the last linearize()
};

/// The elastic energy of a level of a lattice.
/// @param mesh  of that level; must outlive what is returned
std::unique_ptr<ElasticCells> make_elastic_cells(const Mesh& mesh, const hexmesh::Lattice& lattice, int level,
                                                 const ElasticSettings& settings);

}  // namespace hexsolver
