// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <hdf5.h>
#include <vtkCell.h>
#include <vtkCellData.h>
#include <vtkDataArray.h>
#include <vtkFieldData.h>
#include <vtkHDFReader.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPNGReader.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkStringArray.h>
#include <vtkUnstructuredGrid.h>
#include <vtkXMLPolyDataReader.h>
#include <vtkXMLUnstructuredGridReader.h>

#include <Eigen/Geometry>
#include <Eigen/LU>

#include "hexmesh/core/error.h"
#include "hexmesh/file/vtkhdf.h"
#include "hexmesh/surface/extract.h"
#include "hexmesh/view/slice.h"
#include "hexmesh/view/vtk_export.h"
#include "support/bodies.h"
#include "support/files.h"

namespace test_view {

using namespace hexmesh;
using namespace testing_support;

/// A lattice with the surfaces of its segments moved by an affine map as if it had been solved.
Result moved(Lattice lattice, int level, const Mat3& gradient, const Vec3& shift) {
  for (const LatticeSegment& segment : lattice.segments)
    append(lattice.surface, extract_surface(lattice, segment.segment.label));
  return displaced(lattice, level, [&](const Vec3& x) -> Vec3 { return gradient * x + shift; });
}

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
  EXPECT_NEAR(grid->GetCellData()->GetArray("fill")->GetTuple1(0), r.cell_fields.at("fill")[0], 1e-12);
  EXPECT_NE(grid->GetCellData()->GetArray("segment"), nullptr);
}

TEST(VtkExport, FieldNamesOfAFileDoNotBreakTheXml) {
  const TemporaryFolder folder;
  Result r = moved(bitten_ball({1, 1, 1}), 1, Mat3::Zero(), {1, 2, 3});
  const std::string odd = "a<b & \"c\"";
  r.cell_fields[odd] = r.cell_fields.at("fill");
  r.cell_fields["red\x1b[31m"] = r.cell_fields.at("fill");
  r.cell_fields["l\xe9"] = r.cell_fields.at("fill");
  write_vtu(r, Configuration::rest, folder / "a.vtu");
  vtkNew<vtkXMLUnstructuredGridReader> reader;
  reader->SetFileName((folder / "a.vtu").c_str());
  reader->Update();
  ASSERT_EQ(reader->GetOutput()->GetNumberOfCells(), static_cast<vtkIdType>(r.cells.size()));
  for (const std::string& name : {odd, std::string("red\\x1b[31m"), std::string("l\\xe9")})
    EXPECT_NE(reader->GetOutput()->GetCellData()->GetArray(name.c_str()), nullptr) << name;
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
  const auto [low, high] = renderer.range(Vec3::UnitZ());
  const Canvas sheet = renderer.draw(plane_across(SliceAxis::axial, (low + high) / 2 + 0.01));
  const int half = (sheet.width() - 6) / 2;
  std::size_t differing = 0;
  for (int y = 44; y < sheet.height() - 40; ++y)
    for (int x = 22; x < half - 22; ++x) differing += sheet.at(x, y) != sheet.at(x + half + 6, y);
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
  const Canvas sheet = SliceRenderer(r, &scan, options).draw(plane_across(SliceAxis::axial, 1.5));
  // Letters of 22 pixels, a header of 22, margin 12 mm; the box's corner is at -0.5 mm.
  const auto pixel = [&](double x, double y, bool after) {
    const int left = after ? (sheet.width() - 6) / 2 + 6 : 0;
    return sheet.at(left + 22 + static_cast<int>((x + 12.5) / 0.25), 22 + 22 + static_cast<int>((y + 12.5) / 0.25))[0];
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

TEST(VtkExport, NamesColoursAndUnitsSurvive) {
  const TemporaryFolder folder;
  const Result r = moved(bitten_ball({1, 1, 1}), 1, Mat3::Zero(), {1, 2, 3});
  write_vtp(r, Configuration::deformed, folder / "a.vtp");
  vtkNew<vtkXMLPolyDataReader> reader;
  reader->SetFileName((folder / "a.vtp").c_str());
  reader->Update();
  vtkPolyData* surface = reader->GetOutput();
  EXPECT_LT((Vec3::Map(surface->GetPoint(5)) - r.surface.points[5] - Vec3(1, 2, 3)).norm(), 1e-12);
  auto* names = vtkStringArray::SafeDownCast(surface->GetFieldData()->GetAbstractArray("segments"));
  ASSERT_NE(names, nullptr);
  for (std::size_t s = 0; s < r.segments.size(); ++s) {
    const Segment& segment = r.segments[s].segment;
    EXPECT_EQ(names->GetValue(static_cast<vtkIdType>(s)), std::to_string(segment.label) + " = " + segment.name);
  }
  EXPECT_NE(surface->GetFieldData()->GetAbstractArray("units"), nullptr);
  vtkDataArray* colors = surface->GetCellData()->GetArray("segment_color");
  ASSERT_EQ(colors->GetDataType(), VTK_UNSIGNED_CHAR);
  for (vtkIdType c = 0; c < surface->GetNumberOfCells(); c += 97) {
    const auto label = static_cast<std::uint16_t>(surface->GetCellData()->GetArray("segment")->GetTuple1(c));
    const Rgb expected = to_rgb(r.segments[label - 1U].segment.color);
    for (int d = 0; d < 3; ++d) ASSERT_EQ(colors->GetComponent(c, d), expected[d]);
  }
}

TEST(VtkExport, ConditionsReadBackWithNamesAndReactions) {
  const TemporaryFolder folder;
  Result r = moved(bitten_ball({1, 1, 1}), 1, Mat3::Zero(), {1, 2, 3});
  r.conditions = {{"held", {{1, 2, 3}, {4, 5, 6}}, {{0, 0, 0}, {0, 0, 0}}, {true, true, true}},
                  {"pulled, a bit", {{7, 8, 9}}, {{0, 0, 2}}, {false, false, true}}};
  write_conditions_vtp(r, {{"held", {1, 0, -1}}, {"pulled, a bit", {0, 0, 5}}}, Configuration::deformed,
                       folder / "a.vtp");
  vtkNew<vtkXMLPolyDataReader> reader;
  reader->SetFileName((folder / "a.vtp").c_str());
  reader->Update();
  vtkPolyData* set = reader->GetOutput();
  ASSERT_EQ(set->GetNumberOfPoints(), 3);
  EXPECT_EQ(set->GetNumberOfVerts(), 3);
  EXPECT_LT((Vec3::Map(set->GetPoint(2)) - Vec3(7, 8, 11)).norm(), 1e-12);
  auto* names = vtkStringArray::SafeDownCast(set->GetPointData()->GetAbstractArray("name"));
  ASSERT_NE(names, nullptr);
  EXPECT_EQ(names->GetValue(1), "held");
  EXPECT_EQ(names->GetValue(2), "pulled, a bit");
  EXPECT_EQ(set->GetPointData()->GetArray("reaction")->GetComponent(0, 2), -1);
  EXPECT_EQ(set->GetPointData()->GetArray("reaction")->GetComponent(2, 2), 5);
  EXPECT_EQ(set->GetPointData()->GetArray("axes")->GetComponent(2, 0), 0);
}

TEST(VtkExport, ObstaclesAreWhereTheyAre) {
  const TemporaryFolder folder;
  const Bounds body{{-10, -20, -30}, {10, 20, 30}};
  const Vec3 normal = Vec3(1, 2, 2).normalized();
  write_obstacles_vtp({{HalfSpace{{1, 2, 3}, normal}, "table"}, {Ball{{40, 50, 60}, 7}, "ball"}}, body,
                      folder / "a.vtp");
  vtkNew<vtkXMLPolyDataReader> reader;
  reader->SetFileName((folder / "a.vtp").c_str());
  reader->Update();
  vtkPolyData* set = reader->GetOutput();
  auto* names = vtkStringArray::SafeDownCast(set->GetCellData()->GetAbstractArray("name"));
  ASSERT_NE(names, nullptr);
  std::array<int, 2> faces = {0, 0};
  for (vtkIdType f = 0; f < set->GetNumberOfCells(); ++f) {
    const int number = static_cast<int>(set->GetCellData()->GetArray("obstacle")->GetTuple1(f));
    EXPECT_EQ(names->GetValue(f), number == 0 ? "table" : "ball");
    ++faces[static_cast<std::size_t>(number)];
    for (vtkIdType p = 0; p < set->GetCell(f)->GetNumberOfPoints(); ++p) {
      const Vec3 x = Vec3::Map(set->GetPoint(set->GetCell(f)->GetPointId(p)));
      EXPECT_NEAR(number == 0 ? (x - Vec3(1, 2, 3)).dot(normal) : (x - Vec3(40, 50, 60)).norm() - 7, 0, 1e-5);
    }
  }
  EXPECT_EQ(faces[0], 1);
  EXPECT_GT(faces[1], 1000);
}

TEST(VtkExport, VtkReadsTheHdfFileWithTheSameNumbersAsTheVtu) {
  const TemporaryFolder folder;
  const Result r = moved(bitten_ball({1, 1, 2}, {0, 0, 0}, random_rotation(9)), 1, 0.1 * Mat3::Identity(), {5, 6, 7});
  write_vtu(r, Configuration::deformed, folder / "a.vtu");
  write_vtkhdf(r, true, folder / "a.hdf");
  const hid_t file = H5Fopen((folder / "a.hdf").c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  const hid_t attribute = H5Aopen_by_name(file, "/VTKHDF", "Type", H5P_DEFAULT, H5P_DEFAULT);
  const hid_t type = H5Aget_type(attribute);
  EXPECT_EQ(H5Tget_cset(type), H5T_CSET_ASCII) << "which ParaView 5.11 asks for";
  EXPECT_EQ(H5Tis_variable_str(type), 0);
  H5Tclose(type);
  H5Aclose(attribute);
  H5Fclose(file);
  vtkNew<vtkXMLUnstructuredGridReader> xml;
  xml->SetFileName((folder / "a.vtu").c_str());
  xml->Update();
  vtkNew<vtkHDFReader> hdf;
  ASSERT_TRUE(hdf->CanReadFile((folder / "a.hdf").c_str()));
  hdf->SetFileName((folder / "a.hdf").c_str());
  hdf->Update();
  vtkUnstructuredGrid* a = xml->GetOutput();
  auto* b = vtkUnstructuredGrid::SafeDownCast(hdf->GetOutput());
  ASSERT_NE(b, nullptr);
  ASSERT_EQ(a->GetNumberOfPoints(), b->GetNumberOfPoints());
  ASSERT_EQ(a->GetNumberOfCells(), b->GetNumberOfCells());
  for (vtkIdType p = 0; p < a->GetNumberOfPoints(); ++p)
    for (int d = 0; d < 3; ++d) {
      ASSERT_EQ(a->GetPoint(p)[d], b->GetPoint(p)[d]);
      ASSERT_EQ(a->GetPointData()->GetArray("displacement")->GetComponent(p, d),
                b->GetPointData()->GetArray("displacement")->GetComponent(p, d));
    }
  for (vtkIdType c = 0; c < a->GetNumberOfCells(); ++c) {
    ASSERT_EQ(b->GetCellType(c), VTK_HEXAHEDRON);
    for (int n = 0; n < 8; ++n) ASSERT_EQ(a->GetCell(c)->GetPointId(n), b->GetCell(c)->GetPointId(n));
    for (const char* name : {"segment", "fill"})
      ASSERT_EQ(a->GetCellData()->GetArray(name)->GetTuple1(c), b->GetCellData()->GetArray(name)->GetTuple1(c));
  }
}

TEST(Slice, LettersNameWhereDirectionsPointTo) {
  EXPECT_EQ(orientation_letters({1, 0, 0}), "L");
  EXPECT_EQ(orientation_letters({-1, 0, 0.1}), "R");
  EXPECT_EQ(orientation_letters({0, -1, 0}), "A");
  EXPECT_EQ(orientation_letters({0.5, 0, -1}), "IL");
}

TEST(Slice, AnObliquePlaneAlongAnAxisIsThatSlice) {
  for (const SliceAxis axis : {SliceAxis::axial, SliceAxis::coronal, SliceAxis::sagittal})
    for (const double sign : {1.0, -1.0}) {
      const SlicePlane expected = plane_across(axis, 3);
      const SlicePlane plane = oblique_plane({1, 2, 3}, sign * Vec3::Unit(static_cast<int>(axis)));
      EXPECT_LT((plane.right - expected.right).norm() + (plane.down - expected.down).norm(), 1e-12);
    }
  const SlicePlane plane = oblique_plane({1, 2, 3}, {1, 2, 0.5});
  EXPECT_NEAR(plane.right.dot(Vec3(1, 2, 0.5)), 0, 1e-12);
  EXPECT_NEAR(plane.down.dot(Vec3(1, 2, 0.5)), 0, 1e-12);
  EXPECT_GT(plane.right[0], 0.5) << "the patient's left stays on the right";
  EXPECT_LT(plane.down[2], -0.5) << "head up";
}

TEST(Slice, ColoursShowTheFieldAndAreNamedWhereThereIsNone) {
  const Lattice lattice = box({12, 12, 4}, {1, 1, 1});
  const Result r = moved(lattice, 0, 0.5 * Vec3::UnitX() * Vec3::UnitX().transpose(), {0, 0, 0});
  SliceOptions options;
  options.color_by = "displacement";
  options.before = false;
  options.pixel_mm = 0.5;
  const Canvas sheet = SliceRenderer(r, nullptr, options).draw(plane_across(SliceAxis::axial, 1.5));
  // The deformed body reaches from -0.75 to 17.25 mm: violet where it stayed, yellow where it went farthest.
  const auto pixel = [&](double x) { return sheet.at(22 + static_cast<int>((x + 12.75) / 0.5), 44 + 36); };
  EXPECT_GT(pixel(1)[2], pixel(1)[1]);
  EXPECT_GT(pixel(16.5)[1], pixel(16.5)[2] + 40);
  options.color_by = "temperature";
  try {
    SliceRenderer(r, nullptr, options);
    FAIL();
  } catch (const Error& e) {
    EXPECT_EQ(e.kind(), ErrorKind::usage);
    EXPECT_NE(std::string(e.what()).find("displacement, fill"), std::string::npos) << e.what();
  }
}

TEST(Slice, AMagnifiedDisplacementHasTheColoursOfTheTrueOne) {
  const Lattice lattice = box({12, 12, 4}, {1, 1, 1});
  const Result r = moved(lattice, 0, 0.05 * Vec3::UnitX() * Vec3::UnitX().transpose(), {0, 0, 0});
  SliceOptions options;
  options.color_by = "displacement";
  options.before = false;
  options.pixel_mm = 0.5;
  options.magnified = 10;
  options.white = true;
  const Canvas sheet = SliceRenderer(magnified(r, 10), nullptr, options).draw(plane_across(SliceAxis::axial, 1.5));
  // As half as long again: from -0.75 to 17.25 mm, in the colours of 0 to 0.6 mm.
  const auto pixel = [&](double x) { return sheet.at(22 + static_cast<int>((x + 12.75) / 0.5), 44 + 36); };
  EXPECT_GT(pixel(1)[2], pixel(1)[1]);
  EXPECT_GT(pixel(16.5)[1], pixel(16.5)[2] + 40);
  EXPECT_EQ(pixel(-6), (Rgb{255, 255, 255})) << "paper";
  EXPECT_EQ(sheet.at(0, 0), (Rgb{255, 255, 255}));
}

TEST(Slice, LinesMoveWithTheMaterialAndOnlyWhereAskedFor) {
  const Lattice lattice = box({24, 24, 4}, {1, 1, 1});
  const Result r = moved(lattice, 0, Mat3::Zero(), {3, 0, 0});
  SliceOptions options;
  options.before = options.outlines = false;
  options.pixel_mm = 0.5;
  const auto pixel = [](const Canvas& sheet, double x) {
    return sheet.at(22 + static_cast<int>((x + 12.5) / 0.5), 44 + 36);
  };
  const SlicePlane plane = plane_across(SliceAxis::axial, 1.5);
  const Canvas none = SliceRenderer(r, nullptr, options).draw(plane);
  options.grid_mm = 10;
  const Canvas lines = SliceRenderer(r, nullptr, options).draw(plane);
  for (const double at : {13.0, 23.0}) {  // at rest 10 and 20 mm
    EXPECT_GT(pixel(none, at)[0], 2 * pixel(lines, at)[0]);
    EXPECT_EQ(pixel(none, at + 3), pixel(lines, at + 3));
  }
}

TEST(Slice, ColoursOfTwoStatesAreThoseOfBoth) {
  const ColorRange both = joined({1, 3, 1, 4}, {2, 5, 0.5, 5});
  EXPECT_EQ(both.low, 1);
  EXPECT_EQ(both.high, 5);
  EXPECT_EQ(both.least, 0.5);
  EXPECT_EQ(both.greatest, 5) << "nothing lies beyond";
}

TEST(Canvas, WordsTakeTheRoomThatTheySay) {
  for (const char* words : {"x", "von mises stress [kPa]", "a caption that is rather long, at 0.125 s"}) {
    const int width = Canvas::text_width(words, 13);
    Canvas canvas(width + 20, 30);
    canvas.text(words, 0, 5, 13);
    int last = 0;
    for (int y = 0; y < canvas.height(); ++y)
      for (int x = 0; x < canvas.width(); ++x)
        if (canvas.at(x, y)[0] > 0) last = std::max(last, x);
    EXPECT_LE(last, width);
    EXPECT_GE(last, width - 4) << words;
  }
}

TEST(Slice, ANarrowPictureHasItsWholeCaption) {
  const Lattice lattice = box({4, 40, 40}, {1, 1, 1});
  const Result r = moved(lattice, 0, Mat3::Zero(), Vec3::Zero());
  SliceOptions options;
  options.pixel_mm = 2;
  options.deformed = false;
  const std::string note = "NOT CONVERGED, 0.5 of the load";
  const Canvas sheet = SliceRenderer(r, nullptr, options).draw(plane_across(SliceAxis::axial, 1.5), note);
  EXPECT_GE(sheet.width(), 44 + Canvas::text_width("before: axial S = 1.5 mm, " + note, 13));
}

TEST(Canvas, PicturesOfOneSheetStandInRows) {
  Canvas red(10, 6, {255, 0, 0}), blue(10, 6, {0, 0, 255});
  const Canvas sheet = contact_sheet({red, blue, red});
  EXPECT_EQ(sheet.at(5, 3), (Rgb{255, 0, 0}));
  EXPECT_EQ(sheet.at(21, 3), (Rgb{0, 0, 255}));
  EXPECT_EQ(sheet.at(5, 15), (Rgb{255, 0, 0}));
  EXPECT_EQ(sheet.at(12, 3), (Rgb{0, 0, 0}));
}

}  // namespace test_view
