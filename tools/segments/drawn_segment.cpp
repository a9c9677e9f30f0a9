// SPDX-License-Identifier: Apache-2.0
#include "segments/drawn_segment.h"

#include <fmt/format.h>
#include <vtkFunctionParser.h>
#include <vtkNew.h>

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "cli/parse.h"
#include "hexmesh/core/error.h"
#include "hexmesh/scan/clean.h"

namespace hextools {
namespace {

using hexmesh::Error;
using hexmesh::ErrorKind;
using hexmesh::Grid;
using hexmesh::Vec3;

template <std::size_t count>
std::array<double, count> numbers(const std::string& text, const char* option, const char* expected) {
  const auto out = parse_numbers<count>(text);
  if (!out) throw Error(ErrorKind::usage, fmt::format("{} is '{}', expected {}", option, text, expected));
  return *out;
}

/// LOW:HIGH, infinite where left out.
std::pair<double, double> range_of(const std::string& text) {
  const std::size_t colon = text.find(':');
  const auto bound = [&](const std::string& part, double otherwise) {
    return part.empty() ? std::optional(otherwise) : parse_number<double>(part);
  };
  const auto low = bound(text.substr(0, colon), -INFINITY);
  const auto high = colon == std::string::npos ? std::nullopt : bound(text.substr(colon + 1), INFINITY);
  if (!low || !high || !(*low <= *high))
    throw Error(ErrorKind::usage,
                fmt::format("--threshold is '{}', expected LOW:HIGH, numbers with LOW <= HIGH, or one of them", text));
  return {*low, *high};
}

/// An expression of a place, as VTK reads it.
class Expression {
public:
  /// @throws Error{usage} with what is wrong
  explicit Expression(const std::string& text) {
    vtkObject::GlobalWarningDisplayOff();  // the error says it
    for (auto& [missing, parser] : readings_) {
      for (const char* name : {"x", "y", "z"}) parser->SetScalarVariableValue(name, 1);
      parser->SetFunction(text.c_str());
      parser->SetReplacementValue(missing);
      parser->ReplaceInvalidValuesOn();
      int position = 0;
      char* error = nullptr;
      parser->CheckExpression(position, &error);
      if (error || parser->IsScalarResult() == 0)
        throw Error(ErrorKind::usage, fmt::format("--implicit is '{}': {}, expected an expression of x, y, z", text,
                                                  error ? in_one_line(error) : "it is no number"));
    }
  }

  /// Whether it is at most 0; not where it, or a part of it, has no value.
  bool is_inside(const Vec3& place) {
    std::array<double, 2> values{};
    for (std::size_t n = 0; n < 2; ++n) {
      vtkFunctionParser& parser = *readings_[n].parser;
      for (int d = 0; d < 3; ++d) parser.SetScalarVariableValue(d, place[d]);
      values[n] = parser.GetScalarResult();
      if (!(values[n] <= 0)) return false;
    }
    return values[0] == values[1];
  }

private:
  static std::string in_one_line(std::string text) {
    std::replace(text.begin(), text.end(), '\n', ' ');
    return text;
  }

  /// Parts that have no value stand for one number and for another: where that makes a difference there is none.
  struct Reading {
    double missing;
    vtkNew<vtkFunctionParser> parser;
  };
  std::array<Reading, 2> readings_ = {
      {{std::numeric_limits<double>::infinity(), {}}, {-std::numeric_limits<double>::infinity(), {}}}};
};

/// The box around a zone in voxels of a size.
Grid grid_of(const hexmesh::Box& zone, double spacing) {
  // The corners of the zone are at to_box^-1 (+-1, +-1, +-1).
  const Vec3 half = zone.to_box.inverse().cwiseAbs().rowwise().sum();
  const Vec3 counts = (2 * half / spacing).array().ceil().max(1);
  constexpr double most_voxels = 0x1p31;
  if (!(counts.prod() <= most_voxels))
    throw Error(ErrorKind::usage, fmt::format("--spacing {:g} makes {:.3g} voxels in --box, expected at most {:.3g}",
                                              spacing, counts.prod(), most_voxels));
  const Vec3 origin = zone.center - (counts - Vec3::Ones()) / 2 * spacing;
  return Grid({static_cast<int>(counts[0]), static_cast<int>(counts[1]), static_cast<int>(counts[2])},
              Vec3::Constant(spacing), origin);
}

}  // namespace

hexmesh::LabelVolume drawn_segment(const SegmentOptions& o, const Sources& sources,
                                   const std::optional<hexmesh::Box>& zone, const hexmesh::ReadOptions& options) {
  if (o.threshold.empty() && o.sphere.empty() && o.implicit.empty() && !zone)
    throw Error(ErrorKind::usage,
                "--as makes a segment of a scan, expected --threshold, --box, --roi, --sphere or --implicit");
  std::optional<Expression> expression;
  if (!o.implicit.empty()) expression.emplace(o.implicit);
  std::optional<std::array<double, 4>> ball;
  if (!o.sphere.empty()) ball = numbers<4>(o.sphere, "--sphere", "x,y,z,r");
  if (ball && !((*ball)[3] > 0))
    throw Error(ErrorKind::usage, fmt::format("--sphere is '{}', expected a radius > 0", o.sphere));
  const auto [low, high] = range_of(o.threshold.empty() ? ":" : o.threshold);

  std::optional<hexmesh::IntensityVolume> scan;
  std::vector<std::filesystem::path> paths;
  const auto is_dicom = [](const Input* file) { return hexmesh::is_dicom(file->path()); };
  if (sources.files.size() > 1 && !std::all_of(sources.files.begin(), sources.files.end(), is_dicom))
    throw Error(ErrorKind::usage,
                fmt::format("--as takes one scan, expected one input, but there are {}", sources.files.size()));
  for (const Input* file : sources.files) paths.push_back(file->path());
  if (!paths.empty()) scan = hexmesh::read_intensity(paths, options);
  if (!scan && !o.threshold.empty())
    throw Error(ErrorKind::usage, "--threshold takes grey values, expected a scan as input");
  if (!scan && (!zone || o.spacing == 0))
    throw Error(ErrorKind::usage, "--as has no scan as input, expected --box and --spacing for its voxels");
  if (scan && o.spacing != 0)
    throw Error(ErrorKind::usage, fmt::format("--spacing {:g} goes with --as without a scan", o.spacing));

  const Grid grid = scan ? scan->grid : grid_of(*zone, o.spacing);
  hexmesh::LabelVolume out{grid, std::vector<std::uint16_t>(grid.num_voxels()), {}};
  out.segments.push_back({1, o.name_of_drawn, hexmesh::distinct_color(0), ""});
  for (std::size_t n = 0; n < out.labels.size(); ++n) {
    if (!o.threshold.empty() && !(scan->values[n] >= low && scan->values[n] <= high)) continue;
    const hexmesh::Index3 v = grid.index(n);
    const Vec3 place = grid.position(Vec3(v[0], v[1], v[2]));
    if (zone && !zone->contains(place)) continue;
    if (ball && (place - Vec3((*ball)[0], (*ball)[1], (*ball)[2])).norm() > (*ball)[3]) continue;
    if (expression && !expression->is_inside(place)) continue;
    out.labels[n] = 1;
  }
  return out;
}

void keep_connected(const SegmentOptions& o, hexmesh::LabelVolume& volume) {
  if (o.connected_to.empty()) return;
  const auto [x, y, z] = numbers<3>(o.connected_to, "--connected-to", "x,y,z");
  if (!hexmesh::keep_component_at(volume, {x, y, z}))
    throw Error(ErrorKind::geometry, fmt::format("--connected-to ({:g}, {:g}, {:g}) is not in the segment, expected a "
                                                 "place that is",
                                                 x, y, z));
}

}  // namespace hextools
