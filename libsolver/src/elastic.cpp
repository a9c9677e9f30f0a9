// SPDX-License-Identifier: Apache-2.0
#include "hexsolver/elastic.h"

#include <algorithm>
#include <limits>

#include "cell_vectors.h"
#include "hexmesh/core/bytes.h"

namespace hexsolver {

ElementModel make_element_model(const hexmesh::ElementMatrices& matrices, const hexmesh::Element& element,
                                Volumetric volumetric) {
  ElementModel model;
  model.stiffness =
      volumetric == Volumetric::mean ? matrices.mean_dilatation_stiffness(element) : matrices.stiffness(element);
  const CellVector b = matrices.divergence(element) / element.volume();
  for (int a = 0; a < 8; ++a) model.mean_gradient.row(a) = b.segment<3>(3 * a);
  model.mean_shape = matrices.mean_shape(element);
  model.volume = element.volume();
  return model;
}

ElasticCells::ElasticCells(const Mesh& mesh, std::vector<std::int32_t> elements, std::vector<ElementModel> models)
    : mesh_(mesh), elements_(std::move(elements)), models_(std::move(models)) {
  for (int a = 0; a < 8; ++a) {
    Vec3 corner;
    for (int d = 0; d < 3; ++d) corner[d] = hexmesh::corner_bit(a, d) - 0.5;
    rest_.segment<3>(3 * a) = mesh.edges() * corner;
  }
  NodeVector sum = NodeVector::Zero(static_cast<Eigen::Index>(mesh.num_dofs()));
  std::vector<CellVector> of_model;
  for (const ElementModel& m : models_) of_model.push_back(m.stiffness.cwiseAbs() * rest_.cwiseAbs());
  for (std::size_t c = 0; c < mesh.num_cells(); ++c)
    mesh.scatter_add(c, of_model[static_cast<std::size_t>(elements_[c])], sum);
  rounding_ = 50 * std::numeric_limits<double>::epsilon() * sum.norm();
}

std::size_t ElasticCells::bytes() const { return hexmesh::bytes_of(elements_) + hexmesh::bytes_of(models_); }

double ElasticCells::energy(const NodeVector& u) const {
  const std::vector<double> energies = cell_energies(u);
  return Eigen::Map<const Eigen::VectorXd>(energies.data(), static_cast<Eigen::Index>(energies.size())).sum();
}

std::vector<double> CauchyCells::cell_energies(const NodeVector& u) const {
  std::vector<double> energies(mesh_.num_cells());
  mesh_.for_each_cell([&](std::size_t c) {
    const CellVector v = mesh_.gather(c, u);
    energies[c] = 0.5 * v.dot(times(model(c).stiffness, v));
  });
  return energies;
}

void CauchyCells::add_gradient(const NodeVector& u, NodeVector& gradient, NodeVector& magnitude) const {
  mesh_.for_each_cell([&](std::size_t c) {
    const CellVector force = times(model(c).stiffness, mesh_.gather(c, u));
    mesh_.scatter_add(c, force, gradient);
    mesh_.scatter_add(c, force.cwiseAbs(), magnitude);
  });
}

void CauchyCells::add_product(const NodeVector& x, NodeVector& y) const {
  mesh_.for_each_cell([&](std::size_t c) { mesh_.scatter_add(c, times(model(c).stiffness, mesh_.gather(c, x)), y); });
}

ElasticCells::Size ElasticCells::size_in_material(const NodeVector& field, const std::vector<bool>& left_out) const {
  Size size;
  double volume = 0;
  for (std::size_t c = 0; c < mesh_.num_cells(); ++c) {
    if (!left_out.empty() && left_out[c]) continue;
    const ElementModel& m = model(c);
    const CellVector v = mesh_.gather(c, field);
    Vec3 average = Vec3::Zero();
    for (int a = 0; a < 8; ++a) average += m.mean_shape[a] * v.segment<3>(3 * a);
    size.mean += m.volume * average.norm();
    size.largest = std::max(size.largest, average.norm());
    volume += m.volume;
  }
  size.mean /= volume;
  return size;
}

std::unique_ptr<ElasticCells> make_elastic_cells(const Mesh& mesh, std::vector<std::int32_t> elements,
                                                 std::vector<ElementModel> models, Strain strain, Rotation rotation) {
  if (strain == Strain::cauchy) return std::make_unique<CauchyCells>(mesh, std::move(elements), std::move(models));
  if (rotation == Rotation::edges)
    return std::make_unique<EdgeRotatedCells>(mesh, std::move(elements), std::move(models));
  return std::make_unique<CorotationalCells>(mesh, std::move(elements), std::move(models));
}

}  // namespace hexsolver
