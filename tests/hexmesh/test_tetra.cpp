// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <sstream>

#include "hexmesh/scan/phantom.h"
#include "hexmesh/tetra/mesh_body.h"
#include "hexmesh/tetra/tet_file.h"
#include "support/bodies.h"
#include "support/files.h"
#include "support/tetrahedra.h"

namespace test_tetra {

using namespace hexmesh;
using namespace testing_support;

Vec3 quadratic_field(const Vec3& x) {
  return {0.1 * x[0] * x[1] - x[2], 2 * x[1] - 0.05 * x[2] * x[2], x[0] + 0.2 * x[1] * x[2]};
}

Vec3 linear_field(const Vec3& x) { return {x[0] - 2 * x[1], 3 * x[2] + 1, x[1]}; }

std::vector<Vec3> sampled(const TetMesh& mesh, Vec3 (*field)(const Vec3&)) {
  std::vector<Vec3> out;
  for (const Vec3& p : mesh.points) out.push_back(field(p));
  return out;
}

/// Sum of the outward area vectors, which is zero for a closed surface.
Vec3 sum_of_areas(const TetMesh& mesh) {
  Vec3 sum = Vec3::Zero();
  for (const auto& f : boundary_triangles(mesh)) {
    const auto p = [&](std::size_t a) { return mesh.points[f[a]]; };
    sum += (p(1) - p(0)).cross(p(2) - p(0)) / 2;
  }
  return sum;
}

Lattice two_balls() {
  const LabelVolume volume = make_volume({40, 30, 30}, {2, 2, 2}, [](const Index3& v) {
    const Vec3 p(v[0], v[1], v[2]);
    if ((p - Vec3(14, 15, 15)).norm() < 11) return 1;
    return (p - Vec3(26, 15, 15)).norm() < 9 ? 2 : 0;
  });
  return build_lattice(volume, {{volume.segments[0], material_from_units(10, 0.3, 1000), 0, "given"},
                                {volume.segments[1], material_from_units(20, 0.3, 1000), 0, "given"}});
}

TEST(TetMesh, OfABoxHasItsVolumeAndSurface) {
  const Vec3 size(3, 2, 1);
  const TetMesh linear = box_of_tets(size, {3, 2, 2}), mesh = quadratic(linear);
  EXPECT_NEAR(volume(mesh), size.prod(), 1e-12);
  EXPECT_EQ(boundary_triangles(mesh).size(), 2U * 2 * (3 * 2 + 3 * 2 + 2 * 2));
  EXPECT_LT(sum_of_areas(mesh).norm(), 1e-12);
  // Nodes of a 7 x 5 x 5 grid, the middles of edges among them.
  EXPECT_EQ(mesh.points.size(), 7U * 5 * 5);
  const std::vector<bool> on_surface = surface_nodes(mesh);
  for (std::size_t n = 0; n < mesh.points.size(); ++n) {
    const Vec3& p = mesh.points[n];
    const bool at_border = (p.array() < 1e-12).any() || (p.array() > size.array() - 1e-12).any();
    EXPECT_EQ(on_surface[n], at_border) << p.transpose();
  }
}

TEST(TetField, ReproducesPolynomialsOfItsOrder) {
  const TetMesh linear = box_of_tets({3, 2, 1}, {3, 2, 2}), mesh = quadratic(linear);
  const TetField of_linear(linear), of_quadratic(mesh);
  const auto u = sampled(linear, linear_field), v = sampled(mesh, quadratic_field);
  for (int n = 0; n < 200; ++n) {
    const Vec3 p = Vec3(1.5, 1, 0.5) + 0.5 * Vec3(3, 2, 1).cwiseProduct(Vec3::Map(noise(3, 1, 1 + n).data()));
    EXPECT_LT((of_linear.at(p, u) - linear_field(p)).norm(), 1e-12);
    EXPECT_LT((of_quadratic.at(p, v) - quadratic_field(p)).norm(), 1e-12);
  }
  // Outside it goes on as inside.
  EXPECT_LT((of_linear.at({-0.5, 1, 1.2}, u) - linear_field({-0.5, 1, 1.2})).norm(), 1e-12);
}

TEST(MeshBody, HasTheVolumesOfTheSegmentsAndAClosedSurface) {
  const Lattice lattice = two_balls();
  TetSizes sizes{4};
  sizes.finer.push_back({lattice.voxels.position(Vec3(0, 11, 11)), 6, 2});
  const TetMesh mesh = mesh_body(lattice, sizes);
  std::map<std::uint16_t, double> volumes;
  double shortest_near = 1e9;
  for (std::size_t t = 0; t < mesh.size(); ++t) {
    const double six = tet_frame(mesh, t).determinant();
    ASSERT_GT(six, 0);
    volumes[mesh.segment[t]] += six / 6;
    const Vec3& p = mesh.points[mesh.corners[t][0]];
    if ((p - sizes.finer[0].center).norm() < 6) shortest_near = std::min(shortest_near, std::cbrt(six));
  }
  // Facets may cut a tenth of their size, 0.4 mm, off balls of about 20 mm: 6 % of the volume at most. Smoothing by a
  // voxel rounds the sharp rim where the balls meet.
  std::size_t voxels = 0;
  for (const LatticeSegment& s : lattice.segments) {
    EXPECT_NEAR(volumes[s.segment.label] / (8.0 * static_cast<double>(s.num_voxels)), 1, 0.07) << s.segment.name;
    voxels += s.num_voxels;
  }
  EXPECT_NEAR(volume(mesh) / (8.0 * static_cast<double>(voxels)), 1, 0.06);
  EXPECT_LT(sum_of_areas(mesh).norm(), 1e-9 * volume(mesh));
  EXPECT_LT(shortest_near, 2.5);
  const TetMesh again = mesh_body(lattice, sizes);
  EXPECT_EQ(again.corners, mesh.corners);
  EXPECT_EQ(again.points, mesh.points);
}

TEST(MeshBody, FinerTetrahedraComeNearerToTheBall) {
  const LabelVolume ball = make_volume({44, 44, 44}, {1, 1, 1}, [](const Index3& v) {
    return (Vec3(v[0], v[1], v[2]) - Vec3::Constant(21.5)).norm() < 20 ? 1 : 0;
  });
  const Lattice lattice = build_lattice(ball, {{ball.segments[0], material_from_units(10, 0.3, 1000), 0, "given"}});
  double before = 1e9;
  for (const double size : {12.0, 6.0, 3.0}) {
    const TetMesh mesh = mesh_body(lattice, {size});
    double worst = 0;
    const std::vector<bool> on_surface = surface_nodes(mesh);
    for (std::size_t n = 0; n < mesh.points.size(); ++n)
      if (on_surface[n]) worst = std::max(worst, std::abs((mesh.points[n] - Vec3::Constant(21.5)).norm() - 20));
    EXPECT_LT(worst, 0.3) << size;  // nodes lie on the smoothed surface
    const double missing = std::abs(volume(mesh) / (4.0 / 3 * std::numbers::pi * 8000) - 1);
    EXPECT_LT(missing, before);
    before = missing;
  }
  EXPECT_LT(before, 0.01);
}

TEST(TetFile, ReadsTheSameMeshFromEveryFormat) {
  TemporaryFolder folder;
  // Two tetrahedra, the second inside out, numbers with gaps, a triangle among them.
  const std::string nodes = "10 0 0 0\n20 1 0 0\n30 0 1 0\n40 0 0 1\n50 1 1 1\n";
  write_text(folder / "a.msh", "$NOD\n5\n" + nodes +
                                   "$ENDNOD\n$ELM\n3\n1 4 1 1 4 10 20 30 40\n2 2 1 1 3 10 20 30\n"
                                   "3 4 1 1 4 20 40 30 50\n$ENDELM\n");
  write_text(folder / "b.msh", "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n5\n" + nodes +
                                   "$EndNodes\n$Elements\n3\n1 4 2 7 7 10 20 30 40\n2 2 2 7 7 10 20 30\n"
                                   "3 4 2 7 7 20 40 30 50\n$EndElements\n");
  write_text(folder / "c.msh",
             "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes\n2 5 10 50\n2 1 0 2\n10\n20\n0 0 0\n1 0 0\n3 1 0 3\n30\n40\n"
             "50\n0 1 0\n0 0 1\n1 1 1\n$EndNodes\n$Elements\n2 3 1 3\n2 1 2 1\n2 10 20 30\n3 1 4 2\n1 10 20 30 40\n"
             "3 20 40 30 50\n$EndElements\n");
  write_text(
      folder / "d.inp",
      "** a deck\n*NODE, NSET=all\n10, 0, 0, 0\n20, 1., 0, 0\n30, 0, 1, 0\n40, 0, 0, 1\n50, 1, 1, 1\n"
      "*Element, type=C3D4, elset=body\n1, 10, 20, 30, 40\n3, 20, 40,\n30, 50\n*ELEMENT, TYPE=S3\n9, 10, 20, 30\n"
      "*MATERIAL, NAME=x\n1, 2\n");
  write_text(
      folder / "e.vtu",
      "<VTKFile type=\"UnstructuredGrid\" version=\"0.1\" byte_order=\"LittleEndian\"><UnstructuredGrid><Piece "
      "NumberOfPoints=\"6\" NumberOfCells=\"3\"><Points><DataArray type=\"Float64\" NumberOfComponents=\"3\" "
      "format=\"ascii\">0 0 0 1 0 0 0 1 0 0 0 1 1 1 1 9 9 9</DataArray></Points><Cells><DataArray type=\"Int64\" "
      "Name=\"connectivity\" format=\"ascii\">0 1 2 3 0 1 2 1 3 2 4</DataArray><DataArray type=\"Int64\" "
      "Name=\"offsets\" format=\"ascii\">4 7 11</DataArray><DataArray type=\"UInt8\" Name=\"types\" "
      "format=\"ascii\">10 5 10</DataArray></Cells></Piece></UnstructuredGrid></VTKFile>");
  const TetMesh first = read_tetrahedra(folder / "a.msh");
  EXPECT_EQ(first.points.size(), 5U);
  EXPECT_NEAR(volume(first), 1.0 / 6 + 1.0 / 3, 1e-12);
  for (const char* name : {"b.msh", "c.msh", "d.inp", "e.vtu"}) {
    const TetMesh mesh = read_tetrahedra(folder / name);
    EXPECT_EQ(mesh.points, first.points) << name;
    EXPECT_EQ(mesh.corners, first.corners) << name;
  }
}

TEST(TetFile, KeepsMiddleNodesInTheirPlaces) {
  TemporaryFolder folder;
  // Gmsh and Abaqus order the last two middle nodes differently; one is written inside out.
  TetMesh mesh = quadratic(box_of_tets({1, 1, 1}, {1, 1, 1}));
  std::ostringstream nodes, deck_nodes, gmsh, abaqus;
  for (std::size_t n = 0; n < mesh.points.size(); ++n) {
    const Vec3& p = mesh.points[n];
    nodes << n + 1 << ' ' << p[0] << ' ' << p[1] << ' ' << p[2] << '\n';
    deck_nodes << n + 1 << ',' << p[0] << ',' << p[1] << ',' << p[2] << '\n';
  }
  for (std::size_t t = 0; t < mesh.size(); ++t) {
    gmsh << t + 1 << " 11 0";
    for (const int a : {0, 1, 2, 3, 4, 5, 6, 7, 9, 8}) gmsh << ' ' << mesh.node(t, a) + 1;
    gmsh << '\n';
    abaqus << t + 1;
    for (const int a : {0, 2, 1, 3, 6, 5, 4, 7, 9, 8}) abaqus << ", " << mesh.node(t, a) + 1;  // 1 and 2 exchanged
    abaqus << '\n';
  }
  write_text(folder / "a.msh", "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n27\n" + nodes.str() +
                                   "$EndNodes\n$Elements\n6\n" + gmsh.str() + "$EndElements\n");
  write_text(folder / "a.inp", "*NODE\n" + deck_nodes.str() + "*ELEMENT, TYPE=C3D10\n" + abaqus.str());
  for (const char* file : {"a.msh", "a.inp"}) {
    const TetMesh read = read_tetrahedra(folder / file);
    ASSERT_TRUE(read.is_quadratic());
    EXPECT_NEAR(volume(read), 1, 1e-12);
    for (std::size_t t = 0; t < read.size(); ++t)
      for (std::size_t e = 0; e < 6; ++e) {
        const auto at = [&](int a) { return read.points[read.node(t, a)]; };
        const Vec3 middle = (at(tet_edges[e][0]) + at(tet_edges[e][1])) / 2;
        EXPECT_LT((at(4 + static_cast<int>(e)) - middle).norm(), 1e-6) << file;
      }
  }
}

TEST(TetFile, RefusesWhatItCannotUse) {
  TemporaryFolder folder;
  const auto refusal = [&](const std::string& name, const std::string& text) {
    write_text(folder / name, text);
    return message_of(ErrorKind::input, [&] { read_tetrahedra(folder / name); });
  };
  const auto contains = [](const std::string& message, const char* word) {
    EXPECT_NE(message.find(word), std::string::npos) << message;
  };
  contains(refusal("a.stl", ""), "expected .vtu, .msh or .inp");
  contains(refusal("a.msh", "$NOD\n1\n1 0 0 0\n$ENDNOD\n"), "no tetrahedra");
  contains(refusal("b.msh", "$NOD\n1\n1 0 0 0\n$ENDNOD\n$ELM\n1\n1 4 1 1 4 1 2 3 4\n$ENDELM\n"), "node 2");
  contains(refusal("c.msh", "$MeshFormat\n4.1 1 8\n"), "binary");
  contains(refusal("d.msh", "$NOD\n3\n1 0 0\n"), "coordinate");
  contains(refusal("e.inp", "*NODE\n1, 0, x, 0\n"), "'1, 0, x, 0'");
  contains(refusal("f.inp", "*NODE\n1,0,0,0\n2,1,0,0\n3,0,1,0\n4,1,1,0\n*ELEMENT,TYPE=C3D4\n1,1,2,3,4\n"), "flat");
  contains(refusal("g.vtu", "no xml"), "unstructured grid");
}

}  // namespace test_tetra
