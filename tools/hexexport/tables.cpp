// SPDX-License-Identifier: Apache-2.0
#include "tables.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "cli/csv.h"
#include "cli/json_text.h"
#include "cli/parse.h"
#include "cli/result_report.h"
#include "hexmesh/core/error.h"
#include "hexmesh/file/json_limits.h"
#include "hexmesh/file/markup_file.h"
#include "hexmesh/file/result_file.h"
#include "hexmesh/lattice/embedded_points.h"

namespace hextools {

using hexmesh::Error;
using hexmesh::ErrorKind;
using hexmesh::Result;
using hexmesh::Vec3;
using nlohmann::json;

std::string nodes_csv(const Result& result) {
  std::string out = "node,x,y,z,ux,uy,uz\n";
  for (std::size_t n = 0; n < result.nodes.size(); ++n) {
    const Vec3 &x = result.nodes[n], &u = result.displacement[n];
    out += fmt::format("{},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g}\n", n, x[0], x[1], x[2], u[0], u[1], u[2]);
  }
  return out;
}

namespace {

/// As the file has it.
json whole_report(const Result& result) {
  if (result.report.empty()) throw Error(ErrorKind::input, "the result has no report, expected that of a solution");
  report_of(result);  // throws where it is none
  return hexmesh::parse_json(result.report);
}

}  // namespace

std::string report_json(const Result& result) { return json_text(whole_report(result)); }

std::string report_csv(const Result& result) {
  const json flat = whole_report(result).flatten();
  std::string out = "key,value\n";
  for (const auto& [key, value] : flat.items())
    out += csv_field(key.substr(1)) + ',' + (value.is_string() ? csv_field(value.get<std::string>()) : value.dump()) +
           '\n';
  return out;
}

std::vector<hexmesh::ConditionForce> condition_forces(const Result& result) {
  std::vector<hexmesh::ConditionForce> out;
  const ResultReport said = report_of(result);
  const json& conditions = said.report["conditions"];
  if (conditions.size() != result.conditions.size())
    throw Error(ErrorKind::input,
                fmt::format("the result's '/report/conditions' holds {} conditions, expected {} as in "
                            "'/condition_names'",
                            conditions.size(), result.conditions.size()));
  for (const json& c : conditions) {
    hexmesh::ConditionForce force{c.value("name", ""), Vec3::Zero()};
    const json reaction = c.value("reaction_n", json::array());
    for (std::size_t d = 0; d < reaction.size(); ++d)
      if (reaction[d].is_number()) force.reaction[static_cast<Eigen::Index>(d)] = reaction[d].get<double>();
    out.push_back(std::move(force));
  }
  return out;
}

std::vector<Probe> read_probes(const std::vector<std::string>& texts, RunFiles& files) {
  std::vector<Probe> out;
  for (const std::string& text : texts) {
    if (const auto point = parse_numbers<3>(text)) {
      out.push_back({text, {(*point)[0], (*point)[1], (*point)[2]}});
      continue;
    }
    std::error_code failed;
    if (text != "-" && !std::filesystem::exists(text, failed))
      throw Error(
          ErrorKind::usage,
          fmt::format("--probe is '{}', expected x,y,z in mm or the name of a markup file that is there", text));
    const Input& file = files.input(text);
    const hexmesh::Markup markup = hexmesh::read_markup(file.path());
    if (markup.points.empty())
      throw Error(ErrorKind::input, fmt::format("markup '{}' has no points, expected those to probe", text));
    for (std::size_t n = 0; n < markup.points.size(); ++n)
      out.push_back(
          {fmt::format("{}:{}", std::filesystem::path(file.known_as()).filename().string(), n + 1), markup.points[n]});
  }
  return out;
}

std::string probe_table(const std::filesystem::path& path, const Result& result, const std::vector<Probe>& probes) {
  const hexmesh::CellLocator locator = hexmesh::locator_of(result);
  std::vector<Vec3> points;
  std::vector<std::string> segments;
  for (const Probe& probe : probes) {
    if (locator.locate_position(probe.position).cell < 0)
      throw Error(ErrorKind::geometry, fmt::format("probe '{}' is more than {:g} mm from the body, expected a point of "
                                                   "it at rest",
                                                   probe.name, hexmesh::embedding_reach));
    points.push_back(probe.position);
    const std::uint16_t label = hexmesh::label_at(result.voxels, result.labels, probe.position);
    std::string name;
    for (const hexmesh::LatticeSegment& s : result.segments)
      if (s.segment.label == label && s.material) name = s.segment.name;
    segments.push_back(name);
  }
  const hexmesh::EmbeddedPoints embedded(locator, result.cell_nodes, points);
  std::string out = "probe,time_s,x,y,z,ux,uy,uz,segment\n";
  const auto add = [&](const std::vector<Vec3>& displacement, const std::string& time) {
    std::vector<Vec3> u;
    embedded.interpolate({displacement.front().data(), 3 * displacement.size()}, u);
    for (std::size_t n = 0; n < points.size(); ++n)
      out += fmt::format("{},{},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g},{}\n", csv_field(probes[n].name), time,
                         points[n][0], points[n][1], points[n][2], u[n][0], u[n][1], u[n][2], csv_field(segments[n]));
  };
  for (std::size_t n = 0; n < result.times.size(); ++n)
    add(hexmesh::read_step(path, result, n).displacement, fmt::format("{:.9g}", result.times[n]));
  if (result.times.empty()) add(result.displacement, "");
  return out;
}

}  // namespace hextools
