// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/scan/transform_file.h"

#include "hexmesh/file/itk_transform.h"
#include "itk_image.h"

namespace hexmesh {

void write_transform(const DisplacementField& field, const std::filesystem::path& path) {
  if (path.extension() == ".h5") return write_itk_transform(field, path);
  using Image = itk::Image<itk::Vector<float, 3>, 3>;
  static_assert(sizeof(Image::PixelType) == sizeof(Eigen::Vector3f));
  const auto image = make_itk_image<Image>(field.grid);
  // The image has the field's own memory, which no writer changes.
  auto* values = reinterpret_cast<Image::PixelType*>(const_cast<Eigen::Vector3f*>(field.values.data()));
  image->GetPixelContainer()->SetImportPointer(values, field.values.size(), false);
  constexpr bool compresses = false;  // it takes seconds for a tenth of the bytes
  write_itk_image(*image, path, compresses);
}

}  // namespace hexmesh
