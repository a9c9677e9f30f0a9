// SPDX-License-Identifier: Apache-2.0
#include "terms/elastic.h"

#include <Eigen/LU>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>

#include "core/parallel.h"
#include "hexmesh/core/bytes.h"
#include "kernels/cell_vectors.h"
#include "terms/single_models.h"

namespace hexsolver {

namespace {

/// @param b            int div N dV [mm^2]
/// @param shape        int N_a dV [mm^3]
/// @param shear, bulk  int mu dV, int kappa dV [N mm]
ElementModel make_element_model(const CellMatrix& stiffness, const CellVector& b, const NodeWeights& shape,
                                double volume, double shear, double bulk, Volumetric volumetric) {
  ElementModel model;
  model.set_stiffness(stiffness);
  for (int a = 0; a < 8; ++a) model.mean_gradient.row(a) = b.segment<3>(3 * a) / volume;
  model.mean_shape = shape / volume;
  model.volume = volume;
  model.shear = shear / volume;
  model.bulk = bulk / volume;
  model.mean_dilatation = volumetric == Volumetric::mean;
  return model;
}

}  // namespace

ElementModel make_element_model(const hexmesh::ElementMatrices& matrices, const hexmesh::Element& element,
                                const Mat3& edges, Volumetric volumetric, bool bends) {
  const bool is_mean = volumetric == Volumetric::mean;
  const CellMatrix deviatoric = matrices.deviatoric(element);
  const CellVector divergence = matrices.divergence(element);
  const double volume = element.volume(), bulk = element.total_bulk();
  CellMatrix stiffness = is_mean ? hexmesh::mean_dilatation_stiffness(deviatoric, divergence, bulk, volume)
                                 : CellMatrix(deviatoric + matrices.volumetric(element));
  if (bends) stiffness -= matrices.relaxation(element, !is_mean);
  return make_element_model(stiffness, divergence, matrices.shape(element), volume,
                            hexmesh::shear_of(deviatoric, edges), bulk, volumetric);
}

ElementModel make_element_model(const hexmesh::StoredMatrices& matrices, std::size_t element, const Mat3& edges,
                                Volumetric volumetric) {
  return make_element_model(
      volumetric == Volumetric::mean ? matrices.mean_dilatation_stiffness(element) : matrices.stiffness(element),
      matrices.divergence(element), matrices.shape(element), matrices.volume(element), matrices.shear(element, edges),
      matrices.bulk(element), volumetric);
}

namespace {

/// @param edges  columns = the cell's edge vectors [mm]
NodeGradients gradient_weighted_by(const CellMatrix& stiffness, const Mat3& edges) {
  NodeWeights weights;
  Eigen::Matrix<double, 8, 3> x;
  for (int a = 0; a < 8; ++a) {
    weights[a] = stiffness.block<3, 3>(3 * a, 3 * a).trace();
    for (int d = 0; d < 3; ++d) x(a, d) = hexmesh::corner_bit(a, d);
  }
  weights /= weights.sum();
  x = (x * edges.transpose()).eval();
  x.rowwise() -= (weights.transpose() * x).eval();
  const NodeGradients weighted = weights.asDiagonal() * x;
  const Mat3 spread = x.transpose() * weighted;
  return weighted * spread.inverse();
}

}  // namespace

ElementModel condensed(ElementModel model, const hexmesh::CondensedElement& element, const Mat3& edges) {
  model.set_stiffness(
      hexmesh::mean_dilatation_stiffness(element.stiffness, element.divergence, element.excess, element.volume));
  model.mean_gradient = gradient_weighted_by(model.stiffness, edges);
  CondensedModel& own = model.condensed.emplace();
  own.bulk = element.excess / element.volume;
  for (int a = 0; a < 8; ++a) own.gradient.row(a) = element.divergence.segment<3>(3 * a) / element.volume;
  own.weight = element.weight;
  return model;
}

void ElementModel::set_stiffness(const CellMatrix& k) {
  stiffness = k;
  const auto blocks = hexsolver::mirrored(k);
  mirrored = blocks ? std::make_shared<const MirroredMatrix<double>>(*blocks) : nullptr;
}

Mat3 hooke_stress(const ElementModel& model, const Mat3& strain) {
  return 2 * model.shear * strain + (model.bulk - 2.0 / 3 * model.shear) * strain.trace() * Mat3::Identity();
}

Mat3 cauchy_stress(const Mat3& kirchhoff, double jacobian) {
  constexpr double flat = 1e-6;
  return kirchhoff / std::max(std::abs(jacobian), flat);
}

ElasticCells::ElasticCells(const Mesh& mesh, std::vector<std::int32_t> elements, std::vector<ElementModel> models,
                           std::vector<CellPoints> points)
    : mesh_(mesh),
      elements_(std::move(elements)),
      models_(std::make_shared<const std::vector<ElementModel>>(std::move(models))),
      points_(std::make_shared<const std::vector<CellPoints>>(std::move(points))) {
  for (const CellsOfSize& size : mesh.sizes()) {
    CellVector& corners = corners_.emplace_back();
    for (int a = 0; a < 8; ++a) {
      Vec3 corner;
      for (int d = 0; d < 3; ++d) corner[d] = hexmesh::corner_bit(a, d) - 0.5;
      corners.segment<3>(3 * a) = size.edges * corner;
    }
  }
  measure_rounding();
}

void ElasticCells::measure_rounding() {
  NodeVector sum = NodeVector::Zero(3 * static_cast<Eigen::Index>(mesh_.num_all_nodes()));
  std::vector<CellVector> of_model(models_->size(), CellVector::Constant(-1));
  double energies = 0;
  for (std::size_t c = 0; c < mesh_.num_cells(); ++c) {
    CellVector& of_cell = of_model[elements_[c]];
    const CellVector size = unstressed(c);
    if (of_cell[0] < 0) of_cell = model(c).stiffness.cwiseAbs() * size.cwiseAbs();
    mesh_.scatter_add(c, of_cell, sum);
    energies += of_cell.dot(size.cwiseAbs());
  }
  rounding_ = 50 * std::numeric_limits<double>::epsilon() * sum.norm();
  energy_rounding_ = 4 * std::numeric_limits<double>::epsilon() * energies;
}

void ElasticCells::set_prestretch(const std::vector<Mat3>& of_cells, double part) {
  to_unstressed_.resize(of_cells.size());
  for (std::size_t c = 0; c < of_cells.size(); ++c) {
    const Mat3 by = part * (of_cells[c] - Mat3::Identity());
    to_unstressed_[c] = adds_stretches() ? Mat3(Mat3::Identity() - by) : Mat3((Mat3::Identity() + by).inverse());
  }
}

CellVector ElasticCells::to_unstressed(std::size_t cell, const NodeVector& to_rest) const {
  CellVector out = mesh_.gather(cell, to_rest);
  if (!is_prestretched()) return out;
  Eigen::Map<Eigen::Matrix<double, 3, 8>> of_corner(out.data());
  const Eigen::Map<const Eigen::Matrix<double, 3, 8>> at(corners(cell).data());
  of_corner += (to_unstressed_[cell] - Mat3::Identity()) * (adds_stretches() ? at.eval() : (at + of_corner).eval());
  return out;
}

bool ElasticCells::set_rest(const NodeVector& to_rest) {
  std::atomic<bool> is_inside_out = false;
  if (!on_lattice_) on_lattice_ = OnLattice{elements_, models_, points_};
  if (reshaping() != Reshaping::nothing) {
    auto models = std::make_shared<std::vector<ElementModel>>(mesh_.num_cells());
    auto points = std::make_shared<std::vector<CellPoints>>(reshaping() == Reshaping::points ? mesh_.num_cells()
                                                                                             : std::size_t{0});
    parallel_for(mesh_.num_cells(), [&](std::ptrdiff_t cell) {
      const auto c = static_cast<std::size_t>(cell);
      CellPoints here;
      if (!reshape(points_on_lattice(c), to_unstressed(c, to_rest), here)) {
        is_inside_out = true;
        return;
      }
      ElementModel& model = (*models)[c];
      model = (*on_lattice_->models)[on_lattice_->elements[c]];
      const PointMeans mean = means(here);
      model.mean_gradient = mean.gradient;
      model.volume = mean.volume;
      model.shear = mean.shear / mean.volume;
      model.bulk = mean.bulk / mean.volume;
      if (reshaping() == Reshaping::stiffness) model.set_stiffness(stiffness_by_points(here, model.mean_dilatation));
      if (reshaping() == Reshaping::points) (*points)[c] = std::move(here);
    });
    if (is_inside_out) return false;
    for (std::size_t c = 0; c < elements_.size(); ++c) elements_[c] = static_cast<std::int32_t>(c);
    models_ = std::move(models);
    points_ = std::move(points);
    single_models_.reset();
  }
  to_rest_ = to_rest;
  measure_rounding();
  return true;
}

bool ElasticCells::add_gradient_on_lattice(const NodeVector& to_rest, NodeVector& gradient,
                                           NodeVector& magnitude) const {
  std::atomic<bool> is_inside_out = false;
  mesh_.for_each_cell([&](std::size_t c) {
    const std::optional<CellVector> force = force_on_lattice(c, to_unstressed(c, to_rest));
    if (!force) {
      is_inside_out = true;
      return;
    }
    mesh_.scatter_add(c, *force, gradient);
    mesh_.scatter_add(c, force->cwiseAbs(), magnitude);
  });
  return !is_inside_out;
}

std::size_t ElasticCells::model_bytes() const { return hexmesh::bytes_of(*models_); }
std::size_t ElasticCells::bytes() const {
  std::size_t of_points = hexmesh::bytes_of(*points_);
  for (const CellPoints& p : *points_) of_points += hexmesh::bytes_of(p);
  return hexmesh::bytes_of(elements_) + model_bytes() + of_points + hexmesh::bytes_of(energies_) +
         (single_models_ ? single_models_->stiffness.bytes() + hexmesh::bytes_of(single_models_->mean_gradient) : 0);
}

const ElasticCells::SingleModels& ElasticCells::single_models() const {
  if (!single_models_) {
    auto single = std::make_shared<SingleModels>(SingleModels{CellMatrices<float>(mesh_, elements_), {}});
    single->stiffness.set_shared([&](std::int32_t n) { return (*models_)[n].stiffness; });
    for (const ElementModel& m : *models_) single->mean_gradient.emplace_back(m.mean_gradient.cast<float>());
    single_models_ = std::move(single);
  }
  return *single_models_;
}

Dilatation ElasticCells::rotated_dilatation(std::size_t cell, const Mat3& rotation) const {
  const ElementModel& m = model(cell);
  if (!m.mean_dilatation) return {};
  Dilatation out{CellVector::Zero(), m.condensed ? m.condensed->bulk : m.bulk, m.volume, m.shear};
  const NodeGradients& gradient = m.condensed ? m.condensed->gradient : m.mean_gradient;
  for (int a = 0; a < 8; ++a) out.divergence.segment<3>(3 * a) = m.volume * rotation * gradient.row(a).transpose();
  return out;
}

double ElasticCells::energy(const NodeVector& u) const {
  energies_.resize(mesh_.num_cells());
  mesh_.for_each_cell([&](std::size_t c) { energies_[c] = cell_energy(c, u); });
  return sum_of_energies();
}

double ElasticCells::sum_of_energies() const {
  return Eigen::Map<const Eigen::VectorXd>(energies_.data(), static_cast<Eigen::Index>(energies_.size())).sum();
}

template <class F>
void ElasticCells::for_each_mean(const NodeVector& field, F&& f) const {
  for (std::size_t c = 0; c < mesh_.num_cells(); ++c) {
    const ElementModel& m = model(c);
    const CellVector v = mesh_.gather(c, field);
    Vec3 rest = Vec3::Zero(), average = Vec3::Zero();
    for (int a = 0; a < 8; ++a) {
      const Index3& n = mesh_.nodes()[mesh_.node(c, static_cast<std::size_t>(a))];
      rest += m.mean_shape[a] * (mesh_.edges() * Vec3(n[0], n[1], n[2]));
      average += m.mean_shape[a] * v.segment<3>(3 * a);
    }
    f(c, m.volume, rest, average);
  }
}

ElasticCells::Size ElasticCells::size_in_material(const NodeVector& field, const std::vector<bool>& left_out) const {
  Size size;
  double volumes = 0;
  for_each_mean(field, [&](std::size_t c, double volume, const Vec3&, const Vec3& average) {
    if (!left_out.empty() && left_out[c]) return;
    size.mean += volume * average.norm();
    size.largest = std::max(size.largest, average.norm());
    volumes += volume;
  });
  size.mean /= volumes;
  return size;
}

void ElasticCells::add_to(RigidFit& fit, const NodeVector& u) const {
  for_each_mean(
      u, [&](std::size_t, double volume, const Vec3& rest, const Vec3& average) { fit.add(volume, rest, average); });
}

double ElasticCells::deformation_in_material(const NodeVector& u, const RigidFit& fit) const {
  double sum = 0, volumes = 0;
  for_each_mean(u, [&](std::size_t, double volume, const Vec3& rest, const Vec3& average) {
    sum += volume * fit.deformation(rest, average).norm();
    volumes += volume;
  });
  return sum / volumes;
}

Mat3 ElasticCells::mean_gradient(std::size_t cell, const NodeVector& u) const {
  Mat3 f = mean_elastic_gradient(cell, u);
  if (!is_prestretched()) return f;
  return adds_stretches() ? Mat3(f + to_unstressed_[cell] - Mat3::Identity()) : Mat3(f * to_unstressed_[cell]);
}

Mat3 ElasticCells::mean_elastic_gradient(std::size_t cell, const NodeVector& u) const {
  const CellVector v = moved(cell, u);
  return Mat3::Identity() + Eigen::Map<const Eigen::Matrix<double, 3, 8>>(v.data()) * model(cell).mean_gradient;
}

Jacobians ElasticCells::jacobians(std::size_t cell, const NodeVector& u) const {
  CellVector at_rest = corners(cell), now = at_rest;
  now += mesh_.gather(cell, u);
  if (!is_at_rest_on_lattice()) at_rest += mesh_.gather(cell, to_rest_);
  using Corners = Eigen::Map<const Eigen::Matrix<double, 3, 8>>;
  if (const hexmesh::SubcellMask where = model(cell).subcells; where != 0)
    return jacobians_in_subcells(Corners(now.data()), Corners(at_rest.data()), where);
  const double mean = mean_gradient(cell, u).determinant();
  return {mean, mean, mean > 0 ? 0.0 : 1.0};
}

}  // namespace hexsolver
