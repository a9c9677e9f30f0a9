// SPDX-License-Identifier: Apache-2.0
#include "cli/result_state.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "cli/result_report.h"
#include "hexmesh/core/error.h"
#include "hexmesh/file/result_file.h"
#include "hexmesh/scan/image_io.h"
#include "hexmesh/surface/extract.h"

namespace hextools {

using hexmesh::Error;
using hexmesh::ErrorKind;

hexmesh::Result read_with_surface(const std::filesystem::path& path) {
  hexmesh::Result result = hexmesh::read_result(path);
  hexmesh::add_surface(result);
  return result;
}

void warn_of_state(const hexmesh::Result& result, const Console& console) {
  const ResultReport said = report_of(result);
  if (said.is_preview()) console.warning("the result shows a scene that is not solved: nothing is displaced");
  if (!said.converged())
    console.warning(fmt::format("the result is not converged, it is the state at {:.3g} of the load: {}",
                                said.load_fraction(), said.reason()));
  if (const std::size_t cells = said.report.value("dropped_cells", std::size_t{0}); cells > 0)
    console.warning(
        fmt::format("{} cells of parts that nothing holds were left out of the solution: they are shown "
                    "where they were, or not at all",
                    cells));
}

bool is_preview(const hexmesh::Result& result) { return report_of(result).is_preview(); }

std::string state_note(const hexmesh::Result& result) {
  const ResultReport said = report_of(result);
  if (said.is_preview()) return "not solved yet";
  if (!said.converged()) return fmt::format("NOT CONVERGED, {:.3g} of the load", said.load_fraction());
  return result.times.empty() ? "" : fmt::format("end, {:.4g} s", result.times.back());
}

std::set<std::string> moved_by(const hexmesh::Result& result) {
  std::set<std::string> out;
  const nlohmann::json report = report_of(result).report;
  for (const nlohmann::json& c : report["conditions"])
    if (c.value("moves", false)) out.insert(c.value("name", ""));
  return out;
}

std::vector<hexmesh::Obstacle> obstacles_of(const hexmesh::Result& result) {
  const auto vector = [](const nlohmann::json& row, const char* key) -> hexmesh::Vec3 {
    hexmesh::Vec3 out = hexmesh::Vec3::Constant(NAN);
    if (const auto found = row.find(key); found != row.end())
      for (int d = 0; d < 3; ++d)
        if (const auto& value = (*found)[static_cast<std::size_t>(d)]; value.is_number()) out[d] = value.get<double>();
    return out;
  };
  std::vector<hexmesh::Obstacle> out;
  const nlohmann::json report = report_of(result).report;
  for (const nlohmann::json& contact : report["contacts"]) {
    hexmesh::Obstacle o;
    o.name = contact.value("name", "");
    if (contact.contains("plane"))
      o = {vector(contact["plane"], "point_mm"), vector(contact["plane"], "normal").normalized(), 0, o.name};
    else if (contact.contains("sphere"))
      o = {vector(contact["sphere"], "center_mm"), hexmesh::Vec3::Zero(),
           ResultReport::number_in(contact["sphere"], "radius_mm", NAN), o.name};
    if (o.point.allFinite() && o.normal.allFinite() && std::isfinite(o.radius)) out.push_back(o);
  }
  return out;
}

std::optional<hexmesh::IntensityVolume> read_scan_of(const hexmesh::Result& result, const Input* file,
                                                     const Console& console) {
  if (!file) return std::nullopt;
  hexmesh::IntensityVolume scan = hexmesh::read_intensity(file->path(), {.warn = warning_on(console)});
  const auto covered = [&](const hexmesh::Vec3& p) { return scan.grid.covers(scan.grid.continuous_index(p)); };
  if (std::none_of(result.nodes.begin(), result.nodes.end(), covered))
    throw Error(
        ErrorKind::input,
        fmt::format("scan '{}' covers no part of the body, expected the scan it was segmented on", file->known_as()));
  return scan;
}

}  // namespace hextools
