// SPDX-License-Identifier: Apache-2.0
#include "terms/stiffness_damping.h"

#include "core/parallel.h"
#include "terms/cauchy.h"
#include "terms/corotational.h"

namespace hexsolver {

StiffnessDamping::StiffnessDamping(const ElasticCells& cells, double seconds) : seconds_(seconds) {
  if (cells.is_linear())
    cells_ = std::make_unique<CauchyCells>(cells);
  else
    cells_ = std::make_unique<CorotationalCells>(cells);
}

void StiffnessDamping::set_step(const NodeVector& u, double h, const NodeVector& frames_at) {
  const Mesh& mesh = cells_->mesh();
  stiffness_ = seconds_ / h;
  if (mesh.num_hanging() == 0) {
    start_ = u;
    cells_->linearize(frames_at, Hessian::without_stress);
    return;
  }
  mesh.spread(frames_at, start_);
  cells_->linearize(start_, Hessian::without_stress);
  mesh.spread(u, start_);
}

void StiffnessDamping::product(const NodeVector& x) const {
  set_zero(product_, x.size());
  cells_->add_product(x, product_);
}

double StiffnessDamping::energy(const NodeVector& u) const {
  moved_ = u - start_;
  product(moved_);
  return stiffness_ / 2 * moved_.dot(product_);
}

void StiffnessDamping::add_gradient(const NodeVector& u, NodeVector& gradient, NodeVector& magnitude) const {
  moved_ = u - start_;
  product(moved_);
  gradient += stiffness_ * product_;
  magnitude += stiffness_ * product_.cwiseAbs();
}

void StiffnessDamping::add_product(const NodeVector& x, NodeVector& y) const {
  product(x);
  y += stiffness_ * product_;
}

void StiffnessDamping::add_product(const FloatNodeVector& x, FloatNodeVector& y) const {
  set_zero(single_product_, x.size());
  cells_->add_product(x, single_product_);
  y += static_cast<float>(stiffness_) * single_product_;
}

void StiffnessDamping::add_cell_hessian(std::size_t cell, CellMatrix& h) const {
  CellMatrix own = CellMatrix::Zero();
  cells_->add_cell_hessian(cell, own);
  h += stiffness_ * own;
}

void StiffnessDamping::add_diagonal(std::size_t cell, NodeBlocks& blocks) const {
  NodeBlocks own;
  own.fill(Mat3::Zero());
  cells_->add_diagonal(cell, own);
  for (std::size_t a = 0; a < 8; ++a) blocks[a] += stiffness_ * own[a];
}

std::size_t StiffnessDamping::bytes() const {
  return cells_->bytes() - cells_->model_bytes() +
         sizeof(double) * static_cast<std::size_t>(start_.size() + moved_.size() + product_.size()) +
         sizeof(float) * static_cast<std::size_t>(single_product_.size());
}

}  // namespace hexsolver
