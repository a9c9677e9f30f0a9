// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/file/itk_transform.h"

#include "hdf5.h"

namespace hexmesh {
namespace {

/// Size, origin, spacing, direction row by row: the fixed parameters of itk::DisplacementFieldTransform.
std::vector<double> fixed_parameters(const Grid& grid) {
  std::vector<double> out;
  for (const int n : grid.extent()) out.push_back(n);
  out.insert(out.end(), grid.origin().begin(), grid.origin().end());
  out.insert(out.end(), grid.spacing().begin(), grid.spacing().end());
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column) out.push_back(grid.direction()(row, column));
  return out;
}

}  // namespace

void write_itk_transform(const DisplacementField& field, const std::filesystem::path& path) {
  const std::string group = "/TransformGroup/0/", parameters = group + "TransformParameters";
  static_assert(sizeof(Eigen::Vector3f) == 3 * sizeof(float));
  const std::size_t count = 3 * field.values.size();
  hdf5::Writer file(path, hdf5::Writer::Start::anew_for_all);
  file.variable_text(group + "TransformType", "DisplacementFieldTransform_float_3_3");
  const std::vector<double> fixed = fixed_parameters(field.grid);
  file.write<double>(group + "TransformFixedParameters", fixed, {fixed.size()});
  // Not packed: it takes seconds for a tenth of the bytes.
  file.write<float>(parameters, {field.values.empty() ? nullptr : field.values.front().data(), count}, {count});
  file.close();
}

}  // namespace hexmesh
