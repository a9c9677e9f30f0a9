// SPDX-License-Identifier: Apache-2.0
#include "support/plain_equilibrium.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <map>

#include "constraints/select_points.h"
#include "hexmesh/lattice/quadrature.h"
#include "level/grading.h"
#include "mesh/mesh_cells.h"
#include "selection/selection.h"

namespace testing_support {
namespace {

using namespace hexsolver;
using hexmesh::Lattice;
using hexmesh::LatticeSegment;
using hexmesh::Level;
using hexmesh::MaterialPoint;

using Real = long double;

/// Forces of smaller strains than this are measured by those of this one: in them the solver's arithmetic, of 16
/// digits, is seen.
constexpr double least_strain = 1e-7;
using RealMat3 = Eigen::Matrix<Real, 3, 3>;
using RealVec3 = Eigen::Matrix<Real, 3, 1>;
using Corners = Eigen::Matrix<Real, 3, 8>;
using Gradients = Eigen::Matrix<Real, 8, 3>;

/// A point of a cell as its energy knows it.
struct Point {
  Gradients gradients;
  Eigen::Matrix<Real, 8, 1> shape;
  Real volume = 0, shear = 0, bulk = 0, mass = 0;  // integrals over what it stands for
};

Point make_point(const Vec3& s, const Mat3& edges) {
  Point p;
  const RealMat3 inverse = edges.cast<Real>().inverse();
  for (int a = 0; a < 8; ++a) {
    RealVec3 factor, slope;
    for (int d = 0; d < 3; ++d) {
      factor[d] = a >> d & 1 ? s[d] : 1 - s[d];
      slope[d] = a >> d & 1 ? 1 : -1;
    }
    p.shape[a] = factor.prod();
    p.gradients.row(a) =
        RealVec3(slope[0] * factor[1] * factor[2], factor[0] * slope[1] * factor[2], factor[0] * factor[1] * slope[2])
            .transpose() *
        inverse;
  }
  return p;
}

/// 2x2x2 points in each voxel of a cell.
std::vector<Point> points_of_voxels(const Lattice& lattice, const Level& level, const Index3& cell, const Mat3& edges) {
  std::map<int, const hexmesh::Material*> materials;
  for (const LatticeSegment& s : lattice.segments)
    if (s.material) materials[s.segment.label] = &*s.material;
  const double offset = std::sqrt(3.0) / 6;
  const Vec3 n(level.voxels_per_cell[0], level.voxels_per_cell[1], level.voxels_per_cell[2]);
  const double eighth = std::abs(edges.determinant()) / n.prod() / 8;
  std::vector<Point> out;
  for (int k = 0; k < level.voxels_per_cell[2]; ++k)
    for (int j = 0; j < level.voxels_per_cell[1]; ++j)
      for (int i = 0; i < level.voxels_per_cell[0]; ++i) {
        const Index3 local = {i, j, k};
        Index3 voxel;
        bool inside = true;
        for (std::size_t d = 0; d < 3; ++d) {
          voxel[d] = cell[d] * level.voxels_per_cell[d] + local[d];
          inside = inside && voxel[d] < lattice.voxels.extent()[d];
        }
        if (!inside) continue;
        const auto m = materials.find(lattice.labels[lattice.voxels.offset(voxel)]);
        if (m == materials.end()) continue;
        for (int g = 0; g < 8; ++g) {
          const Vec3 in_voxel(g & 1 ? 0.5 + offset : 0.5 - offset, g & 2 ? 0.5 + offset : 0.5 - offset,
                              g & 4 ? 0.5 + offset : 0.5 - offset);
          Point p = make_point((Vec3(i, j, k) + in_voxel).cwiseQuotient(n), edges);
          p.volume = eighth;
          p.shear = eighth * m->second->shear_modulus();
          p.bulk = eighth * m->second->bulk_modulus();
          p.mass = eighth * m->second->density;
          out.push_back(p);
        }
      }
  return out;
}

std::vector<Point> points_of_quadrature(const std::vector<MaterialPoint>& material, const Mat3& edges) {
  std::vector<Point> out;
  for (const MaterialPoint& m : material) {
    Point p = make_point(m.local, edges);
    p.volume = m.volume;
    p.shear = m.shear;
    p.bulk = m.bulk;
    out.push_back(p);
  }
  return out;
}

/// The rotation next to F, a proper one.
RealMat3 rotation_next_to(const RealMat3& f) {
  const Eigen::JacobiSVD<RealMat3> svd(f, Eigen::ComputeFullU | Eigen::ComputeFullV);
  RealMat3 u = svd.matrixU();
  if ((u * svd.matrixV().transpose()).determinant() < 0) u.col(2) *= -1;
  return u * svd.matrixV().transpose();
}

/// int mu dev:dev + mean dilatation, or with the whole of it at each point.
Real quadratic_energy(const std::vector<Point>& points, const Corners& u, Volumetric volumetric) {
  Real energy = 0, dilatation = 0, volume = 0, bulk = 0;
  for (const Point& p : points) {
    const RealMat3 h = u * p.gradients;
    RealMat3 strain = (h + h.transpose()) / 2;
    const Real trace = strain.trace();
    strain.diagonal().array() -= trace / 3;
    energy += p.shear * strain.squaredNorm();
    dilatation += p.volume * trace;
    volume += p.volume;
    bulk += p.bulk;
    if (volumetric == Volumetric::full) energy += p.bulk / 2 * trace * trace;
  }
  if (volumetric == Volumetric::mean) energy += bulk / 2 * (dilatation / volume) * (dilatation / volume);
  return energy;
}

/// W of one point over the integrals of its moduli, THEORY.md, "Laws of large strain".
Real large_strain_energy(const Point& p, const RealMat3& f, Elasticity law, Real dilation_part) {
  const RealMat3 c = f.transpose() * f;
  const Real j = f.determinant(), i1 = c.trace();
  const Real bulk = dilation_part * p.bulk / 2 * (j - 1) * (j - 1);
  switch (law) {
    case Elasticity::green_lagrange: {
      const RealMat3 e = (c - RealMat3::Identity()) / 2;
      return p.shear * (e.squaredNorm() - e.trace() * e.trace() / 3) + p.bulk / 2 * e.trace() * e.trace();
    }
    case Elasticity::neo_hookean:
      return p.shear / 2 * (std::pow(j, Real(-2) / 3) * i1 - 3) + bulk;
    default:
      return p.shear * (Real(2) / 3 * (i1 - 3 - std::log((i1 + 1) / 4)) + (j - 1) * (j - 1) / 12 - (j - 1)) + bulk;
  }
}

Real cell_energy(const std::vector<Point>& points, const Corners& rest, const Corners& u, const Scene& scene) {
  const Elasticity law = scene.elasticity;
  if (law == Elasticity::cauchy) return quadratic_energy(points, u, scene.volumetric);
  if (law == Elasticity::corotational) {
    RealMat3 f = RealMat3::Zero();
    Real volume = 0;
    for (const Point& p : points) {
      f += p.volume * (u * p.gradients);
      volume += p.volume;
    }
    const RealMat3 r = rotation_next_to(f / volume + RealMat3::Identity());
    return quadratic_energy(points, r.transpose() * (rest + u) - rest, scene.volumetric);
  }
  const bool mean = scene.volumetric == Volumetric::mean;
  Real energy = 0, dilatation = 0, volume = 0, bulk = 0;
  for (const Point& p : points) {
    const RealMat3 f = RealMat3::Identity() + u * p.gradients;
    energy += large_strain_energy(p, f, law, mean ? 0 : 1);
    dilatation += p.volume * (f.determinant() - 1);
    volume += p.volume;
    bulk += p.bulk;
  }
  if (mean) energy += bulk / 2 * (dilatation / volume) * (dilatation / volume);
  return energy;
}

/// dW/du by differences of fourth order, over smaller steps where a larger one turns a point inside out.
Corners cell_gradient(const std::vector<Point>& points, const Corners& rest, const Corners& u, const Scene& scene) {
  Real h = 1e-4L * (rest.col(7) - rest.col(0)).cwiseAbs().minCoeff();
  Corners gradient, moved = u;
  for (int n = 0; n < 24; ++n) {
    const auto at = [&](Real by) {
      moved(n % 3, n / 3) = u(n % 3, n / 3) + by;
      return cell_energy(points, rest, moved, scene);
    };
    const auto difference = [&] { return (8 * (at(h) - at(-h)) - (at(2 * h) - at(-2 * h))) / (12 * h); };
    Real slope = difference();
    for (int again = 0; again < 2 && !std::isfinite(slope); ++again) {
      h /= 100;
      slope = difference();
    }
    gradient(n % 3, n / 3) = slope;
    moved(n % 3, n / 3) = u(n % 3, n / 3);
  }
  return gradient;
}

/// Forces on the nodes, and the sum of the sizes of what they are made of.
struct Forces {
  explicit Forces(std::size_t num_nodes)
      : sum(num_nodes, Vec3::Zero()), size(num_nodes, Vec3::Zero()), mass(num_nodes, 0) {}
  void add(std::int32_t node, const Vec3& f) {
    sum[hexmesh::as_size(node)] += f;
    size[hexmesh::as_size(node)] += f.cwiseAbs();
  }
  std::vector<Vec3> sum, size;
  std::vector<double> mass;  // of the nodes
  double rigid = 0;          // that would strain all of the material by 1: what rounding is measured by
};

void add_cells(Forces& forces, const Lattice& lattice, const Scene& scene, const hexmesh::Result& result) {
  const Level& level = lattice.level(result.level);
  hexmesh::QuadratureTree tree(lattice);
  const bool is_large = scene.elasticity != Elasticity::cauchy && scene.elasticity != Elasticity::corotational;
  const Mat3 edges = lattice.cell_edges(result.level);
  for (std::size_t c = 0; c < result.cells.size(); ++c) {
    const std::vector<Point> voxels = points_of_voxels(lattice, level, result.cells[c], edges);
    const std::vector<Point> points =
        is_large ? points_of_quadrature(tree.form(result.level, level.element[c]), edges) : voxels;
    Corners rest, u;
    for (int a = 0; a < 8; ++a) {
      const auto node = hexmesh::as_size(result.cell_nodes[c][hexmesh::as_size(a)]);
      rest.col(a) = (edges * (Vec3(a & 1, a >> 1 & 1, a >> 2) - Vec3::Constant(0.5))).cast<Real>();
      u.col(a) = result.displacement[node].cast<Real>();
    }
    for (const Point& p : points)
      forces.rigid += static_cast<double>((2 * p.shear + p.bulk)) / edges.colwise().norm().minCoeff();
    const Corners gradient = cell_gradient(points, rest, u, scene);
    for (int a = 0; a < 8; ++a) {
      const std::int32_t node = result.cell_nodes[c][hexmesh::as_size(a)];
      forces.add(node, -gradient.col(a).cast<double>());
      double mass = 0;
      for (const Point& p : voxels) mass += static_cast<double>(p.mass * p.shape[a]);
      forces.mass[hexmesh::as_size(node)] += mass;
      forces.add(node, mass * scene.gravity);
    }
  }
}

void spread(Forces& forces, const hexmesh::CellNodes& nodes, const NodeWeights& weights, const Vec3& force) {
  for (int a = 0; a < 8; ++a) forces.add(nodes[hexmesh::as_size(a)], weights[a] * force);
}

Vec3 at_point(const std::vector<Vec3>& field, const hexmesh::CellNodes& nodes, const NodeWeights& weights) {
  Vec3 v = Vec3::Zero();
  for (int a = 0; a < 8; ++a) v += weights[a] * field[hexmesh::as_size(nodes[hexmesh::as_size(a)])];
  return v;
}

void add_loads(Forces& forces, const Scene& scene, const hexmesh::Result& result, Selector& selector) {
  for (const Force& f : scene.forces) {
    const std::vector<SurfacePoint> points = selector.select(f.selection, f.name);
    double whole = 0;
    const auto share = [&](const SurfacePoint& p) {
      return f.selection.on == SurfacePoints::faces ? p.area.norm() : 1;
    };
    for (const SurfacePoint& p : points) whole += share(p);
    for (const SurfacePoint& p : points)
      spread(forces, result.cell_nodes[hexmesh::as_size(p.cell)], p.weights,
             share(p) / whole * f.total - f.pressure * p.area);
  }
  if (scene.contacts.empty()) return;
  for (const SurfacePoint& p : selector.whole_surface())
    for (const Contact& c : scene.contacts) {
      const hexmesh::CellNodes& nodes = result.cell_nodes[hexmesh::as_size(p.cell)];
      const Vec3 x = at_point(result.nodes, nodes, p.weights) + at_point(result.displacement, nodes, p.weights) - c.by;
      Vec3 outward = Vec3::Zero();
      double inside = 0;
      if (const auto* plane = std::get_if<HalfSpace>(&c.obstacle)) {
        outward = plane->normal;
        inside = -outward.dot(x - plane->point);
      } else {
        const Ball& ball = std::get<Ball>(c.obstacle);
        outward = (x - ball.center).normalized();
        inside = ball.radius - (x - ball.center).norm();
      }
      if (inside > 0) spread(forces, nodes, p.weights, c.stiffness * inside * outward);
    }
}

Vec3 prescribed(const Condition& c, const Vec3& rest) {
  if (!c.turn) return c.by;
  const Vec3 arm = rest - c.turn->about;
  return Eigen::AngleAxisd(c.turn->radians, c.turn->axis) * arm - arm;
}

/// Take away along one axis what forces at held points balance: the least squares of |f - H^T r|.
void take_reactions(std::vector<Vec3>& forces, int axis, const std::vector<ConstraintPoint>& points,
                    const hexmesh::Result& result) {
  std::map<std::int32_t, Eigen::Index> rows;  // of the nodes that they hold
  std::vector<const ConstraintPoint*> held;
  for (const ConstraintPoint& p : points)
    if (p.axes[hexmesh::as_size(axis)]) {
      held.push_back(&p);
      for (const std::int32_t node : result.cell_nodes[hexmesh::as_size(p.cell)])
        rows.try_emplace(node, static_cast<Eigen::Index>(rows.size()));
    }
  if (held.empty()) return;
  Eigen::MatrixXd spreading =
      Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(rows.size()), static_cast<Eigen::Index>(held.size()));
  for (std::size_t n = 0; n < held.size(); ++n)
    for (int a = 0; a < 8; ++a)
      spreading(rows[result.cell_nodes[hexmesh::as_size(held[n]->cell)][hexmesh::as_size(a)]],
                static_cast<Eigen::Index>(n)) = held[n]->weights[a] / held[n]->weights.norm();
  Eigen::VectorXd f(spreading.rows());
  for (const auto& [node, row] : rows) f[row] = forces[hexmesh::as_size(node)][axis];
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(spreading);
  Eigen::VectorXd along = qr.householderQ().adjoint() * f;
  along.head(qr.rank()).setZero();
  f = qr.householderQ() * along;
  for (const auto& [node, row] : rows) forces[hexmesh::as_size(node)][axis] = f[row];
}

double norm(const std::vector<Vec3>& field) {
  double sum = 0;
  for (const Vec3& v : field) sum += v.squaredNorm();
  return std::sqrt(sum);
}

}  // namespace

std::optional<PlainEquilibrium> plain_equilibrium(const hexmesh::Lattice& lattice, const Scene& scene,
                                                  const hexmesh::Result& result, const hexmesh::MotionStep* before) {
  const MeshCells cells = cells_for(lattice, scene, result.level);
  if (result.cells != lattice.level(result.level).cells) return {};
  if (scene.elasticity == Elasticity::corotational && scene.rotation == Rotation::edges) return {};
  if (before && scene.damping.stiffness_s > 0) return {};

  Forces forces(result.nodes.size());
  add_cells(forces, lattice, scene, result);
  const Mesh mesh = cells.make_mesh();
  Selector selector(cells, mesh);
  add_loads(forces, scene, result, selector);
  if (before)
    for (std::size_t n = 0; n < result.nodes.size(); ++n) {
      const double mass = forces.mass[n];
      forces.add(static_cast<std::int32_t>(n),
                 -mass * (result.velocity[n] - before->velocity[n]) / scene.dynamics->step);
      forces.add(static_cast<std::int32_t>(n), -mass * scene.damping.mass_per_s * result.velocity[n]);
    }

  PlainEquilibrium out;
  const std::vector<ConstraintPoint> points = select_points(scene, selector);
  out.misfits_mm.resize(scene.conditions.size());
  for (const ConstraintPoint& p : with_face_centers(points)) {
    const auto number = hexmesh::as_size(p.condition);
    const hexmesh::CellNodes& nodes = result.cell_nodes[hexmesh::as_size(p.cell)];
    Vec3 off = at_point(result.displacement, nodes, p.weights) -
               prescribed(scene.conditions[number], at_point(result.nodes, nodes, p.weights));
    for (int d = 0; d < 3; ++d)
      if (!p.axes[hexmesh::as_size(d)]) off[d] = 0;
    out.misfits_mm[number] = std::max(out.misfits_mm[number], off.norm());
  }
  for (int d = 0; d < 3; ++d) take_reactions(forces.sum, d, points, result);
  out.relative_residual = norm(forces.sum) / (norm(forces.size) + least_strain * forces.rigid);
  return out;
}

}  // namespace testing_support
