// SPDX-License-Identifier: Apache-2.0
#include "from_vtk.h"

#include <vtkIdList.h>
#include <vtkNew.h>

namespace hexmesh {

TriangleSurface from_vtk(vtkPolyData& mesh) {
  TriangleSurface surface;
  for (vtkIdType p = 0; p < mesh.GetNumberOfPoints(); ++p) surface.points.push_back(Vec3::Map(mesh.GetPoint(p)));
  vtkNew<vtkIdList> ids;
  for (vtkIdType c = 0; c < mesh.GetNumberOfCells(); ++c) {
    mesh.GetCellPoints(c, ids);
    if (ids->GetNumberOfIds() != 3) continue;
    std::array<std::int32_t, 3> triangle;
    for (int a = 0; a < 3; ++a) triangle[a] = static_cast<std::int32_t>(ids->GetId(a));
    surface.triangles.push_back(triangle);
  }
  return surface;
}

}  // namespace hexmesh
