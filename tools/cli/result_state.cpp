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

namespace {

hexmesh::Vec3 vector_in(const nlohmann::json& row, const char* key) {
  hexmesh::Vec3 out = hexmesh::Vec3::Constant(NAN);
  if (const auto found = row.find(key); found != row.end())
    for (int d = 0; d < 3; ++d)
      if (const auto& value = (*found)[static_cast<std::size_t>(d)]; value.is_number()) out[d] = value.get<double>();
  return out;
}

double radius_in(const nlohmann::json& row) { return ResultReport::number_in(row, "radius_mm", NAN); }

/// A capsule or a cylinder.
template <class Bar>
std::optional<hexmesh::Solid> bar_in(const nlohmann::json& row) {
  const Bar bar{vector_in(row, "from_mm"), vector_in(row, "to_mm"), radius_in(row)};
  if (!bar.from.allFinite() || !bar.to.allFinite() || bar.from == bar.to || !std::isfinite(bar.radius)) return {};
  return bar;
}

std::optional<hexmesh::Solid> block_in(const nlohmann::json& row) {
  hexmesh::Block block{vector_in(row, "center_mm"), hexmesh::Mat3::Identity(), vector_in(row, "size_mm") / 2};
  block.axes << vector_in(row, "axis_x"), vector_in(row, "axis_y"), vector_in(row, "axis_z");
  if (!block.center.allFinite() || !block.half.allFinite() || !block.axes.isUnitary(1e-6)) return {};
  return block;
}

/// What a contact of a report is with; nothing of surfaces, which reports only name, and of what is no number.
std::optional<hexmesh::Solid> solid_in(const nlohmann::json& contact) {
  if (contact.contains("plane")) {
    const hexmesh::HalfSpace plane{vector_in(contact["plane"], "point_mm"),
                                   vector_in(contact["plane"], "normal").normalized()};
    if (plane.point.allFinite() && plane.normal.allFinite()) return plane;
  }
  if (contact.contains("sphere")) {
    const hexmesh::Ball ball{vector_in(contact["sphere"], "center_mm"), radius_in(contact["sphere"])};
    if (ball.center.allFinite() && std::isfinite(ball.radius)) return ball;
  }
  if (contact.contains("capsule")) return bar_in<hexmesh::Capsule>(contact["capsule"]);
  if (contact.contains("cylinder")) return bar_in<hexmesh::Cylinder>(contact["cylinder"]);
  if (contact.contains("box")) return block_in(contact["box"]);
  return {};
}

}  // namespace

std::vector<hexmesh::Obstacle> obstacles_of(const hexmesh::Result& result) {
  std::vector<hexmesh::Obstacle> out;
  const nlohmann::json report = report_of(result).report;
  for (const nlohmann::json& contact : report["contacts"])
    if (auto solid = solid_in(contact)) out.push_back({std::move(*solid), contact.value("name", "")});
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
