// SPDX-License-Identifier: Apache-2.0
#include "linear/gmres.h"

#include <Eigen/Sparse>
#include <unsupported/Eigen/IterativeSolvers>

#include "hexmesh/core/interruption.h"

namespace hexsolver {
class ProductMatrix;
}

namespace Eigen::internal {

template <>
struct traits<hexsolver::ProductMatrix> : traits<SparseMatrix<double>> {};

}  // namespace Eigen::internal

namespace hexsolver {

/// A matrix of which only products are known, as Eigen's solvers ask for it.
class ProductMatrix : public Eigen::EigenBase<ProductMatrix> {
public:
  using Scalar = double;
  using RealScalar = double;
  using StorageIndex = int;
  enum { ColsAtCompileTime = Eigen::Dynamic, MaxColsAtCompileTime = Eigen::Dynamic, IsRowMajor = false };

  ProductMatrix(Eigen::Index size, const GeneralEquation::Map& multiply) : size_(size), multiply_(multiply) {}
  Eigen::Index rows() const { return size_; }
  Eigen::Index cols() const { return size_; }
  template <class Right>
  Eigen::Product<ProductMatrix, Right, Eigen::AliasFreeProduct> operator*(const Eigen::MatrixBase<Right>& x) const {
    return {*this, x.derived()};
  }
  NodeVector times(const NodeVector& x) const {
    NodeVector y;
    multiply_(x, y);
    return y;
  }

private:
  Eigen::Index size_;
  const GeneralEquation::Map& multiply_;
};

}  // namespace hexsolver

namespace Eigen::internal {

template <class Right>
struct generic_product_impl<hexsolver::ProductMatrix, Right, SparseShape, DenseShape, GemvProduct>
    : generic_product_impl_base<hexsolver::ProductMatrix, Right,
                                generic_product_impl<hexsolver::ProductMatrix, Right>> {
  template <class To>
  static void scaleAndAddTo(To& to, const hexsolver::ProductMatrix& matrix, const Right& x, double factor) {
    to.noalias() += factor * matrix.times(x);
  }
};

}  // namespace Eigen::internal

namespace hexsolver {
namespace {

struct Interrupted {};

/// M^-1, as Eigen's solvers ask for it.
class ProductPreconditioner {
public:
  void set(const GeneralEquation::Map& precondition) { precondition_ = &precondition; }
  ProductPreconditioner& compute(const ProductMatrix&) { return *this; }
  Eigen::ComputationInfo info() const { return Eigen::Success; }
  NodeVector solve(const NodeVector& r) const {
    NodeVector z;
    (*precondition_)(r, z);
    return z;
  }

private:
  const GeneralEquation::Map* precondition_ = nullptr;
};

}  // namespace

GmresOutcome solve_by_gmres(const GeneralEquation& equation, const NodeVector& b, const GmresOptions& options,
                            NodeVector& x) {
  const GeneralEquation::Map multiply = [&](const NodeVector& from, NodeVector& to) {
    hexmesh::interruption_point();
    if (options.interrupt && options.interrupt()) throw Interrupted();
    equation.multiply(from, to);
  };
  const ProductMatrix matrix(b.size(), multiply);
  Eigen::GMRES<ProductMatrix, ProductPreconditioner> gmres;
  gmres.compute(matrix);
  gmres.preconditioner().set(equation.precondition);
  gmres.setTolerance(options.relative_tolerance);
  gmres.setMaxIterations(options.most_iterations);
  try {
    x = gmres.solve(b);
  } catch (const Interrupted&) {
    x.setZero(b.size());
    return {0, ConjugateGradients::End::interrupted};
  }
  return {static_cast<int>(gmres.iterations()), ConjugateGradients::End::solved};
}

}  // namespace hexsolver
