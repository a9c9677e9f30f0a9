// SPDX-License-Identifier: Apache-2.0
#include "hexsolver/markup.h"

#include <fmt/format.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "hexmesh/core/error.h"

namespace hexsolver {
namespace {

using hexmesh::Error;
using hexmesh::ErrorKind;
using nlohmann::json;

Vec3 vector_of(const json& values) {
  if (!values.is_array() || values.size() != 3) throw std::runtime_error("a position without three numbers");
  return {values[0].get<double>(), values[1].get<double>(), values[2].get<double>()};
}

Box box_of(const json& markup, const Vec3& sign) {
  const Vec3 size = vector_of(markup.at("size"));
  if (!(size.minCoeff() > 0)) throw std::runtime_error("an ROI without a positive size");
  Mat3 axes = Mat3::Identity();
  if (markup.contains("objectToBase")) {
    const json& m = markup["objectToBase"];
    if (m.size() != 16 && m.size() != 9) throw std::runtime_error("an objectToBase of neither 9 nor 16 numbers");
    const std::size_t row_length = m.size() == 16 ? 4 : 3;
    for (std::size_t r = 0; r < 3; ++r)
      for (std::size_t c = 0; c < 3; ++c)
        axes(static_cast<int>(r), static_cast<int>(c)) = m[row_length * r + c].get<double>();
  }
  const Mat3 turned = sign.asDiagonal() * axes;
  return {(2 * size.cwiseInverse()).asDiagonal() * turned.transpose(),
          sign.cwiseProduct(vector_of(markup.at("center")))};
}

}  // namespace

Markup read_markup(const std::filesystem::path& path) {
  std::ifstream file(path);
  if (!file) throw Error(ErrorKind::input, fmt::format("cannot read markup '{}', expected a file", path.string()));
  try {
    const json document = json::parse(file);
    const json& markup = document.at("markups").at(0);
    const std::string system = markup.value("coordinateSystem", "LPS");
    if (system != "LPS" && system != "RAS") throw std::runtime_error("coordinateSystem '" + system + "'");
    if (markup.value("coordinateUnits", json("mm")) != json("mm"))
      throw std::runtime_error("coordinateUnits other than mm");
    const Vec3 sign = system == "RAS" ? Vec3(-1, -1, 1) : Vec3(1, 1, 1);
    Markup out{markup.at("type").get<std::string>(), {}, {}};
    for (const json& point : markup.value("controlPoints", json::array()))
      out.points.push_back(sign.cwiseProduct(vector_of(point.at("position"))));
    if (out.type == "ROI") out.box = box_of(markup, sign);
    return out;
  } catch (const std::exception& e) {
    throw Error(ErrorKind::input,
                fmt::format("markup '{}' cannot be used: {}, expected a 3D Slicer .mrk.json", path.string(), e.what()));
  }
}

}  // namespace hexsolver
