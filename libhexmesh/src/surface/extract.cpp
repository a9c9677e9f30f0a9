// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/surface/extract.h"

#include <vtkFlyingEdges3D.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkWindowedSincPolyDataFilter.h>

#include <algorithm>

#include "from_vtk.h"

namespace hexmesh {
namespace {

/// 1 inside the segment, 0 outside, with one voxel of margin; in voxel indices of the lattice's box.
void fill_mask(const Grid& voxels, const std::vector<std::uint16_t>& labels, std::uint16_t label, vtkImageData& mask) {
  const Index3& n = voxels.extent();
  mask.SetExtent(-1, n[0], -1, n[1], -1, n[2]);
  mask.AllocateScalars(VTK_UNSIGNED_CHAR, 1);
  auto* values = static_cast<unsigned char*>(mask.GetScalarPointer());
  std::fill_n(values, mask.GetNumberOfPoints(), static_cast<unsigned char>(0));
  for (std::size_t v = 0; v < labels.size(); ++v) {
    if (labels[v] != label) continue;
    const Index3 ijk = voxels.index(v);
    *static_cast<unsigned char*>(mask.GetScalarPointer(ijk[0], ijk[1], ijk[2])) = 1;
  }
}

}  // namespace

TriangleSurface extract_surface(const Grid& voxels, const std::vector<std::uint16_t>& labels, std::uint16_t label) {
  vtkNew<vtkImageData> mask;
  fill_mask(voxels, labels, label, *mask);
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

  TriangleSurface surface = from_vtk(*smooth->GetOutput());
  for (Vec3& p : surface.points) p = voxels.position(p);
  surface.segment.assign(surface.triangles.size(), label);
  return surface;
}

namespace {

/// Of a lattice or a result.
template <class Body>
TriangleSurface surfaces_of(const Body& body) {
  TriangleSurface all;
  for (const LatticeSegment& s : body.segments)
    if (s.material) append(all, extract_surface(body.voxels, body.labels, s.segment.label));
  return all;
}

}  // namespace

void add_surface(Lattice& lattice) {
  lattice.surface = surfaces_of(lattice);
  lattice.surface_of_voxels = true;
}

void add_surface(Result& result) {
  if (!result.surface_of_voxels || !result.surface.points.empty()) return;
  result.surface = surfaces_of(result);
  move_surface(result);
}

}  // namespace hexmesh
