// SPDX-License-Identifier: Apache-2.0
#include "html_report.h"

#include <fmt/format.h>
#include <openssl/evp.h>

#include <cmath>

#include "cli/result_report.h"
#include "hexmesh/view/slice.h"
#include "hexmesh/view/volume.h"
#include "svg_chart.h"

namespace hextools {
namespace {

using hexmesh::Canvas;
using hexmesh::Result;
using hexmesh::SliceAxis;
using hexmesh::Vec3;
using nlohmann::json;

constexpr const char* style = R"(
body { font: 15px/1.45 system-ui, sans-serif; color: #222; max-width: 1080px; margin: 2em auto; padding: 0 1em; }
h1 { font-size: 1.5em; } h2 { font-size: 1.15em; margin-top: 2em; border-bottom: 1px solid #ccc; }
table { border-collapse: collapse; margin: .6em 0; } caption { text-align: left; color: #555; padding-bottom: .3em; }
th, td { border: 1px solid #ccc; padding: .25em .6em; text-align: left; vertical-align: top; }
td.n { text-align: right; font-variant-numeric: tabular-nums; } th { background: #f2f2f2; }
figure { margin: 1em 0; } img { max-width: 100%; } figcaption { color: #555; }
svg text { font: 12px system-ui, sans-serif; } pre { white-space: pre-wrap; background: #f6f6f6; padding: .6em; }
.bad { background: #fdecea; border-left: 4px solid #b3261e; padding: .5em .8em; }
.note { background: #fff8e1; border-left: 4px solid #b58900; padding: .5em .8em; }
)";

std::string base64(const std::vector<std::uint8_t>& bytes) {
  std::string out(4 * ((bytes.size() + 2) / 3) + 1, '\0');
  const int size =
      EVP_EncodeBlock(reinterpret_cast<unsigned char*>(out.data()), bytes.data(), static_cast<int>(bytes.size()));
  out.resize(static_cast<std::size_t>(size));
  return out;
}

std::string figure(const Canvas& picture, const std::string& caption) {
  return fmt::format(
      "<figure><img alt=\"{0}\" src=\"data:image/png;base64,{1}\"><figcaption>{0}</figcaption></figure>\n",
      escaped_html(caption), base64(picture.png()));
}

/// A number with four digits, text as it is, lists as (a, b, c), null as a dash.
std::string shown(const json& value) {
  if (value.is_null()) return "&ndash;";
  if (value.is_boolean()) return value.get<bool>() ? "yes" : "no";
  if (value.is_number_float()) return fmt::format("{:.4g}", value.get<double>());
  if (value.is_string()) return escaped_html(value.get<std::string>());
  if (!value.is_array()) return escaped_html(value.dump());
  std::string out;
  for (const json& v : value) out += (out.empty() ? "(" : ", ") + shown(v);
  return out.empty() ? "none" : out + ")";
}

struct Column {
  std::string title;
  std::string pointer;  ///< JSON pointer into a row
};

/// Rows of a list of objects; nothing where it is empty.
std::string table(const std::string& caption, const json& rows, const std::vector<Column>& columns) {
  if (!rows.is_array() || rows.empty()) return "";
  std::string out = fmt::format("<table><caption>{}</caption><tr>", escaped_html(caption));
  for (const Column& c : columns) out += fmt::format("<th>{}</th>", escaped_html(c.title));
  out += "</tr>\n";
  for (const json& row : rows) {
    out += "<tr>";
    for (const Column& c : columns) {
      const json value = row.value(json::json_pointer(c.pointer), json());
      out += fmt::format("<td{}>{}</td>", value.is_number() || value.is_array() ? " class=n" : "", shown(value));
    }
    out += "</tr>\n";
  }
  return out + "</table>\n";
}

std::string summary(const Result& result, const json& report) {
  std::vector<std::pair<std::string, std::string>> rows;
  const auto add = [&](const std::string& name, const std::string& pointer, const std::string& unit = "") {
    const json::json_pointer at(pointer);
    if (report.contains(at) && !report[at].is_null())
      rows.emplace_back(name, shown(report[at]) + (unit.empty() ? "" : " " + unit));
  };
  add("problem", "/kind");
  add("converged", "/converged");
  add("strain", "/strain");
  add("law", "/law");
  add("volumetric term", "/volumetric");
  add("level", "/lattice/level");
  add("cells", "/lattice/cells");
  add("degrees of freedom", "/lattice/dofs");
  rows.emplace_back("voxels of the scan", fmt::format("{:.4g} x {:.4g} x {:.4g} mm", result.voxels.spacing()[0],
                                                      result.voxels.spacing()[1], result.voxels.spacing()[2]));
  const Vec3 cell = result.voxels.spacing().cwiseProduct(
      Vec3(result.voxels_per_cell[0], result.voxels_per_cell[1], result.voxels_per_cell[2]));
  rows.emplace_back("cells of the level", fmt::format("{:.4g} x {:.4g} x {:.4g} mm", cell[0], cell[1], cell[2]));
  add("Newton iterations", "/newton_iterations");
  add("linear iterations", "/linear_iterations");
  add("relative residual", "/relative_residual");
  add("load fraction", "/load_fraction");
  add("estimated error of the cells' size, mean", "/error_estimate_mm/mean", "mm");
  add("estimated error of the cells' size, largest", "/error_estimate_mm/max", "mm");
  add("error of the equations", "/error_estimate_mm/algebraic", "mm");
  add("strain energy", "/strain_energy_n_mm", "N mm");
  add("least Jacobian", "/min_jacobian");
  add("inverted cells", "/inverted_cells");
  add("inverted voxels", "/inverted_voxels");
  add("change of volume, of the whole", "/volume_change");
  add("least volume of a cell over that at rest", "/least_volume_ratio");
  add("largest", "/largest_volume_ratio");
  add("steps", "/motion/steps");
  double largest = 0, sum = 0, count = 0;
  const hexmesh::CellLocator locator = hexmesh::locator_of(result);
  for (std::size_t n = 0; n < result.surface_displacement.size(); ++n) {
    if (locator.locate_position(result.surface.points[n]).cell < 0) continue;  // of a part left out
    const double u = result.surface_displacement[n].norm();
    largest = std::max(largest, u);
    sum += u;
    ++count;
  }
  if (count > 0) {
    rows.emplace_back("largest displacement of the surface", fmt::format("{:.4g} mm", largest));
    rows.emplace_back("mean displacement of the surface points", fmt::format("{:.4g} mm", sum / count));
  }
  std::string out = "<table>";
  for (const auto& [name, value] : rows) out += fmt::format("<tr><th>{}</th><td>{}</td></tr>\n", name, value);
  return out + "</table>\n";
}

std::string pictures(const Result& result, const hexmesh::IntensityVolume* scan) {
  std::string out = "<h2>Pictures</h2>\n";
  hexmesh::VolumeOptions volume;
  volume.width = volume.height = 460;
  const hexmesh::VolumeRenderer renderer(result, scan, volume);
  Canvas rest = renderer.draw({}), deformed = renderer.draw(result.displacement);
  rest.text("at rest", 8, 8, 14);
  deformed.text("deformed", 8, 8, 14);
  out += figure(hexmesh::contact_sheet({rest, deformed}), "The body seen from the front, at rest and deformed");

  // Through the surface point that moves most, where it is at rest.
  Vec3 place = Vec3::Zero();
  double most = -1;
  for (std::size_t n = 0; n < result.surface_displacement.size(); ++n)
    if (const double u = result.surface_displacement[n].norm(); u > most) {
      most = u;
      place = result.surface.points[n];
    }
  hexmesh::SliceOptions options;
  options.color_by = "displacement";
  // Cells that are large enough to be told apart.
  const hexmesh::Bounds bounds = hexmesh::bounds_of(result);
  const Vec3 cell = result.voxels.spacing().cwiseProduct(
      Vec3(result.voxels_per_cell[0], result.voxels_per_cell[1], result.voxels_per_cell[2]));
  options.lattice = (bounds.high - bounds.low).maxCoeff() < 60 * cell.minCoeff();
  const hexmesh::SliceRenderer slices(result, scan, options);
  for (const SliceAxis axis : {SliceAxis::axial, SliceAxis::coronal, SliceAxis::sagittal}) {
    const auto across = static_cast<Eigen::Index>(axis);
    const auto [low, high] = slices.range(Vec3::Unit(across));
    // A tenth inwards, so that the body is cut.
    const double at = std::clamp(place[across], low + 0.1 * (high - low), high - 0.1 * (high - low));
    out +=
        figure(slices.draw(hexmesh::plane_across(axis, at)),
               "Before and after, near the point that moves most; the body left what is black, its surroundings were "
               "not simulated");
  }
  return out;
}

/// Error over time, by the levels that were solved.
std::string accuracy(const json& report, const json& costs) {
  const json& levels = report["levels"];
  std::string out = table("Levels solved, coarse to fine", levels,
                          {{"level", "/level"},
                           {"cells", "/cells"},
                           {"dofs", "/dofs"},
                           {"seconds", "/seconds"},
                           {"Newton", "/newton_iterations"},
                           {"linear", "/linear_iterations"},
                           {"mean error [mm]", "/error_mm/mean"},
                           {"largest [mm]", "/error_mm/max"}});
  ChartSeries curve;
  double seconds = 0;
  for (const json& l : levels) {
    seconds += ResultReport::number_in(l, "seconds", 0);
    if (l.contains("/error_mm/mean"_json_pointer) && l["error_mm"]["mean"].is_number() && seconds > 0) {
      curve.points.emplace_back(seconds, l["error_mm"]["mean"].get<double>());
      curve.labels.push_back(fmt::format("level {}", l.value("level", std::size_t{0})));
    }
  }
  if (curve.points.size() > 1)
    out += svg_chart({"seconds from the start, coarse levels included", true}, {"estimated mean error [mm]", true},
                     {curve});
  if (costs.contains("seconds")) {
    json row = costs["seconds"];
    row["memory"] = costs.value("peak_memory_mb", json());
    out += table("Time and memory", json::array({row}),
                 {{"reading [s]", "/read"},
                  {"set-up [s]", "/setup"},
                  {"solving [s]", "/solve"},
                  {"peak memory [MB]", "/memory"}});
  }
  return "<h2>What accuracy cost</h2>\n" + out;
}

std::string motion(const json& report) {
  if (!report.contains("motion")) return "";
  std::vector<ChartSeries> series = {{"kinetic", {}, {}}, {"strain", {}, {}}, {"contact", {}, {}}};
  for (const json& row : report["motion"]["rows"]) {
    const double t = ResultReport::number_in(row, "time_s", NAN);
    std::size_t n = 0;
    for (const char* energy : {"kinetic_n_mm", "strain_n_mm", "contact_n_mm"}) {
      const double value = ResultReport::number_in(row, energy, NAN);
      if (std::isfinite(t) && std::isfinite(value)) series[n].points.emplace_back(t, value);
      ++n;
    }
  }
  if (std::all_of(series[2].points.begin(), series[2].points.end(), [](const auto& p) { return p.second == 0; }))
    series.pop_back();
  return "<h2>Energies of the motion</h2>\n" + svg_chart({"time [s]"}, {"energy [N mm]"}, series);
}

std::string provenance(const Result& result, const std::string& made_by) {
  std::string out =
      "<h2>Where it comes from</h2>\n<p>Commands, each with the SHA-256 and the name of what it read (as "
      "<code>sha256sum</code> prints them):</p>\n<pre>";
  for (const std::string& line : result.history) out += escaped_html(line) + "\n";
  return out + escaped_html(made_by) + "</pre>\n";
}

}  // namespace

std::string html_report(const Result& result, const hexmesh::IntensityVolume* scan, const std::string& made_by) {
  auto [report, costs] = report_of(result);
  for (const char* list : {"levels", "effects"})
    for (std::size_t n = 0; n < costs.value(list, json::array()).size() && n < report[list].size(); ++n)
      report[list][n]["seconds"] = costs[list][n];

  std::string body = "<h1>How the organ deforms</h1>\n";
  if (!result.times.empty())
    body += fmt::format("<p class=note>A motion: figures and pictures are those of its end, at {:.4g} s.</p>\n",
                        result.times.back());
  if (!report.value("converged", true))
    body += fmt::format("<p class=bad>Not converged: the state at {:.3g} of the load. {}</p>\n",
                        ResultReport::number_in(report, "load_fraction", 0), escaped_html(report.value("reason", "")));
  if (report.value("accuracy_missed", false)) body += "<p class=bad>The accuracy asked for was not reached.</p>\n";
  for (const json& w : report["warnings"])
    body += fmt::format("<p class=note>{}</p>\n", escaped_html(w.get<std::string>()));
  body += "<h2>What was solved</h2>\n" + summary(result, report);
  json segments = json::array();
  for (const hexmesh::LatticeSegment& s : result.segments) {
    json row = {{"name", s.segment.name},
                {"ml", static_cast<double>(s.num_voxels) * result.voxels.voxel_volume() / 1000},
                {"source", s.source}};
    if (s.material) {
      row["young"] = 1e3 * s.material->young;
      row["poisson"] = s.material->poisson;
    }
    segments.push_back(row);
  }
  body += table("Segments; E in kPa", segments,
                {{"segment", "/name"},
                 {"volume [mL]", "/ml"},
                 {"E [kPa]", "/young"},
                 {"Poisson", "/poisson"},
                 {"from", "/source"}});
  body += table(
      "Conditions; reaction: force of the support on the body", report["conditions"],
      {{"condition", "/name"}, {"points", "/points"}, {"misfit [mm]", "/misfit_mm"}, {"reaction [N]", "/reaction_n"}});
  body += table("Forces", report["forces"], {{"force", "/name"}, {"total [N]", "/total_n"}});
  body += table("Contacts", report["contacts"],
                {{"obstacle", "/name"},
                 {"points that touch", "/points"},
                 {"deepest [mm]", "/deepest_mm"},
                 {"force on the body [N]", "/force_n"}});
  if (report.contains("balance")) {
    json rows = report["balance"]["acting"];
    rows.push_back(report["balance"]["sum"]);
    rows.back()["name"] = "sum";
    body += table("Balance of all that acts on the body; moments about " + shown(report["balance"]["about_mm"]) + " mm",
                  rows, {{"acts", "/name"}, {"force [N]", "/force_n"}, {"moment [N mm]", "/moment_n_mm"}});
  }
  body += pictures(result, scan);
  body += accuracy(report, costs);
  body += motion(report);
  body +=
      "<h2>Effects</h2>\n" + table("Only what the scene calls for is built and solved", report["effects"],
                                   {{"effect", "/name"}, {"on", "/active"}, {"why", "/why"}, {"seconds", "/seconds"}});
  body += provenance(result, made_by);
  return "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n"
         "<meta name=\"viewport\" content=\"width=device-width\">\n<title>How the organ deforms</title>\n<style>" +
         std::string(style) + "</style></head>\n<body>\n" + body + "</body></html>\n";
}

}  // namespace hextools
