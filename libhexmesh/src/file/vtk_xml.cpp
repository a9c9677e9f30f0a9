// SPDX-License-Identifier: Apache-2.0
#include "vtk_xml.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <map>
#include <set>
#include <string>
#include <string_view>

#include "hexmesh/core/error.h"
#include "refuse.h"

namespace hexmesh {
namespace {

using Attributes = std::map<std::string, std::string>;

/// name="value" or name='value', as often as they come.
Attributes attributes_of(std::string_view tag) {
  Attributes out;
  for (std::size_t at = tag.find('='); at != tag.npos; at = tag.find('=', at + 1)) {
    const std::size_t quote = tag.find_first_not_of(" \t\r\n", at + 1);
    if (quote == tag.npos || (tag[quote] != '"' && tag[quote] != '\'')) continue;
    const std::size_t end = tag.find(tag[quote], quote + 1);
    if (end == tag.npos) break;
    const std::size_t last = tag.find_last_not_of(" \t\r\n", at == 0 ? 0 : at - 1);
    const std::size_t blank = tag.find_last_of(" \t\r\n", last);
    if (last != tag.npos && blank != tag.npos)
      out[std::string(tag.substr(blank + 1, last - blank))] = tag.substr(quote + 1, end - quote - 1);
    at = end;
  }
  return out;
}

}  // namespace

void check_vtk_xml(const std::filesystem::path& path, const char* kind) {
  static const std::set<std::string_view> elements = {
      "?xml",  "!--",   "VTKFile", "Piece", "PointData", "CellData",  "FieldData", "Points",
      "Verts", "Lines", "Strips",  "Polys", "DataArray", "ImageData", "PolyData",  "AppendedData"};
  static const std::set<std::string_view> types = {"Int8",   "UInt8", "Int16",  "UInt16",  "Int32",
                                                   "UInt32", "Int64", "UInt64", "Float32", "Float64"};
  std::ifstream file(path, std::ios::binary);
  const std::string bytes((std::istreambuf_iterator<char>(file)), {});
  const std::string_view text(bytes);
  const double most = static_cast<double>(best_deflation) * static_cast<double>(bytes.size());
  std::string whole;
  int pieces = 0;
  bool kind_seen = false, in_field_data = false;
  for (std::size_t at = text.find('<'); at != text.npos; at = text.find('<', at + 1)) {
    if (at + 1 < text.size() && text[at + 1] == '/') {
      in_field_data &= !text.substr(at + 2).starts_with("FieldData");
      continue;
    }
    const std::size_t end = text.find('>', at);
    if (end == text.npos) refuse(path, "is no valid VTK XML file: a '<' without '>'");
    const std::string_view tag = text.substr(at + 1, end - at - 1);
    const std::string_view name =
        tag.starts_with("!--") ? tag.substr(0, 3) : tag.substr(0, tag.find_first_of(" \t\r\n/"));
    in_field_data |= name == "FieldData" && !tag.ends_with('/');
    const bool words = in_field_data && name == "Array";  // 3D Slicer says SPACE there
    if (!elements.contains(name) && !words)
      refuse(path, "has an element '{}', expected those of VTK {}", std::string(name.substr(0, 40)), kind);
    kind_seen |= name == kind;
    const Attributes attributes = attributes_of(tag);
    // What no piece covers, VTK leaves as it was in memory.
    if (attributes.contains("WholeExtent")) whole = attributes.at("WholeExtent");
    if (name == "Piece" && ++pieces > 1) refuse(path, "consists of several pieces, expected one");
    if (name == "Piece" && attributes.contains("Extent") && attributes.at("Extent") != whole)
      refuse(path, "has a piece of extent '{}', expected the whole, '{}'", attributes.at("Extent"), whole);
    for (const auto& [key, value] : attributes) {
      if (!key.starts_with("NumberOf") && key != "offset") continue;
      const double count = std::strtod(value.c_str(), nullptr);
      if (!(count >= 0 && count <= most))
        refuse(path, "has {} = '{}', more than its {} bytes hold", key, value, bytes.size());
    }
    if (name == "DataArray") {
      const auto type = attributes.find("type");
      if (type == attributes.end() || !types.contains(type->second))
        refuse(path, "has an array of type '{}', expected numbers", type == attributes.end() ? "" : type->second);
    }
    if (name == "AppendedData") break;  // what follows is data
  }
  if (pieces == 0) refuse(path, "has no piece, expected one");
  if (!kind_seen) refuse(path, "is no VTK XML file of type {}", kind);
}

}  // namespace hexmesh
