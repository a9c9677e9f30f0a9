// SPDX-License-Identifier: Apache-2.0
#include "bodies.h"

#include <Eigen/Geometry>

#include "hexmesh/lattice/embedded_points.h"
#include "terms/make_elastic_cells.h"

namespace testing_support {

using hexsolver::Mesh;
using hexsolver::NodeVector;

hexmesh::LabelVolume make_volume(const Index3& extent, const Vec3& spacing,
                                 const std::function<int(const Index3&)>& label, const Mat3& direction,
                                 const Vec3& origin) {
  hexmesh::Grid grid(extent, spacing, origin, direction);
  hexmesh::LabelVolume volume{grid, std::vector<std::uint16_t>(grid.num_voxels()), {}};
  std::vector<bool> occurs(65536);
  for (std::size_t n = 0; n < volume.labels.size(); ++n) {
    volume.labels[n] = static_cast<std::uint16_t>(label(grid.index(n)));
    occurs[volume.labels[n]] = true;
  }
  for (int l = 1; l < 65536; ++l)
    if (occurs[static_cast<std::size_t>(l)])
      volume.segments.push_back({static_cast<std::uint16_t>(l), "segment_" + std::to_string(l)});
  return volume;
}

hexmesh::LabelVolume stored_as(const hexmesh::LabelVolume& volume, const std::array<int, 3>& order, int flips) {
  Index3 extent;
  Vec3 spacing, first = Vec3::Zero();
  Mat3 direction;
  for (int d = 0; d < 3; ++d) {
    const int s = order[static_cast<std::size_t>(d)];
    const bool flip = (flips >> d & 1) != 0;
    extent[static_cast<std::size_t>(d)] = volume.grid.extent()[static_cast<std::size_t>(s)];
    spacing[d] = volume.grid.spacing()[s];
    direction.col(d) = (flip ? -1.0 : 1.0) * volume.grid.direction().col(s);
    if (flip) first[s] = volume.grid.extent()[static_cast<std::size_t>(s)] - 1;
  }
  hexmesh::LabelVolume out{hexmesh::Grid(extent, spacing, volume.grid.position(first), direction),
                           std::vector<std::uint16_t>(volume.labels.size()), volume.segments};
  for (std::size_t n = 0; n < out.labels.size(); ++n) {
    const Index3 v = out.grid.index(n);
    const Vec3 index = volume.grid.continuous_index(out.grid.position(Vec3(v[0], v[1], v[2])));
    out.labels[n] = volume.labels[volume.grid.offset({static_cast<int>(std::lround(index[0])),
                                                      static_cast<int>(std::lround(index[1])),
                                                      static_cast<int>(std::lround(index[2]))})];
  }
  return out;
}

namespace {

hexmesh::LabelVolume ball_labels(const Vec3& spacing, const Mat3& direction) {
  return make_volume(
      {17, 15, 13}, spacing,
      [](const Index3& v) {
        const Vec3 p(v[0] - 8, v[1] - 7, v[2] - 6);
        const bool ball = p.cwiseQuotient(Vec3(8.3, 7.4, 6.2)).norm() < 1;
        const bool bite = (p - Vec3(6, 5, 4)).norm() < 4.5;
        return ball && !bite ? (p[0] < -2 ? 2 : 1) : 0;
      },
      direction, Vec3(10, -20, 30));
}

}  // namespace

Lattice bitten_ball(const Vec3& spacing, const Index3& offset, const Mat3& direction) {
  const hexmesh::LabelVolume volume = ball_labels(spacing, direction);
  std::vector<hexmesh::LatticeSegment> segments = {
      {volume.segments[0], hexmesh::material_from_units(100, 0.3, 1000), 0, ""},
      {volume.segments[1], hexmesh::material_from_units(700, 0.45, 1900), 0, ""}};
  return hexmesh::build_lattice(volume, segments, {4, offset});
}

Lattice grey_ball(const Vec3& spacing, const Index3& offset, const Mat3& direction) {
  const hexmesh::LabelVolume volume = ball_labels(spacing, direction);
  hexmesh::IntensityVolume scan{volume.grid, std::vector<float>(volume.labels.size())};
  for (std::size_t n = 0; n < scan.values.size(); ++n) scan.values[n] = static_cast<float>(n * 7919 % 10007) * 0.1F;
  hexmesh::GreyLaw density, young, poisson;
  density.offset = 900;
  density.factor = 0.8;
  young.shape = hexmesh::GreyLaw::Shape::power;
  young.of_density = true;
  young.factor = 1e-4;
  young.exponent = 2;
  poisson.shape = hexmesh::GreyLaw::Shape::piecewise;
  poisson.points = {{0, 0.45}, {1000, 0.2}};
  const hexmesh::GreyMaterials grey{&scan, {{std::uint16_t{2}, hexmesh::MaterialRule{young, poisson, density}}}};
  std::vector<hexmesh::LatticeSegment> segments = {
      {volume.segments[0], hexmesh::material_from_units(100, 0.3, 1000), 0, ""},
      {volume.segments[1], hexmesh::Material{}, 0, ""}};
  return hexmesh::build_lattice(volume, segments, {4, offset}, &grey);
}

Lattice box(const Index3& extent, const Vec3& spacing, double young_kpa, double poisson) {
  return one_material(
      extent, spacing, [](const Index3&) { return true; }, young_kpa, poisson);
}

Lattice one_material(const Index3& extent, const Vec3& spacing, const std::function<bool(const Index3&)>& is_filled,
                     double young_kpa, double poisson) {
  const hexmesh::LabelVolume volume =
      make_volume(extent, spacing, [&](const Index3& i) { return is_filled(i) ? 1 : 0; });
  return hexmesh::build_lattice(
      volume, {{volume.segments[0], hexmesh::material_from_units(young_kpa, poisson, 1000), 0, ""}}, {3, {0, 0, 0}});
}

hexmesh::Result displaced(const Lattice& lattice, int level, const std::function<Vec3(const Vec3&)>& field) {
  hexmesh::Result r = hexmesh::rest_state(lattice, level);
  for (const Vec3& x : r.nodes) r.displacement.push_back(field(x));
  move_surface(r);
  return r;
}

Body::Body(const hexsolver::MeshCells& cells, hexsolver::Elasticity elasticity, hexsolver::Volumetric volumetric,
           hexsolver::Rotation rotation)
    : mesh(cells.make_mesh()), potential(mesh) {
  auto term = hexsolver::make_elastic_cells(mesh, cells, {elasticity, rotation, volumetric});
  elastic = term.get();
  potential.add(std::move(term));
}

NodeVector sample(const Mesh& mesh, const std::function<Vec3(const Vec3&)>& field) {
  NodeVector u(static_cast<Eigen::Index>(mesh.num_dofs()));
  for (std::size_t n = 0; n < mesh.num_nodes(); ++n)
    u.segment<3>(3 * static_cast<Eigen::Index>(n)) = field(mesh.position(n));
  return u;
}

NodeVector noise(std::size_t dofs, double size, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-size, size);
  NodeVector u(static_cast<Eigen::Index>(dofs));
  for (double& v : u) v = uniform(random);
  return u;
}

double error_of_single_precision(const hexsolver::Potential& potential, const hexsolver::NodeVector& x) {
  hexsolver::NodeVector y;
  hexsolver::FloatNodeVector single_y;
  potential.apply(x, y);
  potential.apply(x.cast<float>(), single_y);
  return (single_y.cast<double>() - y).norm() / y.norm();
}

Mat3 random_rotation(unsigned seed) {
  const NodeVector q = noise(4, 1, seed);
  return Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized().toRotationMatrix();
}

std::vector<hexsolver::ConstraintPoint> hold_nodes(const Mesh& mesh, const std::function<bool(const Vec3&)>& where,
                                                   const std::function<Vec3(const Vec3&)>& field) {
  std::vector<hexsolver::ConstraintPoint> points;
  std::vector<bool> done(mesh.num_nodes());
  for (std::size_t c = 0; c < mesh.num_cells(); ++c)
    for (int a = 0; a < 8; ++a) {
      const auto node = static_cast<std::size_t>(mesh.cell_nodes()[c][static_cast<std::size_t>(a)]);
      const Vec3 p = mesh.position(node);
      if (done[node] || !where(p)) continue;
      done[node] = true;
      points.push_back({0, static_cast<std::int32_t>(c), hexmesh::NodeWeights::Unit(a), field(p)});
    }
  return points;
}

std::vector<Vec3> displacement_inside(const hexmesh::Result& result, const std::vector<Vec3>& places) {
  std::vector<Vec3> out;
  const hexmesh::EmbeddedPoints points(hexmesh::locator_of(result), result.cell_nodes, places);
  points.interpolate({result.displacement.front().data(), 3 * result.displacement.size()}, out);
  return out;
}

double mean_distance(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
  double sum = 0;
  for (std::size_t n = 0; n < a.size(); ++n) sum += (a[n] - b[n]).norm();
  return sum / static_cast<double>(a.size());
}

}  // namespace testing_support
