// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/file/vtkhdf.h"

#include <fmt/format.h>

#include "shared_groups.h"

namespace hexmesh {

void write_vtkhdf(const Result& result, bool deformed, const std::filesystem::path& path) {
  hdf5::Writer file(path);
  const std::array<std::int64_t, 2> version = {1, 0};
  file.attribute<std::int64_t>("/VTKHDF", "Version", version);
  file.ascii_attribute("/VTKHDF", "Type", "UnstructuredGrid");  // ParaView 5.11 refuses UTF-8
  file.attribute("/VTKHDF", "units", "mm, N, MPa, s; patient LPS");
  for (const LatticeSegment& s : result.segments)
    file.attribute("/VTKHDF", fmt::format("segment {}", s.segment.label), s.segment.name);

  std::vector<Vec3> points = result.nodes;
  if (deformed && !result.displacement.empty())
    for (std::size_t n = 0; n < points.size(); ++n) points[n] += result.displacement[n];
  hdf5::write_points(file, "/VTKHDF/Points", points);

  std::vector<std::int64_t> connectivity, offsets = {0};
  for (const CellNodes& nodes : result.cell_nodes) {
    for (const std::size_t a : corners_around_faces) connectivity.push_back(nodes[a]);
    offsets.push_back(std::ssize(connectivity));
  }
  file.write<std::int64_t>("/VTKHDF/Connectivity", connectivity, {connectivity.size()});
  file.write<std::int64_t>("/VTKHDF/Offsets", offsets, {offsets.size()});
  constexpr std::uint8_t hexahedron = 12;  // VTK_HEXAHEDRON
  file.write<std::uint8_t>("/VTKHDF/Types", std::vector<std::uint8_t>(result.cells.size(), hexahedron),
                           {result.cells.size()});
  const auto count = [&](const char* name, std::size_t number) {
    const auto value = static_cast<std::int64_t>(number);
    file.write<std::int64_t>(name, std::span(&value, 1), {1});
  };
  count("/VTKHDF/NumberOfPoints", points.size());
  count("/VTKHDF/NumberOfCells", result.cells.size());
  count("/VTKHDF/NumberOfConnectivityIds", connectivity.size());

  if (!result.displacement.empty()) hdf5::write_points(file, "/VTKHDF/PointData/displacement", result.displacement);
  if (!result.displacement_raw.empty())
    hdf5::write_points(file, "/VTKHDF/PointData/displacement_raw", result.displacement_raw);
  if (!result.rest_displacement.empty()) {
    hdf5::write_points(file, "/VTKHDF/PointData/rest_displacement", result.rest_displacement);
    hdf5::write_points(file, "/VTKHDF/PointData/displacement_from_rest", displacement_from_rest(result));
  }
  if (!result.velocity.empty()) hdf5::write_points(file, "/VTKHDF/PointData/velocity", result.velocity);
  if (!result.load.empty()) hdf5::write_points(file, "/VTKHDF/PointData/load", result.load);
  if (!result.contact_force.empty()) hdf5::write_points(file, "/VTKHDF/PointData/contact_force", result.contact_force);
  file.write<std::uint16_t>("/VTKHDF/CellData/segment", result.segment, {result.segment.size()});
  for (const auto& [name, values] : result.cell_fields)
    file.write<double>("/VTKHDF/CellData/" + name, values, {values.size()});
  file.close();
}

}  // namespace hexmesh
