// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <vtkCell.h>
#include <vtkCellData.h>
#include <vtkDataArray.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPNGReader.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkUnstructuredGrid.h>
#include <vtkXMLPolyDataReader.h>
#include <vtkXMLUnstructuredGridReader.h>

#include <Eigen/Geometry>
#include <Eigen/LU>

#include "hexmesh/surface/extract.h"
#include "hexmesh/view/slice.h"
#include "hexmesh/view/vtk_export.h"
#include "support/bodies.h"
#include "support/files.h"

using namespace hexmesh;
using namespace testing_support;

namespace {

/// A lattice moved by an affine map as if it had been solved.
Result moved(const Lattice& lattice, int level, const Mat3& gradient, const Vec3& shift) {
  const Body body(lattice, level, hexsolver::Elasticity::cauchy);
  Result r{lattice.voxels, lattice.labels, lattice.segments};
  r.level = level;
  r.voxels_per_cell = lattice.levels[static_cast<std::size_t>(level)].voxels_per_cell;
  r.cells = body.mesh.cells();
  r.cell_nodes = body.mesh.cell_nodes();
  for (std::size_t n = 0; n < body.mesh.num_nodes(); ++n) {
    r.nodes.push_back(body.mesh.position(n));
    r.displacement.push_back(gradient * r.nodes.back() + shift);
  }
  r.segment = lattice.levels[static_cast<std::size_t>(level)].segment;
  r.cell_fields["fill"].assign(r.cells.size(), 0.5);
  for (const LatticeSegment& segment : lattice.segments)
    append(r.surface, extract_surface(lattice, segment.segment.label));
  for (const Vec3& p : r.surface.points) r.surface_displacement.push_back(gradient * p + shift);
  return r;
}

}  // namespace

TEST(VtkExport, HexahedraReadBackWithPositiveJacobiansAndTheSameNumbers) {
  const TemporaryFolder folder;
  const Lattice lattice = bitten_ball({1, 1, 2}, {0, 0, 0}, random_rotation(9));
  const Result r = moved(lattice, 1, 0.1 * Mat3::Identity(), {5, 6, 7});
  write_vtu(r, Configuration::deformed, folder / "a.vtu");
  vtkNew<vtkXMLUnstructuredGridReader> reader;
  reader->SetFileName((folder / "a.vtu").c_str());
  reader->Update();
  vtkUnstructuredGrid* grid = reader->GetOutput();
  ASSERT_EQ(grid->GetNumberOfCells(), static_cast<vtkIdType>(r.cells.size()));
  for (vtkIdType c = 0; c < grid->GetNumberOfCells(); ++c) {
    ASSERT_EQ(grid->GetCellType(c), VTK_HEXAHEDRON);
    const auto p = [&](int a) { return Vec3(Vec3::Map(grid->GetCell(c)->GetPoints()->GetPoint(a))); };
    // VTK walks each face in a circle: opposite sides of the two faces are parallel.
    ASSERT_LT((p(2) - p(1) - p(3) + p(0)).norm(), 1e-9);
    ASSERT_LT((p(6) - p(5) - p(7) + p(4)).norm(), 1e-9);
    Mat3 edges;
    edges << p(1) - p(0), p(3) - p(0), p(4) - p(0);
    ASSERT_NEAR(edges.determinant(), lattice.cell_size(1).prod() * 1.1 * 1.1 * 1.1, 1e-9);
  }
  EXPECT_NEAR(grid->GetPointData()->GetArray("displacement")->GetTuple(3)[1], r.displacement[3][1], 1e-12);
  EXPECT_NEAR(grid->GetCellData()->GetArray("fill")->GetTuple1(0), 0.5, 1e-12);
  EXPECT_NE(grid->GetCellData()->GetArray("segment"), nullptr);
}

TEST(VtkExport, TheSurfaceReadsBackAtRestWithItsDisplacement) {
  const TemporaryFolder folder;
  const Result r = moved(bitten_ball({1, 1, 1}), 0, Mat3::Zero(), {1, 2, 3});
  write_vtp(r, Configuration::rest, folder / "a.vtp");
  vtkNew<vtkXMLPolyDataReader> reader;
  reader->SetFileName((folder / "a.vtp").c_str());
  reader->Update();
  vtkPolyData* surface = reader->GetOutput();
  ASSERT_EQ(surface->GetNumberOfPoints(), static_cast<vtkIdType>(r.surface.points.size()));
  EXPECT_LT((Vec3::Map(surface->GetPoint(5)) - r.surface.points[5]).norm(), 1e-12);
  EXPECT_NEAR(surface->GetPointData()->GetArray("displacement")->GetTuple(5)[2], 3, 1e-12);
}

TEST(Slice, ABodyThatDidNotMoveLooksTheSameBeforeAndAfter) {
  const Lattice lattice = bitten_ball({1, 1, 2});
  const Result r = moved(lattice, 1, Mat3::Zero(), Vec3::Zero());
  IntensityVolume scan{lattice.voxels, std::vector<float>(lattice.labels.size())};
  for (std::size_t n = 0; n < scan.values.size(); ++n) scan.values[n] = static_cast<float>(n % 50);
  const SliceRenderer renderer(r, &scan, {});
  const auto [low, high] = renderer.range(SliceAxis::axial);
  const Canvas sheet = renderer.before_and_after(SliceAxis::axial, (low + high) / 2 + 0.01);
  const int half = (sheet.width() - 6) / 2;
  std::size_t differing = 0;
  for (int y = 40; y < sheet.height() - 20; ++y)
    for (int x = 20; x < half - 20; ++x) differing += sheet.at(x, y) != sheet.at(x + half + 6, y);
  EXPECT_LT(static_cast<double>(differing), 0.002 * half * sheet.height());
}

TEST(Slice, AShiftedBodyIsFoundWhereItWentAndFrontIsUp) {
  // One bright voxel column at the front of the body, shifted to the patient's left by 6 mm.
  const Lattice lattice = box({12, 12, 4}, {1, 1, 1});
  IntensityVolume scan{lattice.voxels, std::vector<float>(lattice.labels.size(), 10)};
  for (std::size_t n = 0; n < scan.values.size(); ++n) {
    const Index3 v = lattice.voxels.index(n);
    if (v[0] >= 2 && v[0] <= 3 && v[1] >= 1 && v[1] <= 2) scan.values[n] = 100;
  }
  const Result r = moved(lattice, 0, Mat3::Zero(), {6, 0, 0});
  SliceOptions options;
  options.pixel_mm = 0.25;
  options.level = 50;
  options.window = 100;
  const Canvas sheet = SliceRenderer(r, &scan, options).before_and_after(SliceAxis::axial, 1.5);
  // Letters of 16 pixels, a header of 22, margin 12 mm; the box's corner is at -0.5 mm.
  const auto pixel = [&](double x, double y, bool after) {
    const int left = after ? (sheet.width() - 6) / 2 + 6 : 0;
    return sheet.at(left + 16 + static_cast<int>((x + 12.5) / 0.25), 22 + 16 + static_cast<int>((y + 12.5) / 0.25))[0];
  };
  EXPECT_GT(pixel(2.5, 1.5, false), 240);
  EXPECT_LT(pixel(2.5, 9.5, false), 60);
  EXPECT_GT(pixel(8.5, 1.5, true), 240);
  EXPECT_EQ(pixel(2.5, 1.5, true), 0) << "the place that the body left is black";
}

TEST(Canvas, APngReadsBackWithTheFirstRowOnTop) {
  const TemporaryFolder folder;
  Canvas canvas(4, 3);
  canvas.at(1, 0) = {10, 20, 30};
  canvas.write_png(folder / "a.png");
  vtkNew<vtkPNGReader> reader;
  reader->SetFileName((folder / "a.png").c_str());
  reader->Update();
  EXPECT_EQ(reader->GetOutput()->GetScalarComponentAsDouble(1, 2, 0, 1), 20);
}
