// SPDX-License-Identifier: Apache-2.0
#include "scan_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>

#include "cli/json_text.h"
#include "hexmesh/file/markup_file.h"
#include "hexmesh/file/temporary_file.h"
#include "hexmesh/surface/surface_file.h"

namespace hextools {
namespace {

using hexmesh::ScanSummary;
using hexmesh::Vec3;
using json = nlohmann::ordered_json;
namespace fs = std::filesystem;

json to_json(const Vec3& v) { return {v[0], v[1], v[2]}; }

json to_json(const ScanSummary& s) {
  json out = {{"format", s.format}, {"name", s.name}};
  for (const auto& [key, value] : s.facts) out[key] = value;
  if (s.grid) {
    const hexmesh::Grid& g = *s.grid;
    out["extent"] = g.extent();
    out["spacing_mm"] = to_json(g.spacing());
    out["origin_mm"] = to_json(g.origin());
    out["axes"] = hexmesh::axis_letters(g);
    for (int d = 0; d < 3; ++d) out["directions"].push_back(to_json(Vec3(g.direction().col(d))));
  }
  if (s.range) out["range"] = {s.range->first, s.range->second};
  if (s.layers > 0) out["layers"] = s.layers;
  for (const hexmesh::SegmentSummary& segment : s.segments) {
    json box;
    if (segment.box)
      for (int d = 0; d < 3; ++d)
        for (const double bound : {segment.box->low[d], segment.box->high[d]}) box.push_back(bound);
    out["segments"].push_back({{"label", segment.segment.label},
                               {"name", segment.segment.name},
                               {"voxels", segment.voxels},
                               {"volume_ml", static_cast<double>(segment.voxels) * s.grid->voxel_volume() / 1000},
                               {"box_mm", box},
                               {"color", segment.segment.color},
                               {"terminology", segment.segment.terminology}});
  }
  return out;
}

/// " (SCT:10200004 Liver)" of a terminology entry's type, the third of its parts.
std::string code_of(const std::string& terminology) {
  std::istringstream parts(terminology);
  std::string part, scheme, code, meaning;
  for (int n = 0; n < 3; ++n) std::getline(parts, part, '~');
  std::istringstream triplet(part);
  std::getline(triplet, scheme, '^');
  std::getline(triplet, code, '^');
  std::getline(triplet, meaning, '^');
  return terminology.empty() || code.empty() ? "" : fmt::format(" ({}:{} {})", scheme, code, meaning);
}

/// ", x 12.0 to 88.5, y ..., z ... mm"
std::string box_text(const hexmesh::SegmentSummary& segment) {
  if (!segment.box) return "";
  const auto& [low, high] = *segment.box;
  return fmt::format(", x {:.1f} to {:.1f}, y {:.1f} to {:.1f}, z {:.1f} to {:.1f} mm", low[0], high[0], low[1],
                     high[1], low[2], high[2]);
}

std::string to_text(const ScanSummary& s) {
  std::string out = fmt::format("{}: {}\n", s.format, s.name);
  for (const auto& [key, value] : s.facts)
    if (!value.empty()) out += fmt::format("  {}: {}\n", key, value);
  if (s.grid) {
    const hexmesh::Grid& g = *s.grid;
    const std::string axes = hexmesh::axis_letters(g);
    const bool oblique = std::any_of(axes.begin(), axes.end(), [](unsigned char c) { return std::islower(c); });
    out += fmt::format("  grid: {} x {} x {} voxels of {:.4g} x {:.4g} x {:.4g} mm, axes towards {}{}\n", g.extent()[0],
                       g.extent()[1], g.extent()[2], g.spacing()[0], g.spacing()[1], g.spacing()[2], axes,
                       oblique ? " (small letters: oblique)" : "");
    const Vec3 from = g.origin(), to = g.position(g.corner(7));
    out += fmt::format("  first voxel ({:.2f}, {:.2f}, {:.2f}), last ({:.2f}, {:.2f}, {:.2f}) mm LPS\n", from[0],
                       from[1], from[2], to[0], to[1], to[2]);
  }
  if (s.range) out += fmt::format("  grey values: {:g} to {:g}\n", s.range->first, s.range->second);
  if (s.layers > 1) out += fmt::format("  layers: {}\n", s.layers);
  for (const hexmesh::SegmentSummary& segment : s.segments)
    out += fmt::format("  segment {} '{}': {} voxels, {:.4g} mL{}{}\n", segment.segment.label, segment.segment.name,
                       segment.voxels, static_cast<double>(segment.voxels) * s.grid->voxel_volume() / 1000,
                       box_text(segment), code_of(segment.segment.terminology));
  return out;
}

ScanSummary of_surface(const fs::path& path) {
  const hexmesh::Shape shape = hexmesh::read_shape(path);
  Vec3 low = Vec3::Constant(INFINITY), high = -low;
  for (const Vec3& p : shape.surface.points) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  ScanSummary out{"surface", path.string()};
  out.facts = {{"points", fmt::format("{}", shape.surface.points.size())},
               {"triangles", fmt::format("{}", shape.surface.triangles.size())},
               {"lines", fmt::format("{}", shape.lines.size())},
               {"open edges", fmt::format("{}", hexmesh::count_open_edges(shape.surface))},
               {"enclosed volume", fmt::format("{:.4g} mL", hexmesh::enclosed_volume(shape.surface) / 1000)}};
  if (!shape.surface.points.empty())
    out.facts.emplace_back("box", fmt::format("({:.2f}, {:.2f}, {:.2f}) to ({:.2f}, {:.2f}, {:.2f}) mm", low[0], low[1],
                                              low[2], high[0], high[1], high[2]));
  return out;
}

ScanSummary of_markup(const fs::path& path) {
  const hexmesh::Markup markup = hexmesh::read_markup(path);
  ScanSummary out{"3D Slicer markup", path.string()};
  out.facts = {{"type", markup.type}, {"points", fmt::format("{}", markup.points.size())}};
  for (std::size_t n = 0; n < markup.points.size(); ++n) {
    const Vec3& p = markup.points[n];
    out.facts.emplace_back(fmt::format("point {}", n + 1),
                           fmt::format("({:.2f}, {:.2f}, {:.2f}) mm LPS", p[0], p[1], p[2]));
  }
  if (markup.box) {
    const Vec3 half = markup.box->to_box.rowwise().norm().cwiseInverse();
    const Vec3& c = markup.box->center;
    out.facts.emplace_back("ROI", fmt::format("{:.2f} x {:.2f} x {:.2f} mm around ({:.2f}, {:.2f}, {:.2f}) mm LPS",
                                              2 * half[0], 2 * half[1], 2 * half[2], c[0], c[1], c[2]));
  }
  return out;
}

bool is_markup_name(const fs::path& path) {
  return path.extension() == ".fcsv" || path.string().ends_with(".mrk.json");
}

}  // namespace

std::string describe_scans(const std::vector<fs::path>& paths, const hexmesh::ReadOptions& options,
                           const std::vector<std::string>& warnings, bool as_json) {
  std::vector<ScanSummary> summaries;
  std::vector<fs::path> dicom;
  for (const fs::path& path : paths) {
    if (hexmesh::is_surface_name(path)) {
      summaries.push_back(of_surface(path));
    } else if (is_markup_name(path)) {
      summaries.push_back(of_markup(path));
    } else if (hexmesh::is_dicom(path)) {
      dicom.push_back(path);
    } else {
      for (ScanSummary& s : hexmesh::summarize({path}, options)) summaries.push_back(std::move(s));
    }
  }
  if (!dicom.empty())
    for (ScanSummary& s : hexmesh::summarize(dicom, options)) summaries.push_back(std::move(s));
  for (ScanSummary& s : summaries) s.name = hexmesh::with_known_names(s.name);
  if (as_json) {
    json out = {{"inputs", json::array()}, {"warnings", warnings}};
    for (const ScanSummary& s : summaries) out["inputs"].push_back(to_json(s));
    return json_text(out);
  }
  std::string out;
  for (const ScanSummary& s : summaries) out += to_text(s);
  return out;
}

}  // namespace hextools
