// SPDX-License-Identifier: Apache-2.0
#include "hexmesh/file/markup_file.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <sstream>

#include "hexmesh/core/error.h"
#include "hexmesh/file/json_limits.h"
#include "hexmesh/file/text_file.h"

namespace hexmesh {
namespace {

using nlohmann::json;

Vec3 vector_of(const json& values) {
  if (!values.is_array() || values.size() != 3) throw std::runtime_error("a position without three numbers");
  return {values[0].get<double>(), values[1].get<double>(), values[2].get<double>()};
}

/// Far beyond any body, and where squares of distances still are numbers.
constexpr double most_mm = 1e9;

void check_place(const Vec3& p) {
  if (!(p.cwiseAbs().maxCoeff() <= most_mm))  // NaN is not
    throw std::runtime_error(
        fmt::format("the position ({:g}, {:g}, {:g}), which is not within {:g} mm", p[0], p[1], p[2], most_mm));
}

Box box_of(const json& markup, const Vec3& sign) {
  const Vec3 size = vector_of(markup.at("size"));
  if (!(size.minCoeff() >= 1 / most_mm && size.maxCoeff() <= most_mm))
    throw std::runtime_error("an ROI without a positive size");
  check_place(vector_of(markup.at("center")));
  Mat3 axes = Mat3::Identity();
  // Columns are the box's axes; the names changed with the schema's version.
  for (const char* key : {"orientation", "objectToNode", "objectToBase"}) {
    if (!markup.contains(key)) continue;
    const json& m = markup[key];
    if (m.size() != 16 && m.size() != 9)
      throw std::runtime_error(fmt::format("an {} of neither 9 nor 16 numbers", key));
    const std::size_t row_length = m.size() == 16 ? 4 : 3;
    for (std::size_t r = 0; r < 3; ++r)
      for (std::size_t c = 0; c < 3; ++c)
        axes(static_cast<int>(r), static_cast<int>(c)) = m[row_length * r + c].get<double>();
    if (!(axes.transpose() * axes).isIdentity(1e-3))
      throw std::runtime_error(fmt::format("an {} that is no rotation", key));
    break;
  }
  const Mat3 turned = sign.asDiagonal() * axes;
  return {(2 * size.cwiseInverse()).asDiagonal() * turned.transpose(),
          sign.cwiseProduct(vector_of(markup.at("center")))};
}

Vec3 to_lps(const std::string& system) {
  if (system == "LPS" || system == "1") return {1, 1, 1};
  if (system == "RAS" || system == "0") return {-1, -1, 1};
  throw std::runtime_error("coordinate system '" + system + "'");
}

/// Lines "id,x,y,z,..." after comments that name the coordinate system; RAS where they do not.
Markup read_fcsv(const std::string& text) {
  std::istringstream file(text);
  Markup out{"Fiducial", {}, {}};
  Vec3 sign = to_lps("RAS");
  for (std::string line; std::getline(file, line);) {
    const std::string key = "# CoordinateSystem = ";
    if (line.starts_with(key))
      sign = to_lps(line.substr(key.size(), line.find_first_of(" \r", key.size()) - key.size()));
    if (line.empty() || line[0] == '#' || line[0] == '\r') continue;
    std::istringstream fields(line);
    std::string field;
    std::getline(fields, field, ',');
    Vec3 p;
    for (int d = 0; d < 3; ++d) {
      char* end = nullptr;
      const bool there = static_cast<bool>(std::getline(fields, field, ','));
      p[d] = std::strtod(field.c_str(), &end);
      if (!there || field.empty() || *end != '\0') throw std::runtime_error("the line '" + line.substr(0, 60) + "'");
    }
    out.points.push_back(sign.cwiseProduct(p));
  }
  if (out.points.empty()) throw std::runtime_error("no point");
  return out;
}

/// "point", how many, and so many rows x y z, LPS in mm: the points of elastix and transformix.
Markup read_elastix(const std::string& text) {
  std::istringstream file(text);
  std::string kind;
  std::size_t count = 0;
  if (!(file >> kind >> count) || kind != "point")
    throw std::runtime_error(kind == "index" ? "indices of voxels" : "no 'point' and number of points");
  Markup out{"Fiducial", {}, {}};
  Vec3 p;
  while (out.points.size() < count && file >> p[0] >> p[1] >> p[2]) out.points.push_back(p);
  if (out.points.size() < count || (file >> kind) || count == 0)
    throw std::runtime_error(fmt::format("not the {} points that it claims", count));
  return out;
}

Markup read_json(const std::string& text) {
  const json document = parse_json(text);
  const json& markup = document.at("markups").at(0);
  if (markup.value("coordinateUnits", json("mm")) != json("mm"))
    throw std::runtime_error("coordinateUnits other than mm");
  const Vec3 sign = to_lps(markup.value("coordinateSystem", "LPS"));
  Markup out{markup.at("type").get<std::string>(), {}, {}};
  for (const json& point : markup.value("controlPoints", json::array()))
    out.points.push_back(sign.cwiseProduct(vector_of(point.at("position"))));
  if (out.type == "ROI") out.box = box_of(markup, sign);
  return out;
}

}  // namespace

Markup read_markup(const std::filesystem::path& path) {
  constexpr std::uintmax_t most_bytes = std::uintmax_t{32} << 20;  // curves of many thousand points
  const std::string text = read_text_file(path, path.string(), most_bytes);
  try {
    const std::filesystem::path ending = path.extension();
    Markup out = ending == ".fcsv" ? read_fcsv(text) : ending == ".txt" ? read_elastix(text) : read_json(text);
    for (const Vec3& p : out.points) check_place(p);
    return out;
  } catch (const std::exception& e) {
    throw Error(ErrorKind::input,
                fmt::format("markup '{}' cannot be used: {}, expected a 3D Slicer .mrk.json or .fcsv, or "
                            "points of elastix (.txt)",
                            path.string(), e.what()));
  }
}

}  // namespace hexmesh
