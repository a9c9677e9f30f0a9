// SPDX-License-Identifier: Apache-2.0
#include "baseline/tet_problem.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>

#include "hexmesh/core/error.h"

namespace hexsolver {

using hexmesh::Error;
using hexmesh::ErrorKind;
using hexmesh::TetMesh;

namespace {

void refuse_unknown(const Scene& scene) {
  const auto refuse = [](const std::string& what) {
    throw Error(ErrorKind::usage, fmt::format("{}, which tetrahedra are not compared with", what));
  };
  if (!scene.contacts.empty()) refuse("the scene has a [[contact]]");
  if (!scene.matches.empty()) refuse("the scene has a [[match]]");
  if (follows(scene)) refuse("the scene has a [[force]] with follows = true");
  if (!scene.prestresses.empty()) refuse("the scene has a [[prestress]]");
  if (scene.loaded) refuse("the scene has solve.reference = \"loaded\"");
  for (const Condition& c : scene.conditions) {
    if (!c.selection.segment.empty()) refuse(fmt::format("condition '{}' acts beside a segment", c.name));
    if (c.history) refuse(fmt::format("condition '{}' has a table", c.name));
  }
  for (const Force& f : scene.forces) {
    if (!f.selection.segment.empty()) refuse(fmt::format("force '{}' acts beside a segment", f.name));
    if (f.history) refuse(fmt::format("force '{}' has a table", f.name));
  }
}

bool contains(const Selection& s, const Vec3& p) {
  if (s.box && s.box->contains(p)) return true;
  if (s.halfspace && (p - s.halfspace->point).dot(s.halfspace->normal) >= -1e-9) return true;
  return std::any_of(s.balls.begin(), s.balls.end(), [&](const Ball& b) { return (p - b.center).norm() <= b.radius; });
}

std::vector<std::size_t> select(const Selection& s, const TetMesh& mesh, const std::vector<std::size_t>& surface) {
  std::vector<std::size_t> out;
  for (const std::size_t n : surface)
    if (contains(s, mesh.points[n])) out.push_back(n);
  if (out.empty() && !s.balls.empty())
    out.push_back(*std::min_element(surface.begin(), surface.end(), [&](std::size_t a, std::size_t b) {
      const auto distance = [&](std::size_t n) { return (mesh.points[n] - s.balls.front().center).norm(); };
      return distance(a) < distance(b);
    }));
  return out;
}

std::vector<hexmesh::Material> materials_of(const TetMesh& mesh, const hexmesh::Lattice& lattice) {
  std::vector<hexmesh::Material> out;
  const hexmesh::Material* first = nullptr;
  for (const hexmesh::LatticeSegment& s : lattice.segments)
    if (s.material && !first) first = &*s.material;
  for (const std::uint16_t label : mesh.segment) {
    const hexmesh::Material* found = label == 0 ? first : nullptr;
    for (const hexmesh::LatticeSegment& s : lattice.segments)
      if (s.segment.label == label && s.material) found = &*s.material;
    if (!found) throw Error(ErrorKind::input, fmt::format("no material for tetrahedra of label {}", label));
    out.push_back(*found);
  }
  return out;
}

/// Spread a force by area, and a pressure against the outward normals, over the triangles whose corners are all chosen;
/// where there is no such triangle the force goes to the nodes evenly.
void add_surface_force(const Force& force, const std::vector<std::size_t>& nodes, TetProblem& problem) {
  const TetMesh& mesh = *problem.mesh;
  std::vector<bool> chosen(mesh.points.size());
  for (const std::size_t n : nodes) chosen[n] = true;
  std::vector<std::pair<std::array<std::int32_t, 3>, Vec3>> faces;
  double whole = 0;
  for (const auto& f : hexmesh::boundary_triangles(mesh)) {
    if (!std::all_of(f.begin(), f.end(), [&](std::int32_t n) { return chosen[static_cast<std::size_t>(n)]; })) continue;
    const auto point = [&](std::size_t a) { return mesh.points[static_cast<std::size_t>(f[a])]; };
    faces.emplace_back(f, (point(1) - point(0)).cross(point(2) - point(0)) / 2);
    whole += faces.back().second.norm();
  }
  for (const auto& [corners, area] : faces)
    for (const std::int32_t n : corners)
      problem.force[static_cast<std::size_t>(n)] += (area.norm() / whole * force.total - force.pressure * area) / 3;
  if (faces.empty())
    for (const std::size_t n : nodes) problem.force[n] += force.total / static_cast<double>(nodes.size());
}

/// Shares of a tetrahedron's mass: the integrals of the shape functions where they are positive; of 10 nodes by the
/// diagonal of the mass matrix, scaled (Hinton, Rock, Zienkiewicz 1976), since the corners' integrals are not.
std::array<double, 10> mass_shares(const TetMesh& mesh) {
  std::array<double, 10> shares{};
  for (std::size_t a = 0; a < 10; ++a)
    shares[a] = !mesh.is_quadratic() ? (a < 4 ? 0.25 : 0) : (a < 4 ? 6.0 : 32.0) / (4 * 6.0 + 6 * 32.0);
  return shares;
}

/// Integrals of the shape functions over the volume.
std::array<double, 10> weight_shares(const TetMesh& mesh) {
  std::array<double, 10> shares{};
  for (std::size_t a = 0; a < 10; ++a) shares[a] = !mesh.is_quadratic() ? (a < 4 ? 0.25 : 0) : (a < 4 ? -0.05 : 0.2);
  return shares;
}

}  // namespace

TetProblem make_tet_problem(const TetMesh& mesh, const hexmesh::Lattice& lattice, const Scene& scene) {
  refuse_unknown(scene);
  const std::size_t num_nodes = mesh.points.size();
  TetProblem problem{&mesh, materials_of(mesh, lattice)};
  problem.held.resize(num_nodes, {false, false, false});
  problem.prescribed.resize(num_nodes, Vec3::Zero());
  problem.force.resize(num_nodes, Vec3::Zero());
  problem.mass.resize(num_nodes, 0);

  std::vector<std::size_t> surface;
  const std::vector<bool> on_surface = hexmesh::surface_nodes(mesh);
  for (std::size_t n = 0; n < num_nodes; ++n)
    if (on_surface[n]) surface.push_back(n);
  const auto chosen = [&](const Selection& selection, const std::string& what) {
    std::vector<std::size_t> nodes = select(selection, mesh, surface);
    if (nodes.empty()) throw Error(ErrorKind::geometry, what + " selects no node of the tetrahedra's surface");
    return nodes;
  };
  for (const Condition& c : scene.conditions) {
    const std::vector<std::size_t> nodes = chosen(c.selection, fmt::format("condition '{}' ({})", c.name, c.where));
    problem.points.push_back(nodes.size());
    for (const std::size_t n : nodes) {
      const Vec3 by = prescribed_displacement(c, mesh.points[n], {1, 0});
      for (std::size_t d = 0; d < 3; ++d)
        if (c.axes[d]) {
          problem.held[n][d] = true;
          problem.prescribed[n][static_cast<Eigen::Index>(d)] = by[static_cast<Eigen::Index>(d)];
        }
    }
  }
  for (const Force& f : scene.forces)
    add_surface_force(f, chosen(f.selection, fmt::format("force '{}' ({})", f.name, f.where)), problem);

  const std::array<double, 10> of_mass = mass_shares(mesh), of_weight = weight_shares(mesh);
  for (std::size_t t = 0; t < mesh.size(); ++t) {
    const double mass = problem.materials[t].density * hexmesh::tet_frame(mesh, t).determinant() / 6;
    for (int a = 0; a < mesh.nodes_each(); ++a) {
      const auto n = static_cast<std::size_t>(mesh.node(t, a));
      problem.mass[n] += of_mass[static_cast<std::size_t>(a)] * mass;
      problem.force[n] += of_weight[static_cast<std::size_t>(a)] * mass * scene.gravity;
    }
  }
  return problem;
}

double size_at_supports(const Scene& scene, double size) {
  double finer = size / 2;
  for (const Condition& c : scene.conditions)
    for (const Ball& b : c.selection.balls)
      if (b.radius > 0) finer = std::min(finer, b.radius / 2);
  return finer;
}

}  // namespace hexsolver
