// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vtkPolyData.h>

#include "hexmesh/geometry/triangle_surface.h"

namespace hexmesh {

/// Points and triangles as they are; cells that are no triangles are left out; no segments.
TriangleSurface from_vtk(vtkPolyData& mesh);

}  // namespace hexmesh
