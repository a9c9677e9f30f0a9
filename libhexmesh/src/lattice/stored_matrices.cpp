// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/lattice/stored_matrices.h"

#include <algorithm>
#include <cmath>

#include "hexmesh/core/bytes.h"

namespace hexmesh {
namespace {

/// Upper triangle, column by column: (0,0), (0,1), (1,1), (0,2), ...
void append_packed(const CellMatrix& k, std::vector<double>& out) {
  for (int column = 0; column < 24; ++column)
    for (int row = 0; row <= column; ++row) out.push_back(k(row, column));
}

/// K u of a packed K.
CellVector packed_product(const double* packed, const CellVector& u) {
  CellVector product = CellVector::Zero();
  for (int column = 0; column < 24; packed += column + 1, ++column) {
    const Eigen::Map<const Eigen::VectorXd> above(packed, column);
    product.head(column) += u[column] * above;
    product[column] += above.dot(u.head(column)) + packed[column] * u[column];
  }
  return product;
}

template <class Values>
void append_all(const Values& from, std::vector<double>& out) {
  out.insert(out.end(), from.begin(), from.end());
}

/// A strain without change of volume, eps : eps = 6.5.
Mat3 some_shear() {
  Mat3 strain;
  strain << 1, 0.5, -1, 0.5, -0.5, 0.5, -1, 0.5, -0.5;
  return strain;
}

/// A small rotation about no axis in particular.
Mat3 some_rotation() {
  Mat3 spin;
  spin << 0, -0.5, 0.25, 0.5, 0, -1, -0.25, 1, 0;
  return spin;
}

/// @param scale  of what cancels in the value
bool differ(double value, double expected, double scale = 0) {
  return !(std::abs(value - expected) <= 1e-9 * std::abs(expected) + 1e-13 * scale) ||
         std::isinf(expected);  // NaN differs
}

}  // namespace

double shear_of(const CellMatrix& deviatoric, const Mat3& edges) {
  const Mat3 strain = some_shear();
  const CellVector u = linear_field(edges, strain);
  return u.dot(deviatoric * u) / (2 * strain.squaredNorm());
}

void StoredMatrices::append(const ElementMatrices& matrices, const Element& element) {
  append_packed(matrices.stiffness(element), sets_[0].values);
  append_packed(matrices.deviatoric(element), sets_[1].values);
  append_all(matrices.divergence(element), sets_[2].values);
  sets_[3].values.push_back(element.volume());
  sets_[4].values.push_back(element.total_bulk());
  append_all(matrices.lumped_mass(element), sets_[5].values);
  append_all(matrices.shape(element), sets_[6].values);
}

CellMatrix StoredMatrices::mean_dilatation_stiffness(std::size_t element) const {
  return hexmesh::mean_dilatation_stiffness(deviatoric(element), divergence(element), bulk(element), volume(element));
}

CellVector StoredMatrices::divergence(std::size_t element) const {
  return CellVector::Map(&sets_[2].values[24 * element]);
}

std::ptrdiff_t StoredMatrices::find_contradiction(const Mat3& edges) const {
  const CellVector shear = linear_field(edges, some_shear()), swelling = linear_field(edges, Mat3::Identity());
  const CellVector rigid = linear_field(edges, some_rotation()) + CellVector::Constant(edges.cwiseAbs().maxCoeff());
  // A matrix with a value that is not its own resists some rigid motion.
  const auto resists = [&](const auto& force, double largest) {
    return !(force <= 1e-9 * largest * rigid.cwiseAbs().maxCoeff()) || std::isinf(largest);  // NaN does
  };
  for (std::size_t e = 0; e < size(); ++e) {
    const auto packed = [&](std::size_t set) { return &sets_[set].values[packed_size * e]; };
    const auto product = [&](std::size_t set, const CellVector& u) { return packed_product(packed(set), u); };
    const auto resists_rigid = [&](std::size_t set) {
      return resists(product(set, rigid).cwiseAbs().maxCoeff(),
                     Eigen::Map<const Eigen::VectorXd>(packed(set), packed_size).cwiseAbs().maxCoeff());
    };
    const double volume_of = volume(e), bulk_of = bulk(e), of_shear = shear.dot(product(1, shear));
    const bool wrong = !(volume_of > 0) || !(bulk_of > 0) || !(of_shear > 0) || !lumped_mass(e).allFinite() ||
                       differ(shear.dot(product(0, shear)), of_shear, bulk_of) ||
                       differ(swelling.dot(product(0, swelling)), 9 * bulk_of, of_shear) ||
                       differ(divergence(e).dot(swelling), 3 * volume_of) || differ(shape(e).sum(), volume_of) ||
                       resists_rigid(0) || resists_rigid(1) ||
                       resists(std::abs(divergence(e).dot(rigid)), divergence(e).cwiseAbs().maxCoeff());
    if (wrong) return static_cast<std::ptrdiff_t>(e);
  }
  return -1;
}

CellMatrix StoredMatrices::matrix(std::size_t set, std::size_t element) const {
  CellMatrix k;
  const double* next = &sets_[set].values[packed_size * element];
  for (int column = 0; column < 24; ++column)
    for (int row = 0; row <= column; ++row) k(row, column) = k(column, row) = *next++;
  return k;
}

NodeWeights StoredMatrices::weights(std::size_t set, std::size_t element) const {
  return NodeWeights::Map(&sets_[set].values[8 * element]);
}

std::size_t bytes_of(const StoredMatrices& matrices) {
  std::size_t sum = 0;
  for (const StoredMatrices::Set& set : matrices.sets()) sum += bytes_of(set.values);
  return sum;
}

}  // namespace hexmesh
