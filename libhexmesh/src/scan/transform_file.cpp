// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/scan/transform_file.h"

#include "hexmesh/file/itk_transform.h"
#include "itk_image.h"

namespace hexmesh {

void write_transform(const DisplacementField& field, const std::filesystem::path& path) {
  if (path.extension() == ".h5") return write_itk_transform(field, path);
  using Image = itk::Image<itk::Vector<float, 3>, 3>;
  const auto image = make_itk_image<Image>(field.grid);
  image->Allocate();
  itk::Vector<float, 3>* to = image->GetBufferPointer();
  for (const Eigen::Vector3f& v : field.values) *to++ = itk::Vector<float, 3>(v.data());
  write_itk_image(*image, path);
}

}  // namespace hexmesh
