// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/scan/transform_file.h"

#include <itkDisplacementFieldTransform.h>
#include <itkHDF5TransformIO.h>
#include <itkTransformFileWriter.h>

#include "itk_image.h"

namespace hexmesh {
namespace {

template <class Value>
auto make_image(const DisplacementField& field) {
  using Image = itk::Image<itk::Vector<Value, 3>, 3>;
  auto image = make_itk_image<Image>(field.grid);
  image->Allocate();
  itk::Vector<Value, 3>* to = image->GetBufferPointer();
  for (const Eigen::Vector3f& v : field.values) {
    for (unsigned d = 0; d < 3; ++d) (*to)[d] = static_cast<Value>(v[d]);
    ++to;
  }
  return image;
}

}  // namespace

void write_transform(const DisplacementField& field, const std::filesystem::path& path) {
  if (path.extension() != ".h5") return write_itk_image(*make_image<float>(field), path);
  auto transform = itk::DisplacementFieldTransform<double, 3>::New();
  transform->SetDisplacementField(make_image<double>(field));
  try {
    auto writer = itk::TransformFileWriter::New();
    writer->SetTransformIO(itk::HDF5TransformIO::New());
    writer->SetFileName(path.string());
    writer->SetUseCompression(true);
    writer->SetInput(transform);
    writer->Update();
  } catch (const itk::MemoryAllocationError&) {
    throw std::bad_alloc();
  } catch (const itk::ExceptionObject& e) {
    throw Error(ErrorKind::output, fmt::format("cannot write '{}': {}", path.string(), e.GetDescription()));
  }
}

}  // namespace hexmesh
