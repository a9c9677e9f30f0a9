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
  constexpr std::size_t block = std::size_t{1} << 16;  // vectors that become double at once
  const std::string group = "/TransformGroup/0/", parameters = group + "TransformParameters";
  hdf5::Writer file(path, hdf5::Writer::Start::anew_for_all);
  file.variable_text(group + "TransformType", "DisplacementFieldTransform_double_3_3");
  const std::vector<double> fixed = fixed_parameters(field.grid);
  file.write<double>(group + "TransformFixedParameters", fixed, {fixed.size()});
  file.declare<double>(parameters, {3 * field.values.size()}, true);
  std::vector<double> values;
  for (std::size_t first = 0; first < field.values.size(); first += block) {
    values.clear();
    for (std::size_t n = first; n < std::min(first + block, field.values.size()); ++n)
      values.insert(values.end(), field.values[n].begin(), field.values[n].end());
    file.write_rows<double>(parameters, values, 3 * first, values.size());
  }
  file.close();
}

}  // namespace hexmesh
