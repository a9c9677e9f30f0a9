// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/lattice/check.h"

#include <algorithm>
#include <cmath>

#include "hexmesh/lattice/element_tree.h"

namespace hexmesh {
namespace {

constexpr double single_cell = 1e-12, whole_body = 1e-9;
constexpr std::size_t most_single_cells = 2000;

/// A displacement gradient without symmetry.
Mat3 some_gradient() {
  Mat3 g;
  g << 0.11, -0.05, 0.02, 0.31, 0.23, -0.13, 0.07, 0.04, -0.17;
  return g;
}

/// mu eps:eps + (kappa/2 - mu/3) (tr eps)^2, from the integrals of mu and kappa.
double linear_field_energy(double shear, double bulk, const Mat3& gradient) {
  const Mat3 strain = 0.5 * (gradient + gradient.transpose());
  return shear * strain.squaredNorm() + (bulk / 2 - shear / 3) * strain.trace() * strain.trace();
}

std::array<CellVector, 6> rigid_motions(const Mat3& edges) {
  std::array<CellVector, 6> motions;
  for (int d = 0; d < 3; ++d) {
    for (int a = 0; a < num_cell_nodes; ++a) motions[d].segment<3>(3 * a) = Vec3::Unit(d);
    Mat3 spin = Mat3::Zero();
    spin((d + 1) % 3, (d + 2) % 3) = -1;
    spin((d + 2) % 3, (d + 1) % 3) = 1;
    motions[3 + d] = linear_field(edges, spin);
  }
  return motions;
}

double total(const Element::Weights& w) {
  double sum = 0;
  for (const double v : w) sum += v;
  return sum;
}

double relative(double value, double expected) {
  return std::abs(value - expected) / std::max(std::abs(expected), 1e-300);
}

/// Largest errors of single cells.
struct CellErrors {
  double rigid = 0, energy = 0, mean_energy = 0, divergence = 0, mass = 0, full = 0;

  void add(const ElementMatrices& matrices, const Mat3& edges, const Element& e) {
    const CellMatrix k = matrices.stiffness(e), mean = matrices.mean_dilatation_stiffness(e);
    for (const CellVector& motion : rigid_motions(edges))
      rigid = std::max(rigid, (k * motion).norm() / (k.norm() * motion.norm()));
    const Mat3 gradient = some_gradient();
    const CellVector u = linear_field(edges, gradient);
    const double expected = linear_field_energy(total(e.shear), e.total_bulk(), gradient);
    energy = std::max(energy, relative(0.5 * u.dot(k * u), expected));
    mean_energy = std::max(mean_energy, relative(0.5 * u.dot(mean * u), expected));
    divergence = std::max(divergence, relative(matrices.divergence(e).dot(u), e.volume() * gradient.trace()));
    const NodeWeights lumped = matrices.lumped_mass(e);
    const double lost = lumped.cwiseMin(0).cwiseAbs().maxCoeff() / std::max(e.mass(), 1e-300);
    mass = std::max({mass, e.mass() > 0 ? relative(lumped.sum(), e.mass()) : 0, lost});
  }

  void add_full(const ElementMatrices& matrices, const Element& e, const Material& material, double volume) {
    const CellMatrix expected = matrices.stiffness(full_voxel(material, volume));
    full = std::max(full, (matrices.stiffness(e) - expected).norm() / expected.norm());
  }
};

/// The material of an element that is full of it alone, else nullptr; per element of each level.
std::vector<std::vector<const Material*>> sole_materials(const Lattice& lattice) {
  std::vector<std::vector<const Material*>> sole(lattice.levels.size());
  for (const VoxelMaterial& m : lattice.materials) sole[0].push_back(&m.material);
  for (std::size_t l = 1; l < sole.size(); ++l) {
    const Level& level = lattice.levels[l];
    const Index3& m = level.merge;
    for (const Children& children : level.children) {
      const Material* material = nullptr;
      int count = 0;
      for (const std::int32_t child : children) {
        if (child < 0) continue;
        const Material* of_child = sole[l - 1][child];
        if (count == 0) material = of_child;
        if (of_child != material) material = nullptr;
        ++count;
      }
      sole[l].push_back(count == m[0] * m[1] * m[2] ? material : nullptr);
    }
  }
  return sole;
}

/// How many cells each element has: sums over these round less than sums over a hundred million cells.
std::vector<double> cells_of_elements(const Level& level, std::size_t num_elements) {
  std::vector<double> count(num_elements);
  for (const std::int32_t e : level.element) ++count[as_size(e)];
  return count;
}

void check_topology(const Lattice& lattice, std::vector<Finding>& findings) {
  const Lattice again = build_levels(lattice);
  findings.push_back(
      {"exposed faces are those of the voxels", 0, exposed_faces(lattice) == exposed_faces(again) ? 0.0 : 1.0, 0});
  for (std::size_t l = 0; l < lattice.levels.size(); ++l) {
    const Level &found = lattice.levels[l], &expected = again.levels[l];
    const auto add = [&](const char* property, bool same) {
      findings.push_back({property, static_cast<int>(l), same ? 0.0 : 1.0, 0});
    };
    add("cells are those of the voxels", found.cells == expected.cells && found.merge == expected.merge);
    add("cells are split where those of the voxels are", found.split == expected.split);
    add("labels are those of the voxels", found.segment == expected.segment);
    add("elements are those of the children", found.children == expected.children && found.element == expected.element);
    add("parts are those of the voxels", found.parts == expected.parts);
    add("mixture is that of the voxels", found.mixture == expected.mixture);
    add("gaps are those of the voxels", found.gaps == expected.gaps || found.gaps == OpenGaps{});
  }
}

}  // namespace

std::vector<Finding> check_lattice(const Lattice& lattice) {
  std::vector<Finding> findings;
  check_topology(lattice, findings);

  const double voxel = lattice.voxels.voxel_volume();
  const Level& finest = lattice.levels.front();
  double mass = 0, energy = 0;
  const std::vector<double> voxels = cells_of_elements(finest, lattice.materials.size());
  for (std::size_t n = 0; n < voxels.size(); ++n) {
    const Material& m = lattice.materials[n].material;
    const double v = voxels[n] * voxel;
    mass += m.density * v;
    energy += linear_field_energy(m.shear_modulus() * v, m.bulk_modulus() * v, some_gradient());
  }
  const double volume = static_cast<double>(finest.cells.size()) * voxel;

  const auto sole = sole_materials(lattice);
  ElementTree tree(lattice);
  for (int l = 0; l < lattice.num_levels(); ++l) {
    const Level& level = lattice.level(l);
    const Mat3 edges = lattice.cell_edges(l);
    const double cell_volume = lattice.cell_size(l).prod();
    const ElementMatrices matrices(edges);
    const std::vector<double> cells = cells_of_elements(level, level.filled.size());
    CellErrors errors;
    double level_mass = 0, level_volume = 0, level_energy = 0;
    const std::size_t stride = (level.filled.size() + most_single_cells - 1) / most_single_cells;
    for (std::size_t n = 0; n < level.filled.size(); ++n) {
      const Element e = tree.form(l, static_cast<std::int32_t>(n));
      level_mass += cells[n] * e.mass();
      level_volume += cells[n] * e.volume();
      level_energy += cells[n] * linear_field_energy(total(e.shear), e.total_bulk(), some_gradient());
      if (n % stride != 0) continue;
      errors.add(matrices, edges, e);
      const Material* material = sole[l][n];
      if (material) errors.add_full(matrices, e, *material, cell_volume);
    }
    const auto add = [&](const char* property, double error, double limit) {
      findings.push_back({property, l, error, limit});
    };
    add("volume of the cells is that of the voxels", relative(level_volume, volume), whole_body);
    add("mass of the cells is that of the voxels", mass > 0 ? relative(level_mass, mass) : level_mass, whole_body);
    add("energy of a linear field is the body's", relative(level_energy, energy), whole_body);
    add("rigid motions take no force", errors.rigid, single_cell);
    add("energy of a linear field, each cell", errors.energy, single_cell);
    add("the same with mean dilatation", errors.mean_energy, single_cell);
    add("b . u of a linear field is V div u", errors.divergence, single_cell);
    findings.push_back({"lumped masses are >= 0 and add up", l, errors.mass, single_cell});
    findings.push_back({"full cells are like one large voxel", l, errors.full, single_cell});
  }
  return findings;
}

}  // namespace hexmesh
