// SPDX-License-Identifier: Apache-2.0
#include "terms/prestress.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <cmath>

#include "hexmesh/core/error.h"
#include "hexmesh/lattice/segment_shares.h"
#include "scene/solid_segments.h"
#include "terms/hyperelastic.h"

namespace hexsolver {

using hexmesh::Error;
using hexmesh::ErrorKind;

Vec3 principal_stress(Elasticity law, double shear, double bulk, const Vec3& stretches) {
  if (is_hyperelastic(law)) {
    const Mat3 f = stretches.asDiagonal();
    const EnergyDensity w = energy_density(law, invariants(f - Mat3::Identity()), shear, bulk);
    return first_piola(w, f).diagonal().cwiseProduct(stretches) / stretches.prod();
  }
  const Vec3 strain = stretches - Vec3::Ones();
  const Vec3 hooke = 2 * shear * strain + Vec3::Constant((bulk - 2 * shear / 3) * strain.sum());
  return law == Elasticity::cauchy ? hooke : Vec3(hooke.cwiseProduct(stretches) / stretches.prod());
}

namespace {

constexpr double least_stretch = 0.2, most_stretch = 5;  // as a scene may name them

/// From a stretch under nearly that stress; nothing where Newton's method gets no nearer.
std::optional<Vec3> stretches_under(Elasticity law, double shear, double bulk, const Vec3& stress, Vec3 stretches) {
  constexpr int most_steps = 30, most_halvings = 20;
  constexpr double difference = 1e-6, tolerance = 1e-12;
  const auto misfit = [&](const Vec3& at) -> Vec3 { return principal_stress(law, shear, bulk, at) - stress; };
  Vec3 off = misfit(stretches);
  const bool is_linear = law == Elasticity::cauchy;
  const auto is_one = [&](const Vec3& at) { return is_linear || at.minCoeff() > 0; };
  for (int n = 0; n < most_steps; ++n) {
    if (off.norm() <= tolerance * (shear + bulk)) return stretches;
    Mat3 tangent;
    for (int d = 0; d < 3; ++d) {
      const Vec3 by = difference * Vec3::Unit(d);
      tangent.col(d) = (misfit(stretches + by) - misfit(stretches - by)) / (2 * difference);
    }
    const Vec3 step = -tangent.inverse() * off;
    double part = 1;
    Vec3 next = stretches + step;
    for (int h = 0; h < most_halvings && !(is_one(next) && misfit(next).norm() < off.norm()); ++h)
      next = stretches + (part /= 2) * step;
    if (!(is_one(next) && misfit(next).norm() < off.norm())) break;
    stretches = next;
    off = misfit(stretches);
  }
  constexpr double rounding = 1e-9;
  if (off.norm() <= rounding * (shear + bulk)) return stretches;
  return {};
}

}  // namespace

std::optional<Mat3> stretch_under(Elasticity law, double shear, double bulk, const Mat3& stress) {
  constexpr int parts = 8;
  const Eigen::SelfAdjointEigenSolver<Mat3> axes(stress);
  Vec3 stretches = Vec3::Ones();
  for (int n = 1; n <= parts; ++n) {
    const auto found = stretches_under(law, shear, bulk, n * axes.eigenvalues() / parts, stretches);
    if (!found) return {};
    stretches = *found;
  }
  if (law != Elasticity::cauchy && (stretches.minCoeff() < least_stretch || stretches.maxCoeff() > most_stretch))
    return {};
  return axes.eigenvectors() * stretches.asDiagonal() * axes.eigenvectors().transpose();
}

namespace {

std::uint16_t label_of(const hexmesh::Lattice& lattice, const Prestress& prestress) {
  if (const hexmesh::LatticeSegment* found = find_solid_segment(lattice, prestress.segment))
    return found->segment.label;
  throw Error(ErrorKind::input, fmt::format("{}: segment is '{}', expected one with a material: {}", prestress.where,
                                            prestress.segment, names_of_solid_segments(lattice)));
}

}  // namespace

std::vector<Mat3> find_prestretches(const MeshCells& cells, const std::vector<Prestress>& prestresses,
                                    const ElasticCells& elastic, Elasticity law) {
  const hexmesh::Lattice& lattice = cells.lattice();
  std::vector<Mat3> stretch(cells.size(), Mat3::Identity()), stress(cells.size(), Mat3::Zero());
  std::vector<const Prestress*> stressed(cells.size());
  for (const Prestress& p : prestresses) {
    const std::uint16_t label = label_of(lattice, p);
    std::map<int, std::vector<hexmesh::SegmentShare>> shares;
    for (const MeshCells::OfLevel& of : cells.levels())
      shares[of.level] = hexmesh::shares_of_segment(lattice, of.level, label);
    for (std::size_t c = 0; c < cells.size(); ++c) {
      const auto [level, cell] = cells.place(c);
      const hexmesh::SegmentShare share =
          shares[level][hexmesh::as_size(lattice.level(level).element[hexmesh::as_size(cell)])];
      if (p.stretch) stretch[c] += share.shear * (*p.stretch - Mat3::Identity());
      if (!p.stress || share.volume == 0) continue;
      stress[c] += share.volume * *p.stress;
      stressed[c] = &p;
    }
  }
  for (std::size_t c = 0; c < cells.size(); ++c) {
    if (!stressed[c]) continue;
    const auto under = stretch_under(law, elastic.model(c).shear, elastic.model(c).bulk, stress[c]);
    if (!under)
      throw Error(ErrorKind::input,
                  fmt::format("{} ({}): the law of the scene does not bear that stress at stretches of {:g} to {:g}, "
                              "expected less beside Young's modulus",
                              prestress_name(*stressed[c]), stressed[c]->where, least_stretch, most_stretch));
    stretch[c] += *under - Mat3::Identity();
  }
  return stretch;
}

}  // namespace hexsolver
