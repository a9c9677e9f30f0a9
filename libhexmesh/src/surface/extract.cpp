// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/surface/extract.h"

#include <vtkFlyingEdges3D.h>
#include <vtkIdList.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPolyData.h>
#include <vtkWindowedSincPolyDataFilter.h>

#include <algorithm>

namespace hexmesh {
namespace {

/// 1 inside the segment, 0 outside, with one voxel of margin; in voxel indices of the lattice's box.
void fill_mask(const Lattice& lattice, std::uint16_t label, vtkImageData& mask) {
  const Index3& n = lattice.voxels.extent();
  mask.SetExtent(-1, n[0], -1, n[1], -1, n[2]);
  mask.AllocateScalars(VTK_UNSIGNED_CHAR, 1);
  auto* values = static_cast<unsigned char*>(mask.GetScalarPointer());
  std::fill_n(values, mask.GetNumberOfPoints(), static_cast<unsigned char>(0));
  for (std::size_t v = 0; v < lattice.labels.size(); ++v) {
    if (lattice.labels[v] != label) continue;
    const Index3 ijk = lattice.voxels.index(v);
    *static_cast<unsigned char*>(mask.GetScalarPointer(ijk[0], ijk[1], ijk[2])) = 1;
  }
}

void append(vtkPolyData& mesh, const Grid& voxels, std::uint16_t label, TriangleSurface& surface) {
  const auto first = static_cast<std::int32_t>(surface.points.size());
  for (vtkIdType p = 0; p < mesh.GetNumberOfPoints(); ++p)
    surface.points.push_back(voxels.position(Vec3::Map(mesh.GetPoint(p))));
  vtkNew<vtkIdList> ids;
  for (vtkIdType c = 0; c < mesh.GetNumberOfCells(); ++c) {
    mesh.GetCellPoints(c, ids);
    std::array<std::int32_t, 3> triangle;
    for (int a = 0; a < 3; ++a)
      triangle[static_cast<std::size_t>(a)] = first + static_cast<std::int32_t>(ids->GetId(a));
    surface.triangles.push_back(triangle);
    surface.segment.push_back(label);
  }
}

}  // namespace

TriangleSurface extract_surface(const Lattice& lattice) {
  TriangleSurface surface;
  for (const LatticeSegment& s : lattice.segments) {
    if (!s.material) continue;
    vtkNew<vtkImageData> mask;
    fill_mask(lattice, s.segment.label, *mask);
    vtkNew<vtkFlyingEdges3D> contour;
    contour->SetInputData(mask);
    contour->SetValue(0, 0.5);
    contour->ComputeNormalsOff();
    contour->ComputeGradientsOff();
    contour->ComputeScalarsOff();
    vtkNew<vtkWindowedSincPolyDataFilter> smooth;
    smooth->SetInputConnection(contour->GetOutputPort());
    smooth->SetNumberOfIterations(20);
    smooth->SetPassBand(0.05);
    smooth->NormalizeCoordinatesOn();
    smooth->NonManifoldSmoothingOn();
    smooth->BoundarySmoothingOff();
    smooth->Update();
    append(*smooth->GetOutput(), lattice.voxels, s.segment.label, surface);
  }
  return surface;
}

}  // namespace hexmesh
