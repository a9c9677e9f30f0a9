// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <vtkDataArray.h>
#include <vtkImageData.h>
#include <vtkInformation.h>
#include <vtkMatrix3x3.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkStreamingDemandDrivenPipeline.h>
#include <vtkXMLImageDataReader.h>

#include "../file/refuse.h"
#include "../file/vtk_xml.h"
#include "hexmesh/core/error.h"
#include "stored_volume.h"
#include "volume_header.h"

namespace hexmesh {
namespace {

template <class T>
StoredValues copy_of(vtkDataArray& array) {
  const auto* first = static_cast<const T*>(array.GetVoidPointer(0));
  return std::vector<T>(first, first + array.GetNumberOfValues());
}

StoredValues values_of(vtkDataArray& array, const std::filesystem::path& path) {
  switch (array.GetDataType()) {
    case VTK_UNSIGNED_CHAR:
      return copy_of<std::uint8_t>(array);
    case VTK_CHAR:
    case VTK_SIGNED_CHAR:
      return copy_of<std::int8_t>(array);
    case VTK_UNSIGNED_SHORT:
      return copy_of<std::uint16_t>(array);
    case VTK_SHORT:
      return copy_of<std::int16_t>(array);
    case VTK_UNSIGNED_INT:
      return copy_of<std::uint32_t>(array);
    case VTK_INT:
      return copy_of<std::int32_t>(array);
    case VTK_UNSIGNED_LONG:
    case VTK_UNSIGNED_LONG_LONG:
      return copy_of<std::uint64_t>(array);
    case VTK_LONG:
    case VTK_LONG_LONG:
    case VTK_ID_TYPE:
      return copy_of<std::int64_t>(array);
    case VTK_FLOAT:
      return copy_of<float>(array);
    case VTK_DOUBLE:
      return copy_of<double>(array);
    default:
      refuse(path, "has values of VTK type {}, expected numbers", array.GetDataType());
  }
}

}  // namespace

StoredVolume read_vti(const std::filesystem::path& path, const ReadOptions& options) {
  check_vtk_xml(path, "ImageData");
  vtkObject::GlobalWarningDisplayOff();
  vtkNew<vtkXMLImageDataReader> reader;
  if (!reader->CanReadFile(path.c_str())) refuse(path, "is no valid VTK XML image file");
  reader->SetFileName(path.c_str());
  reader->UpdateInformation();
  int extent[6];
  reader->GetOutputInformation(0)->Get(vtkStreamingDemandDrivenPipeline::WHOLE_EXTENT(), extent);
  std::vector<std::int64_t> sizes;
  for (int d = 0; d < 3; ++d) sizes.push_back(std::int64_t{extent[2 * d + 1]} - extent[2 * d] + 1);
  const std::uintmax_t promised = promised_bytes(path, sizes, 1);
  constexpr std::uintmax_t largest_value = 8;
  check_memory(path, promised_bytes(path, sizes, largest_value), options);
  check_plausible(path, promised, best_deflation);
  reader->Update();
  vtkImageData& image = *reader->GetOutput();
  vtkDataArray* array = image.GetPointData()->GetScalars();
  if (!array && image.GetPointData()->GetNumberOfArrays() == 1) array = image.GetPointData()->GetArray(0);
  if (reader->GetErrorCode() != 0 || !array) refuse(path, "holds no values at its points, expected one array");
  Index3 size;
  Vec3 spacing, first;
  Mat3 direction;
  for (int d = 0; d < 3; ++d) {
    size[d] = static_cast<std::int32_t>(sizes[d]);
    spacing[d] = image.GetSpacing()[d];
    first[d] = extent[2 * d];
    for (int e = 0; e < 3; ++e) direction(e, d) = image.GetDirectionMatrix()->GetElement(e, d);
  }
  const Vec3 origin = Vec3(image.GetOrigin()) + direction * spacing.cwiseProduct(first);
  if (array->GetNumberOfTuples() != static_cast<vtkIdType>(promised)) refuse(path, "holds fewer values than voxels");
  try {
    return {"VTI",
            Grid(size, spacing, origin, direction),
            static_cast<std::size_t>(array->GetNumberOfComponents()),
            values_of(*array, path),
            {}};
  } catch (const Error& e) {
    refuse(path, "{}", e.what());
  }
}

}  // namespace hexmesh
